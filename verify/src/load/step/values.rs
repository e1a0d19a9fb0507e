//! Parameters of entities, and how exact a file has to be.

use super::{
    bspline::{GREATEST_DEGREE, Knots},
    fault::malformed,
    part21::Value,
};
use crate::load::error::LoadError;

/// An edge may miss its vertices and its face by this, mm.
pub(super) const GAP_MM: f64 = 1e-5;
/// Most samples of a face.
pub(super) const MOST_SAMPLES: usize = 1 << 26;

pub(super) fn reference(values: &[Value<'_>], at: usize, number: u64) -> Result<u64, LoadError> {
    values.get(at).and_then(Value::reference).ok_or_else(|| odd(number))
}

pub(super) fn references(values: &[Value<'_>], at: usize, number: u64) -> Result<Vec<u64>, LoadError> {
    values.get(at).and_then(Value::references).ok_or_else(|| odd(number))
}

pub(super) fn truth(values: &[Value<'_>], at: usize, number: u64) -> Result<bool, LoadError> {
    values.get(at).and_then(Value::truth).ok_or_else(|| odd(number))
}

pub(super) fn odd(number: u64) -> LoadError {
    malformed(format!("#{number} has not the parameters of its kind"))
}

pub(super) fn degree(values: &[Value<'_>], at: usize, number: u64) -> Result<usize, LoadError> {
    let degree = values.get(at).and_then(Value::number).ok_or_else(|| odd(number))?;
    if degree.fract() == 0.0 && (1.0..=GREATEST_DEGREE as f64).contains(&degree) {
        Ok(degree as usize)
    } else {
        Err(malformed(format!("#{number} has the degree {degree}; 1 to {GREATEST_DEGREE} are understood")))
    }
}

/// Knots from the parameters with multiplicities and values.
pub(super) fn knots(
    degree: usize,
    values: &[Value<'_>],
    (multiplicities, places): (usize, usize),
    points: usize,
    number: u64,
) -> Result<Knots, LoadError> {
    let list = |at: usize| values.get(at).and_then(Value::numbers).ok_or_else(|| odd(number));
    Knots::new(degree, &list(multiplicities)?, &list(places)?, points)
        .ok_or_else(|| malformed(format!("the knots of #{number} do not fit its control points, or are not clamped")))
}
