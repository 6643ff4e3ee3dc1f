//! Which seeds are for tuning and which for reporting.

use std::ops::RangeInclusive;

/// Whoever changes an estimator may look at these as often as they like.
pub const TUNING: RangeInclusive<u64> = 1..=9_999;
/// Figures that are told to others come from these, and nothing is changed for what one of them does.
pub const REPORTING: RangeInclusive<u64> = 10_000..=19_999;

/// Seeds one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// The first.
    pub first: u64,
    /// How many.
    pub count: u64,
}

/// What seeds are set aside for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// [`TUNING`]
    Tuning,
    /// [`REPORTING`]
    Reporting,
    /// Neither.
    Free,
}

/// Seeds that cannot be used together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SeedsError {
    /// There are none.
    #[error("--surfaces 0: give 1 or more")]
    None,
    /// So many do not follow on the first.
    #[error(
        "{count} seeds from {first} on go beyond the largest, {}: give a smaller --seed or fewer --surfaces",
        u64::MAX
    )]
    Beyond {
        /// The first of them.
        first: u64,
        /// How many.
        count: u64,
    },
    /// They go over the end of a range that is set aside.
    #[error(
        "seeds {first} to {last} are of more than one kind: {}–{} are for tuning, {}–{} for reporting; \
         give a --seed and --surfaces that stay within one",
        TUNING.start(), TUNING.end(), REPORTING.start(), REPORTING.end()
    )]
    Mixed {
        /// The first of them.
        first: u64,
        /// The last of them.
        last: u64,
    },
}

impl Seeds {
    /// What they are for.
    ///
    /// # Errors
    /// If there are none, or if they are for different things.
    pub fn purpose(&self) -> Result<Purpose, SeedsError> {
        let Self { first, count } = *self;
        let more = count.checked_sub(1).ok_or(SeedsError::None)?;
        let last = first
            .checked_add(more)
            .ok_or(SeedsError::Beyond { first, count })?;
        if kind(first) != kind(last) || (kind(first) == Purpose::Free && spans_a_range(first, last))
        {
            return Err(SeedsError::Mixed { first, last });
        }
        Ok(kind(first))
    }

    /// Each of them.
    pub fn all(&self) -> Vec<u64> {
        (0..self.count).map(|more| self.first + more).collect()
    }
}

impl Purpose {
    /// For headings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tuning => "tuning",
            Self::Reporting => "reporting",
            Self::Free => "free",
        }
    }
}

fn kind(seed: u64) -> Purpose {
    if TUNING.contains(&seed) {
        Purpose::Tuning
    } else if REPORTING.contains(&seed) {
        Purpose::Reporting
    } else {
        Purpose::Free
    }
}

fn spans_a_range(first: u64, last: u64) -> bool {
    first < *TUNING.start() && last > *REPORTING.end()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn purpose(first: u64, count: u64) -> Result<Purpose, SeedsError> {
        Seeds { first, count }.purpose()
    }

    #[test]
    fn seeds_are_for_what_their_range_is_set_aside_for() {
        assert_eq!(purpose(1, 9_999), Ok(Purpose::Tuning));
        assert_eq!(purpose(10_000, 10_000), Ok(Purpose::Reporting));
        assert_eq!(purpose(20_000, 5), Ok(Purpose::Free));
        assert_eq!(purpose(0, 1), Ok(Purpose::Free));
        assert_eq!(purpose(7, 0), Err(SeedsError::None));
    }

    #[test]
    fn seeds_beyond_the_largest_are_refused() {
        for (first, count) in [(u64::MAX, 2), (u64::MAX - 1, 3), (7, u64::MAX)] {
            let beyond = SeedsError::Beyond { first, count };
            assert_eq!(purpose(first, count), Err(beyond));
            assert!(beyond.to_string().contains("18446744073709551615"));
        }
        for count in [1, 2] {
            let first = u64::MAX - (count - 1);
            assert_eq!(purpose(first, count), Ok(Purpose::Free));
            assert_eq!(Seeds { first, count }.all().len() as u64, count);
        }
    }

    #[test]
    fn seeds_of_two_kinds_are_refused() {
        for (first, count) in [(0, 2), (9_999, 2), (19_999, 2), (0, 30_000)] {
            let last = first + count - 1;
            let mixed = SeedsError::Mixed { first, last };
            assert_eq!(purpose(first, count), Err(mixed));
            assert!(mixed.to_string().contains("10000–19999 for reporting"));
        }
    }
}
