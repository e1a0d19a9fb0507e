//! The shape of a cutter, as a person or a comment of the program tells it.

use std::{fmt, str::FromStr};

/// A cutter as it turns about its axis: a plane disc at its tip, a rounded corner around it, a cone
/// from there, up to its greatest radius.
///
/// A ball is all corner, a flat end mill all disc, a V all cone; a tapered ball is corner and cone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Radius of the disc, mm.
    pub disc_mm: f64,
    /// Radius of the corner, mm.
    pub corner_mm: f64,
    /// How steeply the cone rises, mm per mm away from the axis; infinite where there is none.
    pub cone: f64,
    /// Greatest radius, mm.
    pub radius_mm: f64,
}

/// Why a cutter cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "'{text}' is no cutter: {why}; write ball:d6mm (diameter) or ball:r3mm (radius), flat:d12mm, bull:d12mm,r1mm (its corner's radius last), vee:60deg,d6mm (all of its angle; the flat of its tip may follow, as d0.2mm), taper:r1mm,5deg,d6mm (its ball, its angle to one side, its greatest diameter)"
)]
pub struct ToolError {
    text: String,
    why: String,
}

/// Accepted radii, mm.
const RADII_MM: (f64, f64) = (0.001, 100.0);
/// Steepest cone, from the axis: nearly a cylinder.
const LEAST_HALF_ANGLE_DEG: f64 = 0.1;

impl Tool {
    /// A ball of this radius, mm.
    pub fn ball(radius_mm: f64) -> Self {
        Self { disc_mm: 0.0, corner_mm: radius_mm, cone: f64::INFINITY, radius_mm }
    }

    /// A flat end mill of this radius, mm.
    pub fn flat(radius_mm: f64) -> Self {
        Self { disc_mm: radius_mm, corner_mm: 0.0, cone: f64::INFINITY, radius_mm }
    }

    /// A bull-nose cutter with its corner's radius, mm.
    pub fn bull(radius_mm: f64, corner_mm: f64) -> Self {
        Self { disc_mm: radius_mm - corner_mm, corner_mm, cone: f64::INFINITY, radius_mm }
    }

    /// The same as a workshop says it.
    pub fn in_words(&self) -> String {
        let diameter = number(2.0 * self.radius_mm);
        let half = number(self.half_angle_deg());
        match (self.cone.is_finite(), self.corner_mm > 0.0, self.disc_mm > 0.0) {
            (false, true, false) => format!("ball, {diameter} mm diameter"),
            (false, false, _) => format!("flat, {diameter} mm diameter"),
            (false, true, true) => format!("bull, {diameter} mm diameter, corner radius {} mm", number(self.corner_mm)),
            (true, true, _) => {
                format!("tapered ball of {} mm radius, {half} degrees to a side", number(self.corner_mm))
            }
            (true, false, _) => format!("V of {} degrees", number(2.0 * self.half_angle_deg())),
        }
    }

    /// Angle of the cone to the axis, degrees.
    fn half_angle_deg(&self) -> f64 {
        (1.0 / self.cone).atan().to_degrees()
    }

    fn checked(self) -> Result<Self, String> {
        let (least, most) = RADII_MM;
        if !(least..=most).contains(&self.radius_mm) {
            return Err(format!("its radius is {} mm, and must lie between {least} and {most} mm", self.radius_mm));
        }
        if !(self.disc_mm >= 0.0 && self.corner_mm >= 0.0 && self.disc_mm + self.corner_mm <= self.radius_mm + 1e-12) {
            return Err(format!(
                "its corner ({} mm) and what lies within ({} mm) are more than its radius of {} mm",
                self.corner_mm, self.disc_mm, self.radius_mm
            ));
        }
        Ok(self)
    }
}

/// A number without digits that are rounding.
fn number(value: f64) -> f64 {
    (1e6 * value).round() / 1e6
}

impl fmt::Display for Tool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let diameter = number(2.0 * self.radius_mm);
        match (self.cone.is_finite(), self.corner_mm > 0.0, self.disc_mm > 0.0) {
            (false, true, false) => write!(f, "ball:d{diameter}mm"),
            (false, false, _) => write!(f, "flat:d{diameter}mm"),
            (false, true, true) => write!(f, "bull:d{diameter}mm,r{}mm", number(self.corner_mm)),
            (true, true, _) => {
                write!(f, "taper:r{}mm,{}deg,d{diameter}mm", number(self.corner_mm), number(self.half_angle_deg()))
            }
            (true, false, disc) => {
                write!(f, "vee:{}deg,d{diameter}mm", number(2.0 * self.half_angle_deg()))?;
                if disc { write!(f, ",d{}mm", number(2.0 * self.disc_mm)) } else { Ok(()) }
            }
        }
    }
}

impl FromStr for Tool {
    type Err = ToolError;

    /// Reads `ball:d6mm`, `ball:r3mm`, `flat:d12mm`, `bull:d12mm,r1mm`, `vee:60deg,d6mm`,
    /// `vee:60deg,d6mm,d0.2mm`, `taper:r1mm,5deg,d6mm`, with mm, cm, m or in; a bare number is mm.
    /// Without a letter a size is a radius.
    fn from_str(text: &str) -> Result<Self, ToolError> {
        let fault = |why: String| ToolError { text: text.to_owned(), why };
        let (kind, sizes) = text.split_once(':').ok_or_else(|| fault("it names no size".into()))?;
        let sizes: Vec<&str> = sizes.split(',').map(str::trim).collect();
        let radius = |text: &str| radius_mm(text).map_err(fault);
        let tool = match (kind.trim().to_ascii_lowercase().as_str(), sizes.as_slice()) {
            ("ball", [size]) => Self::ball(radius(size)?),
            ("flat", [size]) => Self::flat(radius(size)?),
            ("bull", [size, corner]) => Self::bull(radius(size)?, radius(corner)?),
            ("vee" | "v", [angle, size, rest @ ..]) if rest.len() < 2 => Self {
                disc_mm: rest.first().map_or(Ok(0.0), |tip| radius(tip))?,
                corner_mm: 0.0,
                cone: cone(angle, 0.5).map_err(fault)?,
                radius_mm: radius(size)?,
            },
            ("taper", [ball, angle, size]) => Self {
                disc_mm: 0.0,
                corner_mm: radius(ball)?,
                cone: cone(angle, 1.0).map_err(fault)?,
                radius_mm: radius(size)?,
            },
            ("ball" | "flat" | "bull" | "vee" | "v" | "taper", _) => {
                return Err(fault("it has another number of sizes".into()));
            }
            (other, _) => return Err(fault(format!("there is no kind '{other}'"))),
        };
        tool.checked().map_err(fault)
    }
}

/// The rise of a cone whose angle to the axis is this part of the one that is written.
fn cone(text: &str, part: f64) -> Result<f64, String> {
    let degrees = text.strip_suffix("deg").unwrap_or(text).trim();
    let half = part * degrees.parse::<f64>().map_err(|_| format!("'{text}' is no angle"))?;
    if (LEAST_HALF_ANGLE_DEG..90.0).contains(&half) {
        Ok(1.0 / half.to_radians().tan())
    } else {
        Err(format!(
            "its cone stands at {half} degrees to the axis, and must lie between {LEAST_HALF_ANGLE_DEG} and 90"
        ))
    }
}

/// A radius, or half a diameter, mm.
fn radius_mm(text: &str) -> Result<f64, String> {
    let lower = text.to_ascii_lowercase();
    if let Some(diameter) = lower.strip_prefix('d') {
        return Ok(0.5 * length_mm(diameter)?);
    }
    length_mm(lower.strip_prefix('r').unwrap_or(&lower))
}

fn length_mm(text: &str) -> Result<f64, String> {
    let (number, scale) = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("m", 1000.0)]
        .into_iter()
        .find_map(|(unit, scale)| text.trim().strip_suffix(unit).map(|number| (number, scale)))
        .unwrap_or((text, 1.0));
    match number.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value * scale),
        _ => Err(format!("'{text}' is no length")),
    }
}

/// The tools that a comment tells of, with their numbers: as Fusion's posts write it (`T1 D=6.
/// CR=3. TAPER=0deg - ZMIN=-4.5 - ball end mill`), or in this program's own form, with or without
/// a number (`tool: ball:d6mm`, `tool 2: flat:d6mm`). `unit_mm` are the units of the program.
pub fn tools_in(comment: &str, unit_mm: f64) -> Option<(u32, Tool)> {
    let text = comment.trim();
    let lower = text.to_ascii_lowercase();
    if let Some(rest) = lower.strip_prefix("tool") {
        let (tool, form) = rest.split_once(':')?;
        let tool = if tool.trim().is_empty() { 0 } else { tool.trim().parse().ok()? };
        let form = form.split(|c: char| c == ';' || c.is_whitespace()).find(|part| !part.is_empty())?;
        return form.parse().ok().map(|shape| (tool, shape));
    }
    let mut words = lower.split_whitespace();
    let tool = words.next()?.strip_prefix('t')?.parse().ok()?;
    let (mut diameter, mut corner, mut taper) = (None, 0.0, 0.0);
    for word in words {
        let Some((key, value)) = word.split_once('=') else { continue };
        let value = value.trim_end_matches("deg").parse::<f64>().ok();
        match (key, value) {
            ("d", Some(value)) => diameter = Some(value * unit_mm),
            ("cr", Some(value)) => corner = value * unit_mm,
            ("taper", Some(value)) => taper = value,
            _ => {}
        }
    }
    let radius_mm = 0.5 * diameter?;
    let shape = if taper > 0.0 {
        // Of a tapered mill the diameter is that of its tip: how far up it is used nobody says.
        return None;
    } else {
        Tool { disc_mm: radius_mm - corner, corner_mm: corner, cone: f64::INFINITY, radius_mm }
    };
    shape.checked().ok().map(|shape| (tool, shape))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cutters_are_read_as_they_are_written() {
        for (forms, words) in [
            (["ball:d6mm", "ball:r3mm", "ball:3mm"].as_slice(), "ball, 6 mm diameter"),
            (&["flat:d12mm", "flat:6"], "flat, 12 mm diameter"),
            (&["bull:d12mm,r1mm", "bull:6mm,1mm"], "bull, 12 mm diameter, corner radius 1 mm"),
            (&["vee:60deg,d6mm", "V:60deg,3mm"], "V of 60 degrees"),
            (&["vee:60deg,d6mm,d0.2mm"], "V of 60 degrees"),
            (&["taper:r1mm,5deg,d6mm"], "tapered ball of 1 mm radius, 5 degrees to a side"),
        ] {
            for text in forms {
                let tool: Tool = text.parse().unwrap();
                assert_eq!((tool.to_string().as_str(), tool.in_words().as_str()), (forms[0], words), "{text}");
            }
        }
        for text in [
            "",
            "ball",
            "ball:",
            "ball:x",
            "cone:3",
            "ball:-3mm",
            "ball:nan",
            "flat:0",
            "bull:3",
            "bull:3,4",
            "vee:190deg,d6mm",
            "vee:d6mm",
            "taper:r4mm,5deg,d6mm",
            "ball:1m",
        ] {
            assert!(text.parse::<Tool>().is_err(), "{text} was taken");
        }
    }

    #[test]
    fn comments_of_posts_tell_of_tools() {
        let fusion = tools_in("T2 D=6. CR=3. - ZMIN=-4.5 - ball end mill", 1.0);
        assert_eq!(fusion, Some((2, Tool::ball(3.0))));
        assert_eq!(tools_in("T1  D=0.25 CR=0. - ZMIN=-0.2 - FLAT END MILL", 25.4), Some((1, Tool::flat(3.175))));
        assert_eq!(tools_in("tool: ball:d6mm; Z is that of its tip", 1.0), Some((0, Tool::ball(3.0))));
        assert_eq!(tools_in("tool 3: bull:d12mm,r1mm", 1.0), Some((3, Tool::bull(6.0, 1.0))));
        for text in ["", "TOOLPATH", "T1 M6", "Tool change", "T3 D=6. CR=1. TAPER=5deg", "T1 D=6. CR=4."] {
            assert_eq!(tools_in(text, 1.0), None, "{text}");
        }
    }
}
