//! How old a message is when it arrives, by the clock of the bridge that sent it.

use std::time::Duration;

use protocol::Pong;

use crate::clock::micros;

/// How far two clocks drift apart, in µs a second: two crystals of 100 ppm.
const DRIFT_US_PER_S: u64 = 200;
/// How much further apart than they can have drifted two comparisons may lie, in µs, before a clock is
/// taken to have jumped: that of a computer that slept.
const SLACK_US: u64 = 20_000;

/// What is known of an age.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Age {
    /// In µs, and not more than allowed.
    Fresh(u64),
    /// In µs, and more than allowed.
    Stale(u64),
    /// Nothing: the clocks have not been compared since they were last in doubt.
    Unknown,
}

/// One comparison of the two clocks.
#[derive(Clone, Copy, Debug)]
struct Comparison {
    /// The other clock minus one's own, in µs.
    offset_us: i128,
    /// The bound of its error when it was made, in µs: half a round trip.
    error_us: u64,
    made_us: u64,
}

impl Comparison {
    /// The bound of its error at `now_us`, in µs.
    fn error_at_us(&self, now_us: u64) -> u64 {
        let since_us = now_us.saturating_sub(self.made_us);
        self.error_us
            .saturating_add(since_us / 1_000_000 * DRIFT_US_PER_S)
    }
}

/// The other site's clock, and how old what it sends may be.
///
/// Of all comparisons the one counts whose error is bounded best by now: on a network that gets slower in
/// one direction only, what was found while it was quick stays right for minutes.
#[derive(Clone, Debug)]
pub struct Ages {
    best: Option<Comparison>,
    max_age_us: u64,
}

impl Ages {
    /// Clocks that have not been compared yet, and messages that may be `max_age` old.
    pub fn new(max_age: Duration) -> Self {
        Self {
            best: None,
            max_age_us: micros(max_age),
        }
    }

    /// The other site has another clock from now on.
    pub const fn forget(&mut self) {
        self.best = None;
    }

    /// Compares the clocks by an answer that came at `now_us`, as NTP does (RFC 5905, section 8): the
    /// round trip in µs. None, and nothing is changed, if its instants contradict each other.
    pub fn on_pong(&mut self, pong: &Pong, now_us: u64) -> Option<u64> {
        let elapsed_us = now_us.checked_sub(pong.sent_us)?;
        let held_us = pong.answered_us.checked_sub(pong.received_us)?;
        let round_trip_us = elapsed_us.checked_sub(held_us)?;
        // In 128 bits nothing that a peer may claim overflows.
        let there_us = i128::from(pong.received_us) - i128::from(pong.sent_us);
        let back_us = i128::from(pong.answered_us) - i128::from(now_us);
        let new = Comparison {
            offset_us: (there_us + back_us).div_euclid(2),
            error_us: round_trip_us.div_ceil(2),
            made_us: now_us,
        };
        let is_better = self.best.is_none_or(|best| {
            let error_us = best.error_at_us(now_us);
            let allowed_us = error_us
                .saturating_add(new.error_us)
                .saturating_add(SLACK_US);
            let has_jumped = (new.offset_us - best.offset_us).unsigned_abs() > allowed_us.into();
            has_jumped || new.error_us <= error_us
        });
        if is_better {
            self.best = Some(new);
        }
        Some(round_trip_us)
    }

    /// The age at `now_us` of what was sent at `sent_us` of the other site's clock.
    pub fn judge(&mut self, sent_us: u64, now_us: u64) -> Age {
        let Some(best) = self.best else {
            return Age::Unknown;
        };
        let age_us = i128::from(now_us) + best.offset_us - i128::from(sent_us);
        let least_us = -i128::from(best.error_at_us(now_us).saturating_add(SLACK_US));
        if age_us < least_us {
            // Younger than new: a clock has jumped.
            self.best = None;
            return Age::Unknown;
        }
        let age_us = u64::try_from(age_us.max(0)).unwrap_or(u64::MAX);
        if age_us > self.max_age_us {
            Age::Stale(age_us)
        } else {
            Age::Fresh(age_us)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The other site's clock minus one's own.
    const AHEAD_US: u64 = 7_000_000;

    /// Clocks compared over a network that takes `each_way_us`, at 1 s of one's own.
    fn compared(each_way_us: u64) -> Ages {
        let mut ages = Ages::new(Duration::from_millis(400));
        let there_us = 1_000_000 + AHEAD_US + each_way_us;
        let pong = Pong {
            sent_us: 1_000_000,
            received_us: there_us,
            answered_us: there_us,
        };
        let round_trip_us = ages.on_pong(&pong, 1_000_000 + 2 * each_way_us);
        assert_eq!(round_trip_us, Some(2 * each_way_us));
        ages
    }

    #[test]
    fn the_age_is_the_time_on_the_way_whatever_the_two_clocks_say() {
        let mut ages = compared(20_000);
        let sent_us = 2_000_000 + AHEAD_US;
        assert_eq!(ages.judge(sent_us, 2_020_000), Age::Fresh(20_000));
        assert_eq!(ages.judge(sent_us, 2_400_000), Age::Fresh(400_000));
        assert_eq!(ages.judge(sent_us, 2_400_001), Age::Stale(400_001));
    }

    #[test]
    fn before_clocks_were_compared_no_age_is_known() {
        let mut ages = Ages::new(Duration::from_secs(1));
        assert_eq!(ages.judge(0, 0), Age::Unknown);
    }

    #[test]
    fn what_is_a_little_younger_than_new_is_new() {
        let mut ages = compared(20_000);
        let sent_us = 2_000_000 + AHEAD_US;
        assert_eq!(ages.judge(sent_us, 1_990_000), Age::Fresh(0));
    }

    #[test]
    fn a_clock_that_has_jumped_is_not_believed_until_it_is_compared_again() {
        let mut ages = compared(20_000);
        let sent_us = 9_000_000 + AHEAD_US;
        assert_eq!(ages.judge(sent_us, 2_000_000), Age::Unknown);
        assert_eq!(ages.judge(2_000_000 + AHEAD_US, 2_000_000), Age::Unknown);
    }

    /// A ping of `sent_us` that takes `there_us` and whose answer takes `back_us`, by a clock that is
    /// `ahead_us` ahead.
    fn exchange(ages: &mut Ages, sent_us: u64, there_us: u64, back_us: u64, ahead_us: u64) {
        let received_us = sent_us + there_us + ahead_us;
        let pong = Pong {
            sent_us,
            received_us,
            answered_us: received_us,
        };
        assert!(ages.on_pong(&pong, sent_us + there_us + back_us).is_some());
    }

    #[test]
    fn a_network_that_becomes_slow_in_one_direction_does_not_put_the_ages_wrong() {
        let mut ages = compared(10_000);
        for second in 2..62 {
            exchange(&mut ages, second * 1_000_000, 10_000, 900_000, AHEAD_US);
        }
        let sent_us = 70_000_000 + AHEAD_US;
        assert_eq!(ages.judge(sent_us, 70_300_000), Age::Fresh(300_000));
    }

    #[test]
    fn a_clock_that_has_stood_still_is_compared_anew_at_once() {
        let mut ages = compared(10_000);
        let behind_us = AHEAD_US - 5_000_000;
        exchange(&mut ages, 20_000_000, 300_000, 300_000, behind_us);
        let sent_us = 30_000_000 + behind_us;
        assert_eq!(ages.judge(sent_us, 30_200_000), Age::Fresh(200_000));
    }

    #[test]
    fn clocks_that_drift_are_followed() {
        let mut ages = compared(1_000);
        for second in 2..1_000 {
            // 100 ppm.
            let ahead_us = AHEAD_US + second * 100;
            exchange(&mut ages, second * 1_000_000, 2_000, 2_000, ahead_us);
        }
        let sent_us = 1_000_000_000 + AHEAD_US + 100_000;
        let Age::Fresh(age_us) = ages.judge(sent_us, 1_000_200_000) else {
            panic!("it is fresh");
        };
        assert!(age_us.abs_diff(200_000) <= 4_000, "{age_us}");
    }

    #[test]
    fn an_answer_that_contradicts_itself_changes_nothing() {
        let mut ages = compared(1_000);
        let pong = |sent_us, received_us, answered_us| Pong {
            sent_us,
            received_us,
            answered_us,
        };
        for (pong, now_us) in [
            (pong(10, 0, 0), 9),
            (pong(0, 5, 4), 9),
            (pong(0, 0, 10), 9),
            (pong(0, 0, u64::MAX), 9),
        ] {
            assert_eq!(ages.on_pong(&pong, now_us), None);
        }
        let sent_us = 2_000_000 + AHEAD_US;
        assert_eq!(ages.judge(sent_us, 2_000_500), Age::Fresh(500));
    }

    #[test]
    fn no_claim_overflows() {
        let mut ages = compared(0);
        assert_eq!(ages.judge(0, u64::MAX), Age::Stale(u64::MAX));
        assert_eq!(ages.judge(u64::MAX, 0), Age::Unknown);
    }
}
