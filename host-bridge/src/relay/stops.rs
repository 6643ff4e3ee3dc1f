//! Stops on their way: said here and not yet heard of at the other site, or for this site's board and not
//! yet obeyed by it.

use std::collections::VecDeque;

use protocol::{DisplayState, Message, RoleCounters, Stop, Trip};

use crate::relay::remote::SILENCE_US;

/// Stops that may wait for this site's board at once; each is the same to it.
const PENDING: usize = 8;
/// Stops that are remembered as done.
const DONE: usize = 64;
/// How long this site's board may take to answer, in µs: it does within milliseconds. The other site's may take
/// [`SILENCE_US`].
const PATIENCE_US: u64 = 500_000;

/// How a Stop stands with this site's board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It was not known before, and is to be said to the board.
    New,
    /// The board has not obeyed yet.
    Pending { is_told: bool },
    /// The board says that it has stopped, for this reason, if this program knows it.
    Done(Option<Trip>),
}

/// A Stop that the board has not obeyed yet.
#[derive(Clone, Copy, Debug)]
struct Pending {
    id: u64,
    stop: Stop,
    /// When the board was told first, in µs.
    told_us: Option<u64>,
}

/// An answer that may be missing.
#[derive(Clone, Copy, Debug, Default)]
struct Answer {
    missing_since_us: Option<u64>,
    is_told: bool,
}

impl Answer {
    /// True once, when it has been missing for `patience_us`.
    fn is_overdue(&mut self, is_missing: bool, patience_us: u64, now_us: u64) -> bool {
        if !is_missing {
            *self = Self::default();
            return false;
        }
        let since_us = *self.missing_since_us.get_or_insert(now_us);
        let is_overdue = now_us.saturating_sub(since_us) >= patience_us;
        is_overdue && !std::mem::replace(&mut self.is_told, true)
    }
}

/// Stops on their way.
#[derive(Clone, Debug, Default)]
pub struct Stops {
    unheard: Vec<(u64, Stop)>,
    pending: Vec<Pending>,
    done: VecDeque<(u64, Option<Trip>)>,
    /// The board has stopped since its last start, or is about to.
    is_halted: bool,
    /// This site's board's, and the other site's.
    answers: [Answer; 2],
}

impl Stops {
    /// Stop was said here, for both boards: its number, and whether it is a new one. As long as the other site has not
    /// heard one for the same reason it is that one, not the one numbered `id`, however often it is said.
    pub fn say(&mut self, id: u64, stop: Stop) -> (u64, bool) {
        // Whoever says it again wants to know again.
        self.answers = Default::default();
        let said = self.pass_on(id, stop);
        self.hear(said.0, stop);
        said
    }

    /// The other site is to hear of a Stop: see [`Stops::say`].
    pub fn pass_on(&mut self, id: u64, stop: Stop) -> (u64, bool) {
        let known = self.unheard.iter().find(|(_, unheard)| *unheard == stop);
        if let Some(&(known, _)) = known {
            return (known, false);
        }
        self.unheard.push((id, stop));
        (id, true)
    }

    /// Stop came, for the board here: how it stands.
    pub fn hear(&mut self, id: u64, stop: Stop) -> Standing {
        if let Some((_, trip)) = self.done.iter().find(|(done, _)| *done == id) {
            return Standing::Done(*trip);
        }
        if let Some(pending) = self.pending.iter().find(|pending| pending.id == id) {
            let is_told = pending.told_us.is_some();
            return Standing::Pending { is_told };
        }
        if self.pending.len() >= PENDING {
            // Those that wait stop the board as well; this one is said again and heard then.
            return Standing::Pending { is_told: false };
        }
        self.is_halted = true;
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

    /// The board said something at `at_us`. If it is that it has stopped: why, and the Stops that it was told
    /// before.
    pub fn obeyed(&mut self, at_us: u64, message: &Message) -> Option<(Option<Trip>, Vec<u64>)> {
        let Message::Stopped(stopped) = message else {
            return None;
        };
        let trip = stopped.trip();
        let is_obeyed = |pending: &Pending| pending.told_us.is_some_and(|told_us| told_us <= at_us);
        let ids: Vec<u64> = self
            .pending
            .extract_if(.., |pending| is_obeyed(pending))
            .map(|pending| pending.id)
            .collect();
        for &id in &ids {
            self.finish(id, trip);
        }
        Some((trip, ids))
    }

    /// The board has stopped: true if no Stop is known that it could have been by, so that the other site is
    /// to be told, by the Stop numbered `id`.
    pub fn spread(&mut self, id: u64, stop: Stop) -> bool {
        let is_news = !self.is_halted;
        if is_news {
            self.is_halted = true;
            self.unheard.push((id, stop));
        }
        is_news
    }

    /// The board has started anew. What it obeyed before counts no more: whoever has not heard of that, and goes on
    /// saying Stop, may mean the board that runs now.
    pub fn on_restart(&mut self) {
        self.is_halted = false;
        self.done.clear();
    }

    /// The board is to be told again of what it has not obeyed.
    pub fn tell_again(&mut self) {
        for pending in &mut self.pending {
            pending.told_us = None;
        }
    }

    /// The board said something. If it is that it goes, and no Stop is on its way to it, it has started anew.
    pub fn on_state(&mut self, message: &Message) {
        let goes = match message {
            Message::Safety(safety) => !matches!(safety.state, DisplayState::Stopped(_)),
            Message::Arm(arm) => arm.state.trip().is_none(),
            Message::Status(status) => match &status.role {
                RoleCounters::Display(counters) => {
                    !matches!(counters.state, DisplayState::Stopped(_))
                }
                RoleCounters::Sensor(counters) => counters.stopped.is_none(),
            },
            _ => false,
        };
        if goes && self.pending.is_empty() {
            self.on_restart();
        }
    }

    /// What the other site says of a Stop: true if it was said here and nothing was known of it yet.
    pub fn on_outcome(&mut self, id: u64) -> bool {
        let before = self.unheard.len();
        self.unheard.retain(|(unheard, _)| *unheard != id);
        self.unheard.len() < before
    }

    /// Which boards have not answered a Stop: this site's, and the other site's.
    pub fn unanswered(&self) -> [bool; 2] {
        [!self.pending.is_empty(), !self.unheard.is_empty()]
    }

    /// Which of them have not for so long by `now_us` that a person is to know of it, once.
    pub fn overdue(&mut self, now_us: u64) -> [bool; 2] {
        let [here, there] = self.unanswered();
        let [own, other] = &mut self.answers;
        [
            own.is_overdue(here, PATIENCE_US, now_us),
            other.is_overdue(there, SILENCE_US, now_us),
        ]
    }

    /// Those to be said to the other site again.
    pub fn unheard(&self) -> Vec<(u64, Stop)> {
        self.unheard.clone()
    }

    /// Those that this site's board has not been told yet.
    pub fn untold(&self) -> Vec<(u64, Stop)> {
        let is_untold = |pending: &&Pending| pending.told_us.is_none();
        let untold = self.pending.iter().filter(is_untold);
        untold.map(|pending| (pending.id, pending.stop)).collect()
    }

    fn finish(&mut self, id: u64, trip: Option<Trip>) {
        self.done.truncate(DONE - 1);
        self.done.push_front((id, trip));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{PortCounters, ResetCause, Safety, SensorCounters, Status, StopReason, Stopped};

    const STOP: Stop = Stop {
        reason: StopReason::Operator,
    };
    const TRIP: Option<Trip> = Some(Trip::Operator);

    fn stopped() -> Message {
        Message::Stopped(Stopped::by(Trip::Operator))
    }

    #[test]
    fn a_stop_is_done_when_the_board_says_so_after_it_was_told() {
        let mut stops = Stops::default();
        assert_eq!(stops.hear(1, STOP), Standing::New);
        assert_eq!(stops.hear(1, STOP), Standing::Pending { is_told: false });
        assert_eq!(stops.untold(), [(1, STOP)]);
        assert_eq!(
            stops.obeyed(4, &stopped()),
            Some((TRIP, vec![])),
            "not told yet"
        );
        assert!(stops.tell(1, 5));
        assert!(!stops.tell(1, 7), "told again");
        assert_eq!(stops.hear(1, STOP), Standing::Pending { is_told: true });
        assert!(stops.untold().is_empty());
        assert_eq!(
            stops.obeyed(4, &stopped()),
            Some((TRIP, vec![])),
            "said before"
        );
        let state = DisplayState::Stopped(Trip::Operator);
        let safety = Message::Safety(Safety {
            instant_us: 0,
            state,
        });
        assert_eq!(stops.obeyed(6, &safety), None, "it may be of long ago");
        assert_eq!(stops.obeyed(6, &stopped()), Some((TRIP, vec![1])));
        assert_eq!(stops.hear(1, STOP), Standing::Done(TRIP));
    }

    #[test]
    fn a_stop_that_was_said_here_is_repeated_until_the_other_site_tells_of_it() {
        let mut stops = Stops::default();
        stops.say(1, STOP);
        assert_eq!(stops.unheard(), [(1, STOP)]);
        stops.tell(1, 0);
        stops.obeyed(1, &stopped());
        assert_eq!(stops.hear(1, STOP), Standing::Done(TRIP));
        assert_eq!(stops.unheard(), [(1, STOP)]);
        assert!(!stops.on_outcome(2));
        assert!(stops.on_outcome(1));
        assert!(!stops.on_outcome(1), "told once");
        assert!(stops.unheard().is_empty());
    }

    #[test]
    fn a_board_that_was_stopped_by_others_stops_the_other_site_once_a_start() {
        let mut stops = Stops::default();
        assert!(stops.spread(1, STOP));
        assert!(!stops.spread(2, STOP));
        assert_eq!(stops.unheard(), [(1, STOP)]);
        stops.on_restart();
        assert!(stops.spread(3, STOP));
        // One that came from the other site does not go back.
        let mut stops = Stops::default();
        stops.hear(4, STOP);
        assert!(!stops.spread(5, STOP));
    }

    #[test]
    fn a_stop_that_is_said_again_is_the_same_as_long_as_the_other_site_has_not_heard_it() {
        let mut stops = Stops::default();
        assert_eq!(stops.say(1, STOP), (1, true));
        for id in 2..1_000 {
            assert_eq!(stops.say(id, STOP), (1, false));
        }
        assert_eq!(stops.unheard(), [(1, STOP)]);
        // For another reason it is another.
        let host = Stop {
            reason: StopReason::Host,
        };
        assert_eq!(stops.say(1_000, host), (1_000, true));
        assert_eq!(stops.unheard().len(), 2);
        stops.on_outcome(1);
        assert_eq!(stops.say(1_001, STOP), (1_001, true));
    }

    #[test]
    fn a_board_that_says_that_it_goes_has_started_anew() {
        let mut stops = Stops::default();
        stops.hear(1, STOP);
        let safety = |state| {
            Message::Safety(Safety {
                instant_us: 0,
                state,
            })
        };
        // Said before it heard the Stop.
        stops.on_state(&safety(DisplayState::Driving));
        assert!(!stops.spread(2, STOP));
        stops.tell(1, 5);
        stops.obeyed(6, &stopped());
        stops.on_state(&safety(DisplayState::Stopped(Trip::Operator)));
        assert!(!stops.spread(3, STOP));
        stops.on_state(&safety(DisplayState::Ready));
        assert!(stops.spread(4, STOP));
        // A status tells, too, of a board that does nothing but rest.
        let status = |stopped| {
            Message::Status(Status {
                uptime_us: 0,
                reset: ResetCause::Power,
                watchdog_resets: 0,
                peer: PortCounters::new(),
                console: PortCounters::new(),
                role: RoleCounters::Sensor(SensorCounters {
                    stopped,
                    ..SensorCounters::ZERO
                }),
                stack_free_bytes: 0,
            })
        };
        stops.on_state(&status(Some(Trip::Operator)));
        assert!(!stops.spread(5, STOP));
        stops.on_state(&status(None));
        assert!(stops.spread(6, STOP));
    }

    #[test]
    fn a_stop_that_the_other_site_goes_on_saying_stops_a_board_that_has_started_anew() {
        let mut stops = Stops::default();
        stops.hear(1, STOP);
        stops.tell(1, 5);
        stops.obeyed(6, &stopped());
        assert_eq!(stops.hear(1, STOP), Standing::Done(TRIP));
        stops.on_restart();
        assert_eq!(stops.hear(1, STOP), Standing::New);
    }

    #[test]
    fn what_another_board_may_have_answered_is_told_again() {
        let mut stops = Stops::default();
        stops.hear(1, STOP);
        stops.tell(1, 5);
        assert!(stops.untold().is_empty());
        stops.tell_again();
        assert_eq!(stops.untold(), [(1, STOP)]);
    }

    #[test]
    fn many_stops_take_no_memory() {
        let mut stops = Stops::default();
        for id in 0..1_000 {
            stops.hear(id, STOP);
            assert!(stops.pending.len() <= PENDING);
            if id % 3 == 0 {
                for (told, _) in stops.untold() {
                    stops.tell(told, id);
                }
                stops.obeyed(id, &stopped());
            }
        }
        assert_eq!(stops.done.len(), DONE);
    }
}
