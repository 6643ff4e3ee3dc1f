//! Stops on their way: said here and not yet heard of at the other site, or for this site's board and not
//! yet obeyed by it.

use std::collections::VecDeque;

use protocol::{DisplayState, Message, RoleCounters, Stop, Trip};

/// Stops that may wait for this site's board at once; each is the same to it.
const PENDING: usize = 8;
/// Stops that are remembered as done.
const DONE: usize = 64;

/// How a Stop stands with this site's board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It was not known before, and is to be said to the board.
    New,
    /// The board has not obeyed yet.
    Pending {
        /// Whether it has been told.
        is_told: bool,
    },
    /// It is done.
    Done(Outcome),
}

/// What has come of a Stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A sensor's board has it, which has nothing to stop and says nothing of it.
    Passed,
    /// A display's board says that it has stopped, for this reason.
    Stopped(Trip),
}

/// A Stop that the board has not obeyed yet.
#[derive(Clone, Copy, Debug)]
struct Pending {
    id: u64,
    stop: Stop,
    /// When the board was told first, in µs.
    told_us: Option<u64>,
}

/// Stops on their way.
#[derive(Clone, Debug, Default)]
pub struct Stops {
    unheard: Vec<(u64, Stop)>,
    pending: Vec<Pending>,
    done: VecDeque<(u64, Outcome)>,
}

impl Stops {
    /// Stop was said here: for both boards.
    pub fn say(&mut self, id: u64, stop: Stop) {
        self.unheard.push((id, stop));
        self.hear(id, stop);
    }

    /// Stop came, for the board here: how it stands.
    pub fn hear(&mut self, id: u64, stop: Stop) -> Standing {
        if let Some((_, outcome)) = self.done.iter().find(|(done, _)| *done == id) {
            return Standing::Done(*outcome);
        }
        if let Some(pending) = self.pending.iter().find(|pending| pending.id == id) {
            let is_told = pending.told_us.is_some();
            return Standing::Pending { is_told };
        }
        if self.pending.len() >= PENDING {
            // Those that wait stop the board as well; this one is said again and heard then.
            return Standing::Pending { is_told: false };
        }
        let told_us = None;
        self.pending.push(Pending { id, stop, told_us });
        Standing::New
    }

    /// The board is being told at `now_us`. True if it is for the first time.
    pub fn tell(&mut self, id: u64, now_us: u64) -> bool {
        let pending = self.pending.iter_mut().find(|pending| pending.id == id);
        pending.is_some_and(|pending| {
            let is_first = pending.told_us.is_none();
            pending.told_us.get_or_insert(now_us);
            is_first
        })
    }

    /// The board has it, and is of a kind that says nothing of it.
    pub fn pass(&mut self, id: u64) {
        self.pending.retain(|pending| pending.id != id);
        self.finish(id, Outcome::Passed);
    }

    /// A display's board said something at `at_us`: the reason for which it has stopped, and the Stops
    /// that it was told before.
    pub fn obeyed(&mut self, at_us: u64, message: &Message) -> Option<(Trip, Vec<u64>)> {
        let trip = stopped(message)?;
        let is_obeyed = |pending: &Pending| pending.told_us.is_some_and(|told_us| told_us <= at_us);
        let ids: Vec<u64> = self
            .pending
            .extract_if(.., |pending| is_obeyed(pending))
            .map(|pending| pending.id)
            .collect();
        for &id in &ids {
            self.finish(id, Outcome::Stopped(trip));
        }
        (!ids.is_empty()).then_some((trip, ids))
    }

    /// What the other site says of a Stop: true if it was said here and nothing was known of it yet.
    pub fn on_outcome(&mut self, id: u64) -> bool {
        let before = self.unheard.len();
        self.unheard.retain(|(unheard, _)| *unheard != id);
        self.unheard.len() < before
    }

    /// Those to be said to the other site again.
    pub fn unheard(&self) -> Vec<(u64, Stop)> {
        self.unheard.clone()
    }

    /// Those to be said to this site's board again: it was told, and a line may garble what is said.
    pub fn unobeyed(&self) -> Vec<(u64, Stop)> {
        let is_told = |pending: &&Pending| pending.told_us.is_some();
        let told = self.pending.iter().filter(is_told);
        told.map(|pending| (pending.id, pending.stop)).collect()
    }

    fn finish(&mut self, id: u64, outcome: Outcome) {
        self.done.truncate(DONE - 1);
        self.done.push_front((id, outcome));
    }
}

/// The reason for which a display says that it has stopped, if it says so.
const fn stopped(message: &Message) -> Option<Trip> {
    let state = match message {
        Message::Safety(safety) => safety.state,
        Message::Status(status) => match status.role {
            RoleCounters::Display(counters) => counters.state,
            RoleCounters::Sensor(_) => return None,
        },
        _ => return None,
    };
    match state {
        DisplayState::Stopped(trip) => Some(trip),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{Safety, StopReason};

    const STOP: Stop = Stop {
        reason: StopReason::Operator,
    };

    fn says(state: DisplayState) -> Message {
        Message::Safety(Safety {
            instant_us: 0,
            state,
        })
    }

    #[test]
    fn a_stop_is_done_when_the_board_says_so_after_it_was_told() {
        let mut stops = Stops::default();
        assert_eq!(stops.hear(1, STOP), Standing::New);
        assert_eq!(stops.hear(1, STOP), Standing::Pending { is_told: false });
        let stopped = says(DisplayState::Stopped(Trip::Operator));
        assert_eq!(stops.obeyed(4, &stopped), None, "not told yet");
        assert!(stops.tell(1, 5));
        assert!(!stops.tell(1, 7), "told again");
        assert_eq!(stops.hear(1, STOP), Standing::Pending { is_told: true });
        assert_eq!(stops.unobeyed(), [(1, STOP)]);
        assert_eq!(stops.obeyed(4, &stopped), None, "said before");
        assert_eq!(stops.obeyed(6, &says(DisplayState::Driving)), None);
        let trip = Trip::Operator;
        assert_eq!(stops.obeyed(6, &stopped), Some((trip, vec![1])));
        assert_eq!(stops.hear(1, STOP), Standing::Done(Outcome::Stopped(trip)));
        assert!(stops.unobeyed().is_empty());
    }

    #[test]
    fn a_stop_that_was_said_here_is_repeated_until_the_other_site_tells_of_it() {
        let mut stops = Stops::default();
        stops.say(1, STOP);
        assert_eq!(stops.unheard(), [(1, STOP)]);
        stops.tell(1, 0);
        stops.pass(1);
        assert_eq!(stops.hear(1, STOP), Standing::Done(Outcome::Passed));
        assert_eq!(stops.unheard(), [(1, STOP)]);
        assert!(!stops.on_outcome(2));
        assert!(stops.on_outcome(1));
        assert!(!stops.on_outcome(1), "told once");
        assert!(stops.unheard().is_empty());
    }

    #[test]
    fn many_stops_take_no_memory() {
        let mut stops = Stops::default();
        for id in 0..1_000 {
            stops.hear(id, STOP);
        }
        assert_eq!(stops.pending.len(), PENDING);
        for id in 0..1_000 {
            stops.pass(id);
        }
        assert_eq!(stops.done.len(), DONE);
    }
}
