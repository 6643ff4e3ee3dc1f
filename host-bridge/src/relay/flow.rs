//! How much may be on its way: on a network that carries less than the board says, what waits in its
//! buffers grows old there, and newer things wait behind it.
//!
//! Pings travel in line with everything else, and their answers tell when they came. What a loss holds up
//! comes in one go once TCP has made up for it, a round trip or two later: the stream must not stop
//! meanwhile, for TCP notices a loss by what comes after it. But where even the ping that has waited least
//! has waited longer, there is a queue that does not empty, and messages go at longer intervals until it
//! does. So does `CoDel` (RFC 8289) tell a burst from a standing queue. What does not become shorter
//! although next to nothing is sent is no queue of ours: the way has become longer.

use crate::clock::is_due;

/// Round trips in which TCP makes up for a loss, and for the loss of what makes up for it.
const REPAIR_ROUND_TRIPS: u64 = 2;
/// What an answer may take beyond that and its own round trip before it is late, in µs: pings go every
/// 25 ms, and a busy computer takes its time.
const SLACK_US: u64 = 80_000;
/// Between two messages at least while answers are late, in µs: little that grows old, and yet more than
/// enough for TCP to notice a loss by.
pub const LATE_SPACING_US: u64 = 10_000;
/// How late an answer may be before nothing more is sent, in µs.
const PATIENCE_US: u64 = 2_000_000;
/// How long ago the newest ping that was answered may have been sent, in µs: more is no telepresence.
const LONGEST_US: u64 = 4_500_000;
/// Half of the time that is looked back on for what an empty network takes, in µs.
const HALF_WINDOW_US: u64 = 30_000_000;
/// What waits for longer than this beyond a repair in µs, at best, is in a queue that does not empty.
const STANDING_US: u64 = 40_000;
/// How long a queue is watched before it is judged, beyond a repair, in µs.
const WATCH_US: u64 = 250_000;
/// So many watches with messages at the longest intervals, and no shorter wait, tell a longer way from a queue. In the first
/// of them what is on its way went at shorter intervals.
const THIN_WATCHES: u32 = 3;
/// Shortest and longest time that a standing queue puts between two messages, in µs.
const SPACING_US: (u64, u64) = (LATE_SPACING_US, 50_000);

/// An answer to a ping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// When the ping was sent, in µs.
    pub sent_us: u64,
    /// From then to its arrival, in µs by two clocks of which nothing else is known.
    pub there_us: i128,
    /// What there and back took, in µs.
    pub round_trip_us: u64,
}

/// How the network does.
#[derive(Clone, Debug, Default)]
pub struct Flow {
    /// When the newest ping was sent that has been answered, in µs.
    answered_us: Option<u64>,
    there_us: Least<i128>,
    round_trip_us: Least<u64>,
    /// Until when the queue is watched, by when pings are sent.
    watched_until_us: u64,
    /// The shortest wait of the pings of this watch, in µs.
    wait_us: Option<u64>,
    wait_before_us: u64,
    /// Between two messages, in µs.
    spacing_us: u64,
    /// Watches that it has been the longest for.
    thin_watches: u32,
    /// When the last message was let through, in µs.
    last_us: Option<u64>,
}

/// The least of what was seen of late.
#[derive(Clone, Copy, Debug, Default)]
struct Least<T> {
    since_us: u64,
    recent: Option<T>,
    before: Option<T>,
}

impl<T: Ord + Copy> Least<T> {
    fn add(&mut self, at_us: u64, seen: T) {
        if self.recent.is_none() {
            self.since_us = at_us;
        }
        if at_us.saturating_sub(self.since_us) > HALF_WINDOW_US {
            self.before = self.recent.take();
            self.since_us = at_us;
        }
        self.recent = Some(self.recent.map_or(seen, |least| least.min(seen)));
    }

    fn get(&self) -> Option<T> {
        self.recent.into_iter().chain(self.before).min()
    }
}

impl Flow {
    /// Whether a message may go now; it is taken to go then.
    pub fn admits(&mut self, now_us: u64) -> bool {
        let Some(late_us) = self.late_us(now_us) else {
            return false;
        };
        let spacing_us = match late_us {
            0 => self.spacing_us,
            _ => self.spacing_us.max(LATE_SPACING_US),
        };
        let is_due = is_due(self.last_us, spacing_us, now_us);
        let waited_us = self
            .answered_us
            .map_or(0, |at_us| now_us.saturating_sub(at_us));
        let admits = is_due && late_us <= PATIENCE_US && waited_us <= LONGEST_US;
        if admits {
            self.last_us = Some(now_us);
        }
        admits
    }

    /// Whether pings are answered in time.
    pub fn is_answered(&self, now_us: u64) -> bool {
        self.late_us(now_us) == Some(0)
    }

    /// A ping was answered.
    pub fn on_answer(&mut self, answer: Answer) {
        let sent_us = answer.sent_us;
        self.answered_us = self.answered_us.max(Some(sent_us));
        self.there_us.add(sent_us, answer.there_us);
        self.round_trip_us.add(sent_us, answer.round_trip_us);
        let least_us = self.there_us.get().unwrap_or(answer.there_us);
        let there_us = answer.there_us.saturating_sub(least_us);
        let least_us = self.round_trip_us().unwrap_or(0);
        let round_trip_us = answer.round_trip_us.saturating_sub(least_us);
        // What waits there does so on the round trip too; a clock that jumps does not.
        let wait_us = u64::try_from(there_us)
            .unwrap_or(u64::MAX)
            .min(round_trip_us);
        let wait_us = self.wait_us.map_or(wait_us, |least| least.min(wait_us));
        self.wait_us = Some(wait_us);
        if sent_us >= self.watched_until_us {
            self.judge(wait_us);
            let watch_us = self
                .round_trips_us(REPAIR_ROUND_TRIPS)
                .saturating_add(WATCH_US);
            self.watched_until_us = sent_us.saturating_add(watch_us);
        }
    }

    /// The shortest round trip of the last minute at most, in µs: what an empty network takes.
    pub fn round_trip_us(&self) -> Option<u64> {
        self.round_trip_us.get()
    }

    /// A watch has ended in which every ping waited for `wait_us` at least.
    fn judge(&mut self, wait_us: u64) {
        let (shortest_us, longest_us) = SPACING_US;
        let allowed_us = self
            .round_trips_us(REPAIR_ROUND_TRIPS)
            .saturating_add(STANDING_US);
        // A long queue empties as slowly as the network carries.
        let least_fall_us = (self.wait_before_us / 8).min(WATCH_US / 8);
        let is_falling = wait_us + least_fall_us < self.wait_before_us;
        if wait_us <= allowed_us {
            // Quickly where nothing waits at all.
            let kept = if wait_us <= allowed_us / 8 { 2 } else { 3 };
            let spacing_us = self.spacing_us / 4 * kept;
            let is_needed = spacing_us >= shortest_us / 8;
            self.spacing_us = if is_needed { spacing_us } else { 0 };
        } else if is_falling {
            // That takes its time.
        } else if self.spacing_us < longest_us {
            self.spacing_us = (self.spacing_us * 2).clamp(shortest_us, longest_us);
        } else if self.thin_watches >= THIN_WATCHES {
            self.there_us = Least::default();
            self.round_trip_us = Least::default();
        }
        self.thin_watches = if self.spacing_us == longest_us {
            self.thin_watches.saturating_add(1)
        } else {
            0
        };
        self.wait_before_us = wait_us;
        self.wait_us = None;
    }

    /// How much later than in time the next answer is, in µs; none before the first.
    fn late_us(&self, now_us: u64) -> Option<u64> {
        let in_time_us = self
            .round_trips_us(1 + REPAIR_ROUND_TRIPS)
            .saturating_add(SLACK_US);
        let waited_us = now_us.saturating_sub(self.answered_us?);
        Some(waited_us.saturating_sub(in_time_us))
    }

    fn round_trips_us(&self, count: u64) -> u64 {
        self.round_trip_us().unwrap_or(0).saturating_mul(count)
    }
}

#[cfg(test)]
mod tests;
