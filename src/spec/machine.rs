//! What a person says of a machine: its tools, how far its axes go, the stock on its table.

use super::{Length, OriginName};
use clap::ValueEnum;
use glasswarp_verify::program::Tool;
use std::str::FromStr;

/// A tool of a program: `ball:d6mm`, or with its number, `2=flat:d6mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberedTool {
    /// Its number; `None` for every tool that is not named otherwise.
    pub number: Option<u32>,
    /// Its shape.
    pub tool: Tool,
}

impl FromStr for NumberedTool {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, form) = match text.split_once('=') {
            None => (None, text),
            Some((number, form)) => {
                let number = number.trim().trim_start_matches(['T', 't']).parse();
                (
                    Some(number.map_err(|_| format!("'{text}': the number of a tool comes first, as in 2=flat:d6mm"))?),
                    form,
                )
            }
        };
        Ok(Self { number, tool: form.parse::<Tool>().map_err(|error| error.to_string())? })
    }
}

/// Three lengths, mm: `300x200x80mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel(pub [f64; 3]);

/// The stock: `15mm`, its thickness, or `120x120x18mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StockSize {
    /// Along x and y, mm.
    pub across_mm: Option<[f64; 2]>,
    /// From the entry face up, mm.
    pub thickness_mm: f64,
}

/// Where the zero of a program is: `stock-top`, or a place in the frame of the bench, `10,-5,0mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ZeroPlace {
    /// By name.
    Named(OriginName),
    /// By coordinates, mm.
    At([f64; 3]),
}

/// Units of a program that names none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UnitsName {
    /// Millimetres
    Mm,
    /// Inches
    In,
}

/// Lengths between separators; a unit at the end holds for those without one.
fn lengths(text: &str, by: char) -> Result<Vec<f64>, String> {
    let parts: Vec<&str> = text.split(by).map(str::trim).collect();
    let unit = parts.last().map_or("", |last| last.trim_start_matches(|c: char| !c.is_alphabetic()));
    let one = |part: &&str| {
        let bare = !part.ends_with(|c: char| c.is_alphabetic());
        let text = if bare { format!("{part}{unit}") } else { (*part).to_owned() };
        text.parse::<Length>().map(|length| length.mm)
    };
    parts.iter().map(one).collect()
}

impl FromStr for Travel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match lengths(text, 'x')?.as_slice() {
            [x, y, z] if *x > 0.0 && *y > 0.0 && *z > 0.0 => Ok(Self([*x, *y, *z])),
            _ => Err(format!("'{text}' is no travel: write how far x, y and z go, as in 300x200x80mm")),
        }
    }
}

impl FromStr for StockSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match lengths(text, 'x')?.as_slice() {
            [thickness] if *thickness > 0.0 => Ok(Self { across_mm: None, thickness_mm: *thickness }),
            [x, y, z] if *x > 0.0 && *y > 0.0 && *z > 0.0 => Ok(Self { across_mm: Some([*x, *y]), thickness_mm: *z }),
            _ => Err(format!("'{text}' is no stock: write its thickness, as in 15mm, or 120x120x18mm")),
        }
    }
}

impl FromStr for ZeroPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(name) = text.parse::<OriginName>() {
            return Ok(Self::Named(name));
        }
        match lengths(text, ',').as_deref() {
            Ok([x, y, z]) => Ok(Self::At([*x, *y, *z])),
            _ => Err(format!(
                "'{text}' is no place: write exit, entry, stock-top or corner, or its coordinates in the frame of the bench, as in 0,0,5mm"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_person_says_of_a_machine_is_read() {
        assert_eq!("2=flat:d6mm".parse::<NumberedTool>().unwrap().number, Some(2));
        assert_eq!("T12=ball:3mm".parse::<NumberedTool>().unwrap().number, Some(12));
        assert_eq!("ball:3mm".parse::<NumberedTool>().unwrap().number, None);
        assert_eq!("300x200x80mm".parse::<Travel>().unwrap(), Travel([300.0, 200.0, 80.0]));
        assert_eq!("1mx20cmx80".parse::<Travel>().unwrap(), Travel([1000.0, 200.0, 80.0]));
        assert_eq!("1.5cm".parse::<StockSize>().unwrap(), StockSize { across_mm: None, thickness_mm: 15.0 });
        assert_eq!("stock-top".parse::<ZeroPlace>().unwrap(), ZeroPlace::Named(OriginName::StockTop));
        assert_eq!("0,-5,1.5mm".parse::<ZeroPlace>().unwrap(), ZeroPlace::At([0.0, -5.0, 1.5]));
        for text in ["x=ball:3mm", "2=", "2"] {
            assert!(text.parse::<NumberedTool>().is_err(), "{text}");
        }
        assert!("300x200".parse::<Travel>().is_err() && "0x1x1".parse::<Travel>().is_err());
        assert!("-3mm".parse::<StockSize>().is_err() && "1x2".parse::<StockSize>().is_err());
        assert!("top".parse::<ZeroPlace>().is_err() && "1,2".parse::<ZeroPlace>().is_err());
    }
}
