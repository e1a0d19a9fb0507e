//! A part of a run of photons.

use std::str::FromStr;

/// One part of many: `3/100`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Counted from 0.
    pub index: u32,
    /// Parts in all.
    pub of: u32,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(k, n)| (k.trim().parse::<u32>(), n.trim().parse::<u32>()));
        match numbers {
            Some((Ok(k), Ok(of))) if (1..=of).contains(&k) => Ok(Self { index: k - 1, of }),
            _ => Err(format!("'{text}' is no part such as 3/100: the first of 100 is 1/100, the last 100/100")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_counted_from_one() {
        assert_eq!("3/100".parse(), Ok(Shard { index: 2, of: 100 }));
        assert_eq!("100/100".parse(), Ok(Shard { index: 99, of: 100 }));
        for text in ["0/100", "101/100", "3", "a/b", "-1/5", "1/0", ""] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
