//! Numbers, texts and lists as ISO 10303-21 has them.

use std::fmt::Write as _;

/// Decimals of coordinates, mm: rounding moves the light by some nanometres.
const DECIMALS: usize = 9;

/// Distance below which two points are the same to a CAD kernel, mm.
pub(super) const UNCERTAINTY_MM: &str = "1.E-06";

/// References to a line.
const PER_LINE: usize = 12;

/// A number as ISO 10303-21 has it: with a point, and as few decimals as it needs.
pub(super) fn real(text: &mut String, value: f64) {
    decimals(text, value, DECIMALS);
}

/// The same as a text of its own.
pub(super) fn text_of(value: f64) -> String {
    let mut text = String::new();
    real(&mut text, value);
    text
}

pub(super) fn decimals(text: &mut String, value: f64, decimals: usize) {
    let start = text.len();
    // Writing to a string cannot fail.
    let _ = write!(text, "{value:.decimals$}");
    let kept = text.trim_end_matches('0').len();
    text.truncate(kept.max(start));
    if &text[start..] == "-0." {
        text.replace_range(start.., "0.");
    }
}

/// A text as ISO 10303-21 has it: 7 bits, everything else as UTF-16 in hexadecimal.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("'");
    for character in text.chars() {
        match character {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(character),
            c if c.is_control() => out.push(' '),
            other => {
                out.push_str("\\X2\\");
                other.encode_utf16(&mut [0; 2]).iter().for_each(|unit| {
                    let _ = write!(out, "{unit:04X}");
                });
                out.push_str("\\X0\\");
            }
        }
    }
    out.push('\'');
    out
}

/// References, broken into lines: a line of a million of them is more than some readers take.
pub(super) fn references(numbers: impl IntoIterator<Item = usize>) -> String {
    let mut text = String::new();
    for (k, number) in numbers.into_iter().enumerate() {
        if k > 0 {
            text.push_str(if k % PER_LINE == 0 { ",\n" } else { "," });
        }
        let _ = write!(text, "#{number}");
    }
    text
}

/// Multiplicities and values of distinct knots.
pub(super) fn knot_lists(knots: &[f64]) -> (String, String) {
    let (mut multiplicities, mut values) = (String::new(), String::new());
    for (k, &knot) in knots.iter().enumerate() {
        if k > 0 {
            let separator = if k % PER_LINE == 0 { ",\n" } else { "," };
            multiplicities.push_str(separator);
            values.push_str(separator);
        }
        multiplicities.push(if k == 0 || k + 1 == knots.len() { '4' } else { '1' });
        real(&mut values, knot);
    }
    (multiplicities, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_no_more_digits_than_they_need() {
        for (value, wanted) in
            [(0.0, "0."), (-1e-12, "0."), (12.0, "12."), (-0.5, "-0.5"), (1e-9, "0.000000001"), (100.25, "100.25")]
        {
            let mut text = "x".to_owned();
            real(&mut text, value);
            assert_eq!(text[1..], *wanted);
        }
    }

    #[test]
    fn texts_are_seven_bit() {
        assert_eq!(quoted("it's a \\ é\n"), "'it''s a \\\\ \\X2\\00E9\\X0\\ '");
    }
}
