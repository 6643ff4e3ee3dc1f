//! How old a message is when it arrives, by the clock of the bridge that sent it.

use std::time::Duration;

use protocol::{ClockOffset, Pong};

/// How much younger than new a message may seem before the clocks are taken to have been put out of step:
/// by a computer that slept.
const SLACK_US: i64 = 50_000;

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

/// The other site's clock, and how old what it sends may be.
#[derive(Clone, Debug)]
pub struct Ages {
    clock: ClockOffset,
    max_age_us: u64,
}

impl Ages {
    /// Clocks that have not been compared yet, and messages that may be `max_age` old.
    pub fn new(max_age: Duration) -> Self {
        Self {
            clock: ClockOffset::new(),
            max_age_us: u64::try_from(max_age.as_micros()).unwrap_or(u64::MAX),
        }
    }

    /// The other site has another clock from now on.
    pub fn forget(&mut self) {
        self.clock.clear();
    }

    /// Compares the clocks by an answer that came at `now_us`. False if it contradicts itself.
    pub fn on_pong(&mut self, pong: &Pong, now_us: u64) -> bool {
        self.clock.on_pong(pong, now_us)
    }

    /// The shortest round trip of late, in µs: twice the bound of the ages' error.
    pub fn round_trip_us(&self) -> Option<u64> {
        self.clock.round_trip_us()
    }

    /// The age at `now_us` of what was sent at `sent_us` of the other site's clock.
    pub fn judge(&mut self, sent_us: u64, now_us: u64) -> Age {
        let (Some(offset_us), Some(round_trip_us)) =
            (self.clock.offset_us(), self.clock.round_trip_us())
        else {
            return Age::Unknown;
        };
        // In 128 bits nothing that a peer may claim overflows.
        let age_us = i128::from(now_us) + i128::from(offset_us) - i128::from(sent_us);
        if age_us < -i128::from(round_trip_us) - i128::from(SLACK_US) {
            self.clock.clear();
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
        assert!(ages.on_pong(&pong, 1_000_000 + 2 * each_way_us));
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

    #[test]
    fn no_claim_overflows() {
        let mut ages = compared(0);
        assert_eq!(ages.judge(0, u64::MAX), Age::Stale(u64::MAX));
        assert_eq!(ages.judge(u64::MAX, 0), Age::Unknown);
    }
}
