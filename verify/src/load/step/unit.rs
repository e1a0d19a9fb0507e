//! The unit of length in which a solid of a STEP file is given: that of its representation's
//! context.

use super::{
    fault::malformed,
    part21::{Entities, Value},
};
use crate::load::error::LoadError;

/// Millimetres in the unit of a solid.
///
/// A file may hold other units, of other parts or of curves in the plane of a surface: they do not
/// count. In a file that gives its solid no context there must be one unit only.
pub(super) fn of_solid(entities: &Entities<'_>, solid: u64) -> Result<f64, LoadError> {
    let representations = entities.that(|text| {
        let kind = text.split('(').next().unwrap_or_default().trim_end();
        kind.ends_with("SHAPE_REPRESENTATION")
    });
    let mut found: Vec<(u64, f64)> = Vec::new();
    for number in representations {
        let (_, values) = entities.get(number)?;
        let [_, items, Value::Reference(context)] = &values[..] else { continue };
        if items.references().is_some_and(|items| items.contains(&solid)) {
            found.push((number, of_context(entities, *context)?));
        }
    }
    if found.is_empty() {
        // Units that others are defined by are none of the file's own.
        let defining = entities.that(|text| text.starts_with("LENGTH_MEASURE_WITH_UNIT"));
        let defining: Vec<u64> =
            defining.iter().filter_map(|&of| entities.get(of).ok()?.1.get(1)?.reference()).collect();
        for unit in entities.that(is_length).into_iter().filter(|unit| !defining.contains(unit)) {
            found.push((unit, millimetres(entities, unit, 0)?));
        }
    }
    let Some(&(first, mm)) = found.first() else {
        return Err(malformed("it names no unit of length"));
    };
    match found.iter().find(|(_, other)| *other != mm) {
        Some(&(second, other)) => Err(malformed(format!(
            "it gives its solid two units of length: {mm} mm by #{first}, and {other} mm by #{second}"
        ))),
        None => Ok(mm),
    }
}

fn is_length(text: &str) -> bool {
    text.contains("LENGTH_UNIT")
}

/// The unit of length that a context assigns to all that is in it.
fn of_context(entities: &Entities<'_>, context: u64) -> Result<f64, LoadError> {
    let none = || malformed(format!("the context #{context} of its solid assigns no unit of length"));
    let values = entities.part(context, "GLOBAL_UNIT_ASSIGNED_CONTEXT")?.ok_or_else(none)?;
    let units = values.first().and_then(Value::references).ok_or_else(none)?;
    for unit in units {
        if is_length(entities.text(unit)?) {
            return millimetres(entities, unit, 0);
        }
    }
    Err(none())
}

/// Units that are defined by one another, at most.
const DEEPEST: usize = 4;

fn millimetres(entities: &Entities<'_>, unit: u64, depth: usize) -> Result<f64, LoadError> {
    let odd = || malformed(format!("the unit of length #{unit} is not understood: {}", shortened(entities, unit)));
    if let Some(values) = entities.part(unit, "SI_UNIT")? {
        let power = match &values[..] {
            [Value::Nothing, Value::Word("METRE")] => 3,
            [Value::Word(prefix), Value::Word("METRE")] => 3 + power_of_ten(prefix).ok_or_else(odd)?,
            _ => return Err(odd()),
        };
        return Ok(if power < 0 { 1.0 / 10f64.powi(-power) } else { 10f64.powi(power) });
    }
    let values = entities.part(unit, "CONVERSION_BASED_UNIT")?.ok_or_else(odd)?;
    let measure = values.get(1).and_then(Value::reference).filter(|_| depth < DEEPEST).ok_or_else(odd)?;
    let values = entities.part(measure, "LENGTH_MEASURE_WITH_UNIT")?;
    let values = values.map_or_else(|| entities.part(measure, "MEASURE_WITH_UNIT"), |values| Ok(Some(values)))?;
    // LENGTH_MEASURE(25.4) of another unit.
    let Some([factor, Value::Reference(other)]) = values.as_deref() else { return Err(odd()) };
    let factor = factor.number().or_else(|| factor.list()?.first()?.number());
    let factor = factor.filter(|factor| factor.is_finite() && *factor > 0.0).ok_or_else(odd)?;
    Ok(factor * millimetres(entities, *other, depth + 1)?)
}

fn power_of_ten(prefix: &str) -> Option<i32> {
    Some(match prefix {
        "KILO" => 3,
        "HECTO" => 2,
        "DECA" => 1,
        "DECI" => -1,
        "CENTI" => -2,
        "MILLI" => -3,
        "MICRO" => -6,
        "NANO" => -9,
        _ => return None,
    })
}

fn shortened(entities: &Entities<'_>, number: u64) -> String {
    entities.text(number).unwrap_or_default().chars().take(80).collect()
}
