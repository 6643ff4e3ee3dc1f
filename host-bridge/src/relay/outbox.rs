//! What is to be said to a board next. Never a queue: a newer message takes the place of one that waits.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use protocol::{Message, Stop};

/// Stops that may wait at once; each is the same to the board.
const STOPS: usize = 8;

/// A message that waits for the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Waiting {
    /// What is to be said.
    pub message: Message,
    /// When it is too old to be said, in µs of [`crate::host_clock::now_us`].
    pub until_us: u64,
    /// How old it was when it came, in µs.
    pub age_us: u64,
    /// When it came, in µs of [`crate::host_clock::now_us`].
    pub came_us: u64,
}

/// What is taken out.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "it is taken out and said at once"
)]
pub enum Due {
    /// A Stop, and its number.
    Stop(u64, Stop),
    /// The newest message.
    Message(Waiting),
    /// Nothing came in time.
    Nothing,
    /// The outbox was closed.
    Closed,
}

#[derive(Debug, Default)]
struct Contents {
    stops: Vec<(u64, Stop)>,
    newest: Option<Waiting>,
    is_closed: bool,
}

/// One message at most, and Stops, which overtake it.
#[derive(Debug, Default)]
pub struct Outbox {
    contents: Mutex<Contents>,
    changed: Condvar,
}

impl Outbox {
    /// Puts a message in. True if another had to make room.
    pub fn put(&self, waiting: Waiting) -> bool {
        let replaced = self.contents().newest.replace(waiting).is_some();
        self.changed.notify_one();
        replaced
    }

    /// Puts a Stop in. False if it is in already, or if there are too many.
    pub fn stop(&self, id: u64, stop: Stop) -> bool {
        let mut contents = self.contents();
        let is_known = contents.stops.iter().any(|(known, _)| *known == id);
        let is_new = !is_known && contents.stops.len() < STOPS;
        if is_new {
            contents.stops.push((id, stop));
        }
        drop(contents);
        self.changed.notify_one();
        is_new
    }

    /// No more is taken out.
    pub fn close(&self) {
        self.contents().is_closed = true;
        self.changed.notify_all();
    }

    /// Waits for at most `limit` for something to be said, and takes it out.
    pub fn take(&self, limit: Duration) -> Due {
        let is_empty = |contents: &mut Contents| {
            contents.stops.is_empty() && contents.newest.is_none() && !contents.is_closed
        };
        let (mut contents, _) = self
            .changed
            .wait_timeout_while(self.contents(), limit, is_empty)
            .unwrap_or_else(PoisonError::into_inner);
        if contents.is_closed {
            return Due::Closed;
        }
        if !contents.stops.is_empty() {
            let (id, stop) = contents.stops.remove(0);
            return Due::Stop(id, stop);
        }
        contents.newest.take().map_or(Due::Nothing, Due::Message)
    }

    fn contents(&self) -> MutexGuard<'_, Contents> {
        self.contents.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{Motion, StopReason};

    fn waiting(sequence: u32) -> Waiting {
        Waiting {
            message: Message::Motion(Motion {
                sequence,
                instant_us: 0,
                position_um: 0,
                velocity_um_s: 0,
            }),
            until_us: 0,
            age_us: 0,
            came_us: 0,
        }
    }

    const STOP: Stop = Stop {
        reason: StopReason::Operator,
    };

    #[test]
    fn the_newest_takes_the_place_of_what_waits() {
        let outbox = Outbox::default();
        assert!(!outbox.put(waiting(1)));
        assert!(outbox.put(waiting(2)));
        assert_eq!(outbox.take(Duration::ZERO), Due::Message(waiting(2)));
        assert_eq!(outbox.take(Duration::ZERO), Due::Nothing);
    }

    #[test]
    fn a_stop_overtakes_and_is_never_replaced() {
        let outbox = Outbox::default();
        outbox.put(waiting(1));
        outbox.stop(7, STOP);
        outbox.stop(7, STOP);
        outbox.put(waiting(2));
        assert_eq!(outbox.take(Duration::ZERO), Due::Stop(7, STOP));
        assert_eq!(outbox.take(Duration::ZERO), Due::Message(waiting(2)));
    }

    #[test]
    fn closing_wakes_who_waits() {
        let outbox = Outbox::default();
        std::thread::scope(|scope| {
            let waiter = scope.spawn(|| outbox.take(Duration::from_secs(60)));
            outbox.close();
            assert_eq!(waiter.join().expect("it ends"), Due::Closed);
        });
    }
}
