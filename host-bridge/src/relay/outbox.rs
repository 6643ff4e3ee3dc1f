//! What is to be said to a board next. Never a queue: a newer message takes the place of one that waits.

use std::sync::{Arc, Mutex, MutexGuard};

use protocol::Message;

use crate::clock::Notify;
use crate::lock::locked;

/// A message that waits for the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Waiting {
    pub message: Message,
    /// When it is too old to be said, in µs of the bridge's clock.
    pub until_us: u64,
    /// How old it was when it came, in µs.
    pub age_us: u64,
    /// When it came, in µs of the bridge's clock.
    pub came_us: u64,
}

/// What is taken out.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "it is taken out and said at once"
)]
pub enum Due {
    Message(Waiting),
    Nothing,
    Closed,
}

#[derive(Debug, Default)]
struct Contents {
    newest: Option<Waiting>,
    is_closed: bool,
}

/// One message at most.
pub struct Outbox {
    contents: Mutex<Contents>,
    changed: Arc<dyn Notify>,
}

impl Outbox {
    /// An empty one, for one thread that waits on `changed` and takes things out.
    pub fn new(changed: Arc<dyn Notify>) -> Self {
        Self {
            contents: Mutex::default(),
            changed,
        }
    }

    /// Puts a message in. True if another had to make room.
    pub fn put(&self, waiting: Waiting) -> bool {
        let replaced = self.contents().newest.replace(waiting).is_some();
        self.changed.notify();
        replaced
    }

    pub fn close(&self) {
        self.contents().is_closed = true;
        self.changed.notify();
    }

    /// Takes out what is to be said; waits for it until `until_us` at the longest.
    pub fn take(&self, until_us: u64) -> Due {
        match self.try_take() {
            Due::Nothing => {
                self.changed.wait_until(until_us);
                self.try_take()
            }
            due => due,
        }
    }

    fn try_take(&self) -> Due {
        let mut contents = self.contents();
        if contents.is_closed {
            return Due::Closed;
        }
        contents.newest.take().map_or(Due::Nothing, Due::Message)
    }

    fn contents(&self) -> MutexGuard<'_, Contents> {
        locked(&self.contents)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::{Clock, SystemClock};
    use protocol::Motion;

    fn outbox() -> Outbox {
        Outbox::new(SystemClock.notify())
    }

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

    #[test]
    fn the_newest_takes_the_place_of_what_waits() {
        let outbox = outbox();
        assert!(!outbox.put(waiting(1)));
        assert!(outbox.put(waiting(2)));
        assert_eq!(outbox.take(0), Due::Message(waiting(2)));
        assert_eq!(outbox.take(0), Due::Nothing);
    }

    #[test]
    fn closing_wakes_who_waits() {
        let outbox = outbox();
        std::thread::scope(|scope| {
            let waiter = scope.spawn(|| outbox.take(u64::MAX));
            outbox.close();
            assert_eq!(waiter.join().expect("it ends"), Due::Closed);
        });
    }
}
