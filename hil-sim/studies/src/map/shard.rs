//! A part of a map's cells, for a computer of several.

use std::fmt;
use std::str::FromStr;

use super::error::MapError;

/// Every `of`th cell, beginning with cell `number` − 1. Neighbouring cells cost about the same, so
/// shards do too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1 on.
    number: usize,
    of: usize,
}

impl Shard {
    pub(super) fn count(self) -> usize {
        self.of
    }

    /// Whether a cell is in it.
    pub fn holds(self, cell: usize) -> bool {
        cell % self.of == self.number - 1
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}-of-{}", self.number, self.of)
    }
}

/// From `3/8`.
impl FromStr for Shard {
    type Err = MapError;

    fn from_str(text: &str) -> Result<Self, MapError> {
        let parts = text.split_once('/').and_then(|(number, of)| {
            // Digits only: no sign, no blank.
            let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
            (digits(number) && digits(of)).then_some((number.parse().ok()?, of.parse().ok()?))
        });
        match parts {
            Some((number, of)) if (1..=of).contains(&number) && of <= 9_999 => {
                Ok(Self { number, of })
            }
            _ => Err(MapError::BadShard(text.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_in_exactly_one_shard() {
        for of in [1, 2, 7, 8] {
            for cell in 0..100 {
                let holding = (1..=of)
                    .filter(|number| {
                        format!("{number}/{of}")
                            .parse::<Shard>()
                            .is_ok_and(|shard| shard.holds(cell))
                    })
                    .count();
                assert_eq!(holding, 1, "cell {cell} of {of} shards");
            }
        }
        let third: Shard = "3/8".parse().unwrap();
        assert!(third.holds(2) && third.holds(10) && !third.holds(3));
        assert_eq!(third.to_string(), "3-of-8");
    }

    #[test]
    fn what_is_no_shard_is_refused_with_the_form() {
        for text in [
            "", "3", "0/8", "9/8", "3/0", "-1/8", "+1/8", "a/b", "1/2/3", " 1/2", "1/10000",
        ] {
            let refusal = text.parse::<Shard>().unwrap_err().to_string();
            assert!(refusal.contains("give i/n"), "{text}: {refusal}");
        }
    }
}
