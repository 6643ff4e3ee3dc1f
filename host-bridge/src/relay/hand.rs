//! Who holds the bench, as a bridge knows it from the other site's answers, and how it hands the bench over.

use crate::clock::is_due;
use crate::relay::report::{Holding, Notice};

/// How long a bridge that hands the bench over waits for somebody to take it, in µs.
const PATIENCE_US: u64 = 5_000_000;
/// Between two times that it says so, in µs.
const AGAIN_US: u64 = 250_000;

/// What is due while the bench is handed over.
#[derive(Clone, Debug, PartialEq)]
pub enum Due {
    Nothing,
    /// The other site is to be told.
    Say,
    /// A person is to be told how it ended.
    Tell(Notice),
}

/// The hand of one bridge.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hand {
    holding: Holding,
    /// Until when the bench is being handed over, in µs.
    until_us: Option<u64>,
    /// When that was said last, in µs.
    said_us: Option<u64>,
}

impl Hand {
    pub const fn holding(self) -> Holding {
        self.holding
    }

    /// The other site says whether this bridge holds the bench: what a person should know, if that is news.
    pub fn on_word(&mut self, holds: bool) -> Option<Notice> {
        let holding = if holds {
            Holding::Held
        } else {
            Holding::Watched
        };
        if std::mem::replace(&mut self.holding, holding) == holding {
            return None;
        }
        Some(Notice::Hand(holding))
    }

    pub const fn on_silence(&mut self) {
        self.holding = Holding::Unknown;
    }

    /// The operator hands the bench over, at `now_us`.
    pub const fn hand_over(&mut self, now_us: u64) {
        self.until_us = Some(now_us.saturating_add(PATIENCE_US));
        self.said_us = None;
    }

    /// What is due of that at `now_us`.
    pub fn due(&mut self, now_us: u64) -> Due {
        let Some(until_us) = self.until_us else {
            return Due::Nothing;
        };
        let has_begun = self.said_us.is_some();
        let is_due = is_due(self.said_us, AGAIN_US, now_us);
        match self.holding {
            Holding::Held if now_us >= until_us => {
                self.until_us = None;
                Due::Tell(Notice::NobodyWaits)
            }
            Holding::Held if is_due => {
                self.said_us = Some(now_us);
                Due::Say
            }
            Holding::Held => Due::Nothing,
            // Another has it, which was told when it was heard.
            _ if has_begun => {
                self.until_us = None;
                Due::Nothing
            }
            _ => {
                self.until_us = None;
                Due::Tell(Notice::NotHeld)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bench_is_handed_over_until_another_has_it() {
        let mut hand = Hand::default();
        assert_eq!(hand.on_word(true), Some(Notice::Hand(Holding::Held)));
        assert_eq!(hand.on_word(true), None);
        assert_eq!(hand.due(0), Due::Nothing);
        hand.hand_over(0);
        assert_eq!(hand.due(0), Due::Say);
        assert_eq!(hand.due(AGAIN_US - 1), Due::Nothing);
        assert_eq!(hand.due(AGAIN_US), Due::Say);
        assert_eq!(hand.on_word(false), Some(Notice::Hand(Holding::Watched)));
        assert_eq!(hand.due(2 * AGAIN_US), Due::Nothing);
        // And that is all, also when it is handed back.
        hand.on_word(true);
        assert_eq!(hand.due(3 * AGAIN_US), Due::Nothing);
    }

    #[test]
    fn who_cannot_hand_the_bench_over_is_told_why() {
        let mut hand = Hand::default();
        hand.hand_over(0);
        assert_eq!(hand.due(0), Due::Tell(Notice::NotHeld), "nobody is there");
        hand.on_word(true);
        hand.hand_over(0);
        assert_eq!(hand.due(1), Due::Say);
        assert_eq!(hand.due(PATIENCE_US), Due::Tell(Notice::NobodyWaits));
        assert_eq!(hand.due(PATIENCE_US + AGAIN_US), Due::Nothing);
    }
}
