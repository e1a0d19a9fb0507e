//! The cutters that can make a free-form face: ball-nose, flat and bull-nose end mills.

use std::{fmt, str::FromStr};

/// The end of a cutter, as it is turned about its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutterShape {
    /// A hemisphere.
    Ball,
    /// A plane with a sharp rim.
    Flat,
    /// A plane whose rim is rounded.
    Bull,
}

/// A cutter with its radius and the radius of its corner, mm.
///
/// All three are one family: a plane disc of radius `radius - corner` with a torus of radius
/// `corner` around it. A ball is all corner, a flat end mill has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutter {
    shape: CutterShape,
    radius_mm: f64,
    corner_mm: f64,
}

/// Why a cutter cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CutterError {
    /// A radius out of range.
    #[error(
        "the cutter's radius is {radius_mm} mm, its diameter {} mm; the radius must lie between {} mm and {} mm",
        2.0 * radius_mm,
        Cutter::RADIUS_LIMITS_MM.0,
        Cutter::RADIUS_LIMITS_MM.1
    )]
    Radius {
        /// The refused radius, mm.
        radius_mm: f64,
    },
    /// A corner that does not fit.
    #[error(
        "the corner radius is {corner_mm} mm; it must lie above 0 and below the cutter's radius of {radius_mm} mm (a corner as large as the cutter is a ball: ball:r{radius_mm}mm)"
    )]
    Corner {
        /// The refused corner radius, mm.
        corner_mm: f64,
        /// The cutter's radius, mm.
        radius_mm: f64,
    },
    /// No cutter at all.
    #[error(
        "'{text}' is no cutter: {why}; write ball:d6mm (diameter) or ball:r3mm (radius), flat:d12mm, or bull:d12mm,r1mm (its corner's radius last)"
    )]
    Text {
        /// What was written.
        text: String,
        /// What is wrong with it.
        why: String,
    },
}

impl Cutter {
    /// Accepted radii, mm.
    pub const RADIUS_LIMITS_MM: (f64, f64) = (0.01, 100.0);

    /// A ball-nose cutter.
    ///
    /// # Errors
    /// A radius outside of its limits.
    pub fn ball(radius_mm: f64) -> Result<Self, CutterError> {
        Self::new(CutterShape::Ball, radius_mm, radius_mm)
    }

    /// A flat end mill.
    ///
    /// # Errors
    /// A radius outside of its limits.
    pub fn flat(radius_mm: f64) -> Result<Self, CutterError> {
        Self::new(CutterShape::Flat, radius_mm, 0.0)
    }

    /// A bull-nose cutter.
    ///
    /// # Errors
    /// A radius outside of its limits, a corner that is not between 0 and the radius.
    pub fn bull(radius_mm: f64, corner_mm: f64) -> Result<Self, CutterError> {
        let cutter = Self::new(CutterShape::Bull, radius_mm, corner_mm)?;
        if corner_mm > 0.0 && corner_mm < radius_mm {
            Ok(cutter)
        } else {
            Err(CutterError::Corner { corner_mm, radius_mm })
        }
    }

    fn new(shape: CutterShape, radius_mm: f64, corner_mm: f64) -> Result<Self, CutterError> {
        let (least, greatest) = Self::RADIUS_LIMITS_MM;
        if (least..=greatest).contains(&radius_mm) {
            Ok(Self { shape, radius_mm, corner_mm })
        } else {
            Err(CutterError::Radius { radius_mm })
        }
    }

    /// The cutter as a workshop calls it: `ball, 6 mm diameter`. Its [`Display`](fmt::Display) is the
    /// form that is read.
    pub fn in_words(&self) -> String {
        let diameter_mm = 2.0 * self.radius_mm;
        match self.shape {
            CutterShape::Ball => format!("ball, {diameter_mm} mm diameter"),
            CutterShape::Flat => format!("flat, {diameter_mm} mm diameter"),
            CutterShape::Bull => {
                format!("bull, {diameter_mm} mm diameter, corner radius {} mm", self.corner_mm)
            }
        }
    }

    /// What kind of cutter it is.
    pub fn shape(&self) -> CutterShape {
        self.shape
    }

    /// Its radius, mm.
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// Radius of its corner, mm: that of a ball is its radius, that of a flat end mill 0. No hollow
    /// of a smaller radius can be cut.
    pub fn corner_mm(&self) -> f64 {
        self.corner_mm
    }

    /// Radius of the plane disc at its end, mm.
    pub(super) fn disc_mm(&self) -> f64 {
        self.radius_mm - self.corner_mm
    }

    /// Height of the cutter's surface above its tip at a distance from its axis, mm; infinite
    /// beyond its radius.
    #[inline]
    pub fn profile_mm(&self, from_axis_mm: f64) -> f64 {
        if from_axis_mm > self.radius_mm {
            return f64::INFINITY;
        }
        let beyond = from_axis_mm - self.disc_mm();
        if beyond <= 0.0 {
            0.0
        } else {
            self.corner_mm - (self.corner_mm * self.corner_mm - beyond * beyond).max(0.0).sqrt()
        }
    }

    /// Slope of [`profile_mm`](Self::profile_mm); infinite at the rim.
    #[inline]
    pub(super) fn profile_slope(&self, from_axis_mm: f64) -> f64 {
        let beyond = from_axis_mm - self.disc_mm();
        if beyond <= 0.0 { 0.0 } else { beyond / (self.corner_mm * self.corner_mm - beyond * beyond).max(0.0).sqrt() }
    }

    /// How far from the axis the cutter touches a plane of this slope, mm.
    #[inline]
    pub(super) fn contact_mm(&self, slope: f64) -> f64 {
        self.disc_mm() + self.corner_mm * slope / (1.0 + slope * slope).sqrt()
    }

    /// The cutter with a skin of this thickness: where its tip may go (plus the skin) if a pass
    /// shall leave an allowance.
    pub(super) fn grown(&self, skin_mm: f64) -> Self {
        let corner_mm = self.corner_mm + skin_mm;
        Self { shape: self.shape, radius_mm: self.radius_mm + skin_mm, corner_mm }
    }
}

impl fmt::Display for Cutter {
    /// By diameter, as shops do, and with a letter that says so.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let diameter_mm = 2.0 * self.radius_mm;
        match self.shape {
            CutterShape::Ball => write!(f, "ball:d{diameter_mm}mm"),
            CutterShape::Flat => write!(f, "flat:d{diameter_mm}mm"),
            CutterShape::Bull => write!(f, "bull:d{diameter_mm}mm,r{}mm", self.corner_mm),
        }
    }
}

impl FromStr for Cutter {
    type Err = CutterError;

    /// Reads `ball:d6mm` (diameter), `ball:r3mm` (radius), `flat:d12mm`, `bull:d12mm,r1mm`, with mm,
    /// cm, m or in; a bare number is mm. Without a letter a size is a radius.
    fn from_str(text: &str) -> Result<Self, CutterError> {
        let fault = |why: String| CutterError::Text { text: text.to_owned(), why };
        let (kind, sizes) = text.split_once(':').ok_or_else(|| fault("it names no size".into()))?;
        let (size, corner) = sizes.split_once(',').map_or((sizes, None), |(size, corner)| (size, Some(corner)));
        let corner = corner.map(|corner| match corner.trim().strip_prefix(['d', 'D']) {
            Some(_) => Err("a corner is told by its radius, as in bull:d12mm,r1mm".to_owned()),
            None => radius_mm(corner),
        });
        let lengths: Vec<f64> = [radius_mm(size)].into_iter().chain(corner).collect::<Result<_, _>>().map_err(fault)?;
        match (kind.trim().to_ascii_lowercase().as_str(), lengths.as_slice()) {
            ("ball", [radius]) => Self::ball(*radius),
            ("flat", [radius]) => Self::flat(*radius),
            ("bull", [radius, corner]) => Self::bull(*radius, *corner),
            ("ball" | "flat", _) => Err(fault("it has one size".into())),
            ("bull", _) => Err(fault("it has two sizes".into())),
            (other, _) => Err(fault(format!("there is no kind '{other}'"))),
        }
    }
}

/// A radius, or half a diameter.
fn radius_mm(text: &str) -> Result<f64, String> {
    let text = text.trim();
    if let Some(diameter) = text.strip_prefix(['d', 'D']) {
        return Ok(0.5 * length_mm(diameter)?);
    }
    length_mm(text.strip_prefix(['r', 'R']).unwrap_or(text))
}

fn length_mm(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, scale) = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("m", 1000.0)]
        .into_iter()
        .find_map(|(unit, scale)| text.strip_suffix(unit).map(|number| (number, scale)))
        .unwrap_or((text, 1.0));
    let value: f64 = number.trim().parse().map_err(|_| format!("'{text}' is no length"))?;
    if value.is_finite() { Ok(value * scale) } else { Err(format!("'{text}' is no length")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cutters_are_read_as_they_are_written() {
        for (forms, words) in [
            (["ball:d6mm", "ball:r3mm", "ball:3mm", "Ball: D 0.6cm"], "ball, 6 mm diameter"),
            (["flat:d12mm", "flat:r6mm", "flat:6mm", "flat:d12"], "flat, 12 mm diameter"),
            (
                ["bull:d12mm,r1mm", "bull:d12mm,1mm", "bull:r6mm,1mm", "bull:6mm, R1mm"],
                "bull, 12 mm diameter, corner radius 1 mm",
            ),
        ] {
            for text in forms {
                let cutter: Cutter = text.parse().unwrap();
                assert_eq!((cutter.to_string().as_str(), cutter.in_words().as_str()), (forms[0], words), "{text}");
            }
        }
        for radius in [0.1, 0.3, 1.0 / 3.0, 3.175] {
            let cutter = Cutter::ball(radius).unwrap();
            assert_eq!(cutter.to_string().parse::<Cutter>().unwrap(), cutter);
        }
        assert_eq!("Ball: 0.5in".parse::<Cutter>().unwrap().radius_mm(), 12.7);
        assert_eq!("ball:3".parse::<Cutter>().unwrap(), Cutter::ball(3.0).unwrap());
        for text in [
            "",
            "ball",
            "ball:",
            "ball:x",
            "ball:3,1",
            "bull:6",
            "cone:3",
            "ball:-3mm",
            "ball:nan",
            "flat:0",
            "ball:d",
            "ball:dr3mm",
            "ball:d3mm,d1mm",
            "bull:d6mm,d1mm",
            "bull:1,2,3",
        ] {
            assert!(text.parse::<Cutter>().is_err(), "{text} was taken");
        }
        assert!(matches!("bull:3mm,3mm".parse::<Cutter>(), Err(CutterError::Corner { .. })));
        assert!("ball:1m".parse::<Cutter>().unwrap_err().to_string().contains("1000 mm"));
    }

    #[test]
    fn profiles_are_those_of_sphere_disc_and_torus() {
        let (ball, flat, bull) =
            (Cutter::ball(3.0).unwrap(), Cutter::flat(3.0).unwrap(), Cutter::bull(3.0, 1.0).unwrap());
        assert!((ball.profile_mm(1.8) - (3.0 - 2.4)).abs() < 1e-15 && ball.profile_mm(3.0) == 3.0);
        assert!(flat.profile_mm(3.0) == 0.0 && flat.profile_mm(3.0001) == f64::INFINITY);
        assert!(bull.profile_mm(2.0) == 0.0 && (bull.profile_mm(2.6) - 0.2).abs() < 1e-12);
        for cutter in [ball, bull] {
            for r in [0.3, 1.1, 2.3, 2.9] {
                let e = 1e-6;
                let difference = (cutter.profile_mm(r + e) - cutter.profile_mm(r - e)) / (2.0 * e);
                assert!((cutter.profile_slope(r) - difference).abs() < 1e-8 * (1.0 + difference), "{cutter} at {r}");
                // A plane is touched where the profile is as steep as the plane.
                let slope = cutter.profile_slope(r);
                assert!(slope == 0.0 || (cutter.contact_mm(slope) - r).abs() < 1e-12);
            }
        }
    }
}
