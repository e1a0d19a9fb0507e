//! A quantity of the bench that is varied, and from where to where.

use super::length::Length;
use std::str::FromStr;

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Distance of the receiver, mm.
    Distance,
    /// Width of the block, mm.
    Size,
    /// Thickness of the stock, mm.
    Thickness,
    /// Refractive index.
    Index,
    /// Height nodes across.
    Nodes,
}

impl Quantity {
    const ALL: [(&'static str, Self); 6] = [
        ("distance", Self::Distance),
        ("size", Self::Size),
        ("thickness", Self::Thickness),
        ("index", Self::Index),
        ("ior", Self::Index),
        ("nodes", Self::Nodes),
    ];

    /// Its name with its unit, as in tables.
    pub fn column(self) -> &'static str {
        match self {
            Self::Distance => "distance_mm",
            Self::Size => "size_mm",
            Self::Thickness => "thickness_mm",
            Self::Index => "index",
            Self::Nodes => "nodes",
        }
    }
}

/// What is varied, from where to where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// What is varied.
    pub quantity: Quantity,
    /// The least.
    pub from: f64,
    /// The greatest.
    pub to: f64,
}

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=').and_then(|(name, range)| Some((name, range.split_once("..")?)));
        let (name, (from, to)) = parts.ok_or_else(|| format!("'{text}' is no range such as distance=60..1000"))?;
        let quantity = Quantity::ALL.iter().find(|(known, _)| *known == name.trim()).map(|(_, quantity)| *quantity);
        let quantity = quantity
            .ok_or_else(|| format!("'{name}' cannot be swept; distance, size, thickness, index and nodes can"))?;
        let end = |text: &str| match quantity {
            Quantity::Index | Quantity::Nodes => {
                text.trim().parse::<f64>().map_err(|_| format!("'{text}' is no number"))
            }
            _ => text.parse::<Length>().map(|length| length.mm),
        };
        let (from, to) = (end(from)?, end(to)?);
        if from.is_finite() && to.is_finite() && 0.0 < from && from < to {
            Ok(Self { quantity, from, to })
        } else {
            Err(format!("the range goes from {from} to {to}; it must rise from above 0"))
        }
    }
}

impl Range {
    /// Values in equal ratios, the ends included.
    pub fn values(self, steps: usize) -> Vec<f64> {
        let ratio = self.to / self.from;
        let mut values: Vec<f64> = (0..steps)
            .map(|k| match k {
                0 => self.from,
                k if k + 1 == steps => self.to,
                k => self.from * ratio.powf(k as f64 / (steps - 1) as f64),
            })
            // Round numbers, and whole ones of nodes.
            .map(|v| if self.quantity == Quantity::Nodes { v.round() } else { (v * 1e4).round() / 1e4 })
            .collect();
        values.dedup();
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_with_their_units() {
        let range: Range = "distance=6cm..1m".parse().unwrap();
        assert_eq!(range, Range { quantity: Quantity::Distance, from: 60.0, to: 1000.0 });
        assert_eq!(range.values(3), [60.0, 244.949, 1000.0]);
        assert_eq!("nodes=65..67".parse::<Range>().unwrap().values(8), [65.0, 66.0, 67.0]);
        assert_eq!("ior=1.4..1.7".parse::<Range>().unwrap().values(2), [1.4, 1.7]);
        for text in
            ["distance", "distance=60", "colour=1..2", "distance=9..3", "index=a..b", "size=0..5", "nodes=nan..9"]
        {
            assert!(text.parse::<Range>().is_err(), "{text}");
        }
    }
}
