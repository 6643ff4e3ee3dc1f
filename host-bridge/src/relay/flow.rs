//! How much may be on its way: on a network that carries less than the board says, what waits in the
//! system's buffers grows old there, and newer things wait behind it.
//!
//! Pings travel in line with everything else: what was sent before a ping that has been answered is on
//! its way no more.

/// What an answer may take beyond two round trips, in µs: pings go every 25 ms, and a busy computer takes
/// its time.
const SLACK_US: u64 = 80_000;
/// Longest patience, in µs: more is no telepresence.
const LONGEST_US: u64 = 2_500_000;
/// Half of the time that round trips are looked back on, in µs; the shortest has waited least.
const HALF_WINDOW_US: u64 = 2_500_000;

/// How the network does.
#[derive(Clone, Debug, Default)]
pub struct Flow {
    /// When the newest ping was sent that has been answered, in µs.
    answered_us: Option<u64>,
    recent: Shortest,
    before: Shortest,
}

/// The shortest round trip of a time.
#[derive(Clone, Copy, Debug, Default)]
struct Shortest {
    since_us: u64,
    round_trip_us: Option<u64>,
}

impl Flow {
    /// Whether the network takes more: what is on its way has not been there for longer than two round
    /// trips, in which TCP makes up for one loss.
    pub fn takes_more(&self, now_us: u64) -> bool {
        self.answered_us
            .is_some_and(|answered_us| now_us.saturating_sub(answered_us) <= self.patience_us())
    }

    /// A ping of `sent_us` was answered after `round_trip_us`.
    pub fn on_answer(&mut self, sent_us: u64, round_trip_us: u64) {
        self.answered_us = self.answered_us.max(Some(sent_us));
        if sent_us.saturating_sub(self.recent.since_us) > HALF_WINDOW_US {
            self.before = self.recent;
            self.recent = Shortest {
                since_us: sent_us,
                round_trip_us: None,
            };
        }
        let shortest = &mut self.recent.round_trip_us;
        *shortest = Some(shortest.map_or(round_trip_us, |shortest| shortest.min(round_trip_us)));
    }

    /// The shortest round trip of the last five seconds with an answer, in µs.
    pub fn round_trip_us(&self) -> Option<u64> {
        [self.recent, self.before]
            .iter()
            .filter_map(|shortest| shortest.round_trip_us)
            .min()
    }

    fn patience_us(&self) -> u64 {
        let round_trip_us = self.round_trip_us().unwrap_or(LONGEST_US);
        round_trip_us
            .saturating_mul(2)
            .saturating_add(SLACK_US)
            .min(LONGEST_US)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn before_anybody_has_answered_nothing_is_sent() {
        assert!(!Flow::default().takes_more(0));
    }

    #[test]
    fn what_is_not_answered_within_two_round_trips_holds_up_the_rest() {
        let mut flow = Flow::default();
        flow.on_answer(0, 50_000);
        flow.on_answer(25_000, 20_000);
        let until_us = 25_000 + 2 * 20_000 + SLACK_US;
        assert!(flow.takes_more(until_us));
        assert!(!flow.takes_more(until_us + 1));
        flow.on_answer(50_000, 90_000);
        assert!(flow.takes_more(until_us + 1));
    }

    #[test]
    fn an_answer_that_comes_late_takes_nothing_back() {
        let mut flow = Flow::default();
        flow.on_answer(100_000, 10_000);
        flow.on_answer(50_000, 60_000);
        assert!(flow.takes_more(100_000 + 2 * 10_000 + SLACK_US));
    }

    #[test]
    fn a_round_trip_of_long_ago_is_forgotten() {
        let mut flow = Flow::default();
        flow.on_answer(0, 1_000);
        for second in 1..=5 {
            flow.on_answer(second * 1_000_000, 500_000);
        }
        assert_eq!(flow.round_trip_us(), Some(1_000));
        flow.on_answer(6_000_000, 500_000);
        assert_eq!(flow.round_trip_us(), Some(500_000));
    }

    #[test]
    fn a_network_that_takes_very_long_is_not_waited_for_longer_than_is_of_use() {
        let mut flow = Flow::default();
        flow.on_answer(0, 60_000_000);
        assert!(flow.takes_more(LONGEST_US));
        assert!(!flow.takes_more(LONGEST_US + 1));
    }
}
