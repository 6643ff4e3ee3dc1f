//! How long the hand has rubbed without a rest.

use crate::pace::quarters;

/// A rest that counts.
const REST_QUARTERS: u32 = quarters(250);
/// The rest that is asked for after too long.
const LONG_REST_QUARTERS: u32 = quarters(1_000);

/// The time driven since the last rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Endurance {
    driven: u32,
    rested: u32,
    exhausted: bool,
}

impl Endurance {
    /// `quarters` of a millisecond have passed, in which the actuators were driven, or the hand rested;
    /// they may be driven for `most_s`.
    pub fn elapse(&mut self, quarters_passed: u32, driven: bool, rests: bool, most_s: u16) {
        self.rested = if rests {
            self.rested.saturating_add(quarters_passed)
        } else {
            0
        };
        let asked_for = if self.exhausted {
            LONG_REST_QUARTERS
        } else {
            REST_QUARTERS
        };
        if self.rested >= asked_for {
            self.driven = 0;
            self.exhausted = false;
        } else if driven {
            self.driven = self.driven.saturating_add(quarters_passed);
            self.exhausted |= self.driven >= quarters(1_000) * u32::from(most_s);
        }
    }

    /// Whether the hand has to rest for a second.
    pub const fn is_exhausted(self) -> bool {
        self.exhausted
    }
}

const _: () = assert!(u32::MAX / quarters(1_000) > u16::MAX as u32);

#[cfg(test)]
mod tests {
    use super::*;

    /// Quarters of a millisecond of rubbing for 0.7 s and resting for `rest_ms` in turn, until exhausted.
    fn lasts(rest_ms: u32) -> Option<u32> {
        let mut endurance = Endurance::default();
        (1..quarters(60_000)).find(|now| {
            let rests = now % quarters(1_000) >= quarters(1_000 - rest_ms);
            endurance.elapse(1, true, rests, 10);
            endurance.is_exhausted()
        })
    }

    #[test]
    fn only_a_rest_of_a_quarter_of_a_second_counts() {
        assert_eq!(lasts(0), Some(quarters(10_000)));
        assert_eq!(lasts(249), Some(quarters(10_000)));
        assert_eq!(lasts(251), None);
    }

    #[test]
    fn time_that_is_not_driven_does_not_count() {
        let mut endurance = Endurance::default();
        endurance.elapse(quarters(60_000), false, false, 10);
        assert!(!endurance.is_exhausted());
        endurance.elapse(quarters(10_000), true, false, 10);
        assert!(endurance.is_exhausted());
    }

    #[test]
    fn an_exhausted_hand_has_to_rest_for_a_second() {
        let mut endurance = Endurance::default();
        endurance.elapse(quarters(10_000), true, false, 10);
        // 0.9 s of rest are not one second, twice neither.
        for _ in 0..2 {
            endurance.elapse(quarters(900), false, true, 10);
            assert!(endurance.is_exhausted());
            endurance.elapse(1, false, false, 10);
        }
        endurance.elapse(quarters(999), false, true, 10);
        assert!(endurance.is_exhausted());
        endurance.elapse(quarters(1), false, true, 10);
        assert!(!endurance.is_exhausted());
    }
}
