//! What happens to a face after it was designed, as a person writes it.

use super::{length::Length, quantity::read_as_text};
use crate::{fabricate::Cutter, surface::Polish};
use std::{fmt, str::FromStr};

/// `polish=0.1mm`, or `polish=0.1mm,cutter=ball:d6mm,step-over=0.1mm,gain=6`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FinishPlan {
    /// The polish.
    pub polish: Option<Polish>,
    /// The finishing cutter.
    pub cutter: Option<Cutter>,
    /// From row to row.
    pub step_over_mm: Option<f64>,
}

read_as_text!(FinishPlan);

impl FromStr for FinishPlan {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts: Vec<String> = Vec::new();
        for part in text.split(',') {
            match parts.last_mut() {
                // The second radius of a bull-nose cutter.
                Some(last) if !part.contains('=') => *last += &format!(",{part}"),
                _ => parts.push(part.to_owned()),
            }
        }
        let mut plan = Self::default();
        let (mut sigma, mut gain) = (None, None);
        for part in &parts {
            let known = "a finish is written polish=0.1mm, with cutter=ball:d6mm (its diameter; ball:r3mm is its radius), step-over=0.1mm and gain=6 if wanted";
            let (name, value) = part.split_once('=').ok_or_else(|| format!("'{part}' names no value; {known}"))?;
            match name.trim() {
                "polish" => sigma = Some(value.parse::<Length>()?.mm),
                "cutter" => plan.cutter = Some(value.parse::<Cutter>().map_err(|error| error.to_string())?),
                "step-over" => plan.step_over_mm = Some(value.parse::<Length>()?.mm),
                "gain" => gain = Some(value.trim().parse::<f64>().map_err(|_| format!("'{value}' is no number"))?),
                other => return Err(format!("'{other}' is no part of a finish; {known}")),
            }
        }
        if let Some(sigma) = sigma {
            let mut polish = Polish::new(sigma).map_err(|error| error.to_string())?;
            if let Some(gain) = gain {
                polish = polish.with_gain(gain).map_err(|error| error.to_string())?;
            }
            plan.polish = Some(polish);
        } else if gain.is_some() {
            return Err("gain=... limits the inverse of a polish: name one, as in polish=0.1mm".into());
        }
        if plan.cutter.is_some_and(|cutter| cutter.corner_mm() == 0.0) {
            return Err("a flat cutter leaves steps on every slope: nothing can be designed for it; take a ball or a bull-nose cutter".into());
        }
        if plan.step_over_mm.is_some() && plan.cutter.is_none() {
            return Err("step-over=... needs a cutter, as in cutter=ball:d6mm".into());
        }
        Ok(plan)
    }
}

impl FinishPlan {
    /// The same for people; [`Display`](fmt::Display) is the form that is read.
    pub fn in_words(&self) -> String {
        let cutter = self.cutter.map(|cutter| cutter.in_words());
        let rows = self.step_over_mm.map(|mm| format!("rows {mm} mm apart"));
        let polish = self.polish.map(|p| format!("polish of {} mm, gain at most {}", p.sigma_mm(), p.most_gain()));
        [cutter, rows, polish].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for FinishPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let polish = self.polish.map(|polish| format!("polish={}mm,gain={}", polish.sigma_mm(), polish.most_gain()));
        let cutter = self.cutter.map(|cutter| format!("cutter={cutter}"));
        let step_over = self.step_over_mm.map(|mm| format!("step-over={mm}mm"));
        let parts: Vec<String> = [polish, cutter, step_over].into_iter().flatten().collect();
        f.write_str(&parts.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finishes_are_read_as_they_are_written() {
        for text in
            ["polish=0.1mm,gain=6", "polish=0.05mm,gain=3,cutter=bull:d12mm,r1mm,step-over=0.1mm", "cutter=ball:d6mm"]
        {
            assert_eq!(text.parse::<FinishPlan>().unwrap().to_string(), text);
        }
        let plan: FinishPlan = "polish=0.1mm,cutter=ball:3mm,step-over=0.1mm".parse().unwrap();
        assert_eq!(plan.in_words(), "ball, 6 mm diameter, rows 0.1 mm apart, polish of 0.1 mm, gain at most 6");
        // As older side files have it.
        assert_eq!("cutter=bull:6mm,1mm".parse::<FinishPlan>().unwrap().to_string(), "cutter=bull:d12mm,r1mm");
        for text in
            ["", "polish", "polish=x", "polish=-1mm", "gain=6", "cutter=flat:3mm", "step-over=1mm", "varnish=1mm"]
        {
            assert!(text.parse::<FinishPlan>().is_err(), "{text} was taken");
        }
    }
}
