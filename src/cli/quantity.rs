//! Values as people write them, in design files as on the command line.

use serde::{Deserializer, de};
use std::{fmt, marker::PhantomData, str::FromStr};

/// Reads a value from text, or from a number that `from_number` takes; `expected` says what it should be.
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
                    String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
                }
            }
        )+
    };
}

pub(crate) use read_as_text;
