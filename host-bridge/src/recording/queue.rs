//! What waits to be written, between the links' threads and the one that writes.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use protocol::Role;

/// How many may wait: everything that both boards say in 40 s.
pub const MOST: usize = 32_768;
/// How long the first one that finds no room waits for it: a disk that is only slower than what comes
/// slows it down, one that stands still does not hold up the links.
const PATIENCE: Duration = Duration::from_millis(100);

/// A queue of bounded length that counts what it could not take.
pub struct Queue<T> {
    waiting: Mutex<Waiting<T>>,
    /// Something has come, or nothing will.
    came: Condvar,
    /// Something has gone.
    went: Condvar,
}

struct Waiting<T> {
    items: VecDeque<T>,
    /// Not taken since the last [`Queue::take`], of the sensor and of the display.
    refused: [u64; 2],
    /// Nobody takes anything: there is no use in waiting for room.
    stuck: bool,
    closed: bool,
}

/// What a look at the queue gives.
pub enum Taken<T> {
    /// The next one.
    Item(T),
    /// So many of a board were not taken before the next one.
    Refused(Role, u64),
    /// Nothing has come by the time given.
    Nothing,
    /// Nothing will come any more.
    Closed,
}

impl<T> Default for Queue<T> {
    fn default() -> Self {
        Self {
            waiting: Mutex::new(Waiting {
                items: VecDeque::new(),
                refused: [0; 2],
                stuck: false,
                closed: false,
            }),
            came: Condvar::new(),
            went: Condvar::new(),
        }
    }
}

const fn index(role: Role) -> usize {
    matches!(role, Role::Display) as usize
}

impl<T> Queue<T> {
    /// Sound at every moment, whoever died holding it.
    fn locked(&self) -> MutexGuard<'_, Waiting<T>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts in what is of the board of `role`, or counts it as refused.
    pub fn put(&self, role: Role, item: T) {
        let mut waiting = self.locked();
        if waiting.items.len() >= MOST && !waiting.stuck && !waiting.closed {
            let full = |waiting: &mut Waiting<T>| waiting.items.len() >= MOST && !waiting.closed;
            waiting = self
                .went
                .wait_timeout_while(waiting, PATIENCE, full)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        if waiting.closed {
            return;
        }
        waiting.stuck = waiting.items.len() >= MOST;
        if waiting.stuck {
            waiting.refused[index(role)] += 1;
            return;
        }
        waiting.items.push_back(item);
        if waiting.items.len() == 1 {
            self.came.notify_one();
        }
    }

    /// Takes the next one, waiting for it until `until`.
    pub fn take(&self, until: Instant) -> Taken<T> {
        let mut waiting = self.locked();
        if waiting.items.is_empty() && !waiting.closed {
            let wait = until.saturating_duration_since(Instant::now());
            waiting = self
                .came
                .wait_timeout_while(waiting, wait, |waiting| {
                    waiting.items.is_empty() && !waiting.closed
                })
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        // What was refused came after all that waits now.
        let item = waiting.items.pop_front();
        if waiting.items.len() + 1 == MOST {
            self.went.notify_all();
        }
        match item {
            Some(item) => Taken::Item(item),
            None => {
                for role in [Role::Sensor, Role::Display] {
                    let refused = std::mem::take(&mut waiting.refused[index(role)]);
                    if refused > 0 {
                        return Taken::Refused(role, refused);
                    }
                }
                if waiting.closed {
                    Taken::Closed
                } else {
                    Taken::Nothing
                }
            }
        }
    }

    /// Nothing more is let in; what waits can still be taken.
    pub fn close(&self) {
        self.locked().closed = true;
        self.came.notify_all();
        self.went.notify_all();
    }

    /// Nothing more is let in, and what waits is thrown away.
    pub fn abandon(&self) {
        self.locked().items.clear();
        self.close();
    }
}
