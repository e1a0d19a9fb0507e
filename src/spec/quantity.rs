//! Values as people write them, in design files as on the command line.

use clap::ValueEnum;
use serde::{Deserializer, de};
use std::{fmt, marker::PhantomData, str::FromStr};

/// Reads a value from text, or from a number that `from_number` takes; `expected` says what it
/// should be.
pub(crate) fn number_or_text<'de, D: Deserializer<'de>, T: FromStr<Err = String>>(
    deserializer: D,
    expected: &'static str,
    from_number: fn(f64) -> Result<T, String>,
) -> Result<T, D::Error> {
    struct Visitor<T> {
        expected: &'static str,
        from_number: fn(f64) -> Result<T, String>,
        of: PhantomData<T>,
    }
    impl<T: FromStr<Err = String>> de::Visitor<'_> for Visitor<T> {
        type Value = T;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str(self.expected)
        }
        fn visit_f64<E: de::Error>(self, number: f64) -> Result<T, E> {
            (self.from_number)(number).map_err(E::custom)
        }
        fn visit_i64<E: de::Error>(self, number: i64) -> Result<T, E> {
            self.visit_f64(number as f64)
        }
        fn visit_str<E: de::Error>(self, text: &str) -> Result<T, E> {
            text.parse().map_err(E::custom)
        }
    }
    deserializer.deserialize_any(Visitor { expected, from_number, of: PhantomData })
}

/// Lets types be read in design files as the text that they are on the command line.
macro_rules! read_as_text {
    ($($kind:ty),+ $(,)?) => {
        $(
            impl<'de> serde::Deserialize<'de> for $kind {
                fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    <String as serde::Deserialize>::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
                }
            }
            impl serde::Serialize for $kind {
                fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    serializer.collect_str(self)
                }
            }
        )+
    };
}

/// Lets choices be read and written by their names, as on the command line.
macro_rules! names {
    ($kind:ty, $what:literal) => {
        impl std::str::FromStr for $kind {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, String> {
                $crate::spec::quantity::choice(text, $what)
            }
        }
        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(&$crate::spec::quantity::name_of(*self))
            }
        }
        $crate::spec::quantity::read_as_text!($kind);
    };
}

pub(crate) use {names, read_as_text};

/// The name of a choice, as on the command line.
pub fn name_of(choice: impl ValueEnum) -> String {
    choice.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

/// The choice of this name; `what` says of what it is one.
pub(crate) fn choice<T: ValueEnum>(text: &str, what: &str) -> Result<T, String> {
    T::from_str(text, false).map_err(|_| {
        let known: Vec<String> = T::value_variants().iter().map(|choice| name_of(choice.clone())).collect();
        format!("'{text}' is no {what}{}", hint(text, known.iter().map(String::as_str)))
    })
}

/// What may have been meant by a word that is none of those known.
pub(crate) fn hint<'a>(word: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(word, known.clone()) {
        Some(near) => format!("\ndid you mean '{near}'?"),
        None => format!("\nknown are {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// What is most like a word, if anything is.
pub(crate) fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |other: &str| strsim::damerau_levenshtein(&word.to_lowercase(), &other.to_lowercase());
    let (near, distance) = known.map(|other| (other, distance(other))).min_by_key(|(_, distance)| *distance)?;
    (distance <= 1 + word.chars().count() / 4).then_some(near)
}

/// A number and the unit behind it, which may be missing; `sign` is a unit that is no word.
pub(crate) fn number_and_unit(text: &str, sign: char) -> (&str, &str) {
    let text = text.trim();
    // An exponent's e is part of the number, no unit begins with it.
    let is_unit = |c: char| c.is_alphabetic() && !matches!(c, 'e' | 'E') || c == sign;
    let (number, unit) = text.split_at(text.find(is_unit).unwrap_or(text.len()));
    (number.trim(), unit.trim())
}

/// A number that a quantity can have. Half of the world writes a decimal comma.
pub(crate) fn finite(number: &str) -> Result<f64, String> {
    let with_point = match number.split_once(',') {
        Some((whole, part)) if !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit()) && !whole.contains('.') => {
            number.replacen(',', ".", 1)
        }
        _ => number.to_owned(),
    };
    match with_point.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("'{number}' is no number")),
    }
}
