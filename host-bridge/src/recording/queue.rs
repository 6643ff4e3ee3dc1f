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
    patience: Duration,
}

struct Waiting<T> {
    items: VecDeque<T>,
    /// Not taken since the last [`Queue::take`], of the sensor and of the display.
    refused: [u64; 2],
    /// Nobody takes anything: there is no use in waiting for room.
    stuck: bool,
    closed: bool,
}

const fn index(role: Role) -> usize {
    matches!(role, Role::Display) as usize
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
        Self::with_patience(PATIENCE)
    }
}

impl<T> Queue<T> {
    /// An empty one that has the first one that finds no room wait for so long.
    fn with_patience(patience: Duration) -> Self {
        Self {
            waiting: Mutex::new(Waiting {
                items: VecDeque::new(),
                refused: [0; 2],
                stuck: false,
                closed: false,
            }),
            came: Condvar::new(),
            went: Condvar::new(),
            patience,
        }
    }

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
                .wait_timeout_while(waiting, self.patience, full)
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread;

    use super::*;

    /// Far more than anything here takes.
    const LIMIT: Duration = Duration::from_secs(30);

    /// What waits now, in words.
    fn taken(queue: &Queue<usize>) -> String {
        match queue.take(Instant::now()) {
            Taken::Item(item) => item.to_string(),
            Taken::Refused(role, count) => format!("{count} of the {}", role.name()),
            Taken::Nothing => "nothing".to_owned(),
            Taken::Closed => "closed".to_owned(),
        }
    }

    fn full(patience: Duration) -> Queue<usize> {
        let queue = Queue::with_patience(patience);
        (0..MOST).for_each(|item| queue.put(Role::Sensor, item));
        queue
    }

    #[test]
    fn what_is_put_in_comes_out_in_order_whoever_put_it_in() {
        let queue = Queue::default();
        for (item, role) in [Role::Sensor, Role::Display, Role::Sensor]
            .into_iter()
            .enumerate()
        {
            queue.put(role, item);
        }
        let out = [(); 4].map(|()| taken(&queue));
        assert_eq!(out, ["0", "1", "2", "nothing"]);
    }

    #[test]
    fn two_boards_that_talk_at_once_each_keep_their_order() {
        const EACH: usize = MOST / 2;
        let queue = Arc::new(Queue::default());
        let speakers = [(Role::Sensor, 0), (Role::Display, 1)].map(|(role, parity)| {
            let queue = Arc::clone(&queue);
            thread::spawn(move || (0..EACH).for_each(|item| queue.put(role, 2 * item + parity)))
        });
        let mut next = [0, 1];
        while next != [2 * EACH, 2 * EACH + 1] {
            let Taken::Item(item) = queue.take(Instant::now() + LIMIT) else {
                panic!("nothing after {next:?}, or not all of it");
            };
            assert_eq!(item, next[item % 2]);
            next[item % 2] += 2;
        }
        for speaker in speakers {
            speaker.join().expect("it only talks");
        }
        assert_eq!(taken(&queue), "nothing");
    }

    #[test]
    fn a_disk_that_stands_still_holds_its_speaker_up_only_once_and_what_is_missing_is_told_at_its_place()
     {
        let queue = full(PATIENCE);
        let began = Instant::now();
        queue.put(Role::Display, MOST);
        assert!(began.elapsed() >= PATIENCE);
        // From now on nobody waits: a thousand times the patience would be far over the limit.
        for item in 0..1_000 {
            queue.put(Role::Display, item);
        }
        queue.put(Role::Sensor, 0);
        assert!(began.elapsed() < LIMIT, "{:?}", began.elapsed());
        // What waits was there before what was refused.
        assert!((0..MOST).all(|item| taken(&queue) == item.to_string()));
        let out = [(); 3].map(|()| taken(&queue));
        assert_eq!(out, ["1 of the sensor", "1001 of the display", "nothing"]);
        // The disk has caught up: all is taken again, in order.
        queue.put(Role::Display, 7);
        assert_eq!(taken(&queue), "7");
    }

    #[test]
    fn a_disk_that_is_slower_than_what_comes_slows_it_down_and_loses_nothing() {
        let queue = Arc::new(full(LIMIT));
        let writer = Arc::clone(&queue);
        let speaker = thread::spawn(move || {
            (MOST..MOST + 100).for_each(|item| queue.put(Role::Sensor, item));
        });
        // Room is made one by one, for a speaker that waits for it.
        for want in 0..MOST + 100 {
            match writer.take(Instant::now() + LIMIT) {
                Taken::Item(item) => assert_eq!(item, want),
                _ => panic!("{want} is missing"),
            }
        }
        speaker.join().expect("it only talks");
        assert_eq!(taken(&writer), "nothing");
    }

    #[test]
    fn a_writer_hears_at_once_of_what_comes_and_of_the_end() {
        let queue = Arc::new(Queue::default());
        let ear = Arc::clone(&queue);
        let writer = thread::spawn(move || {
            let end = Instant::now() + LIMIT;
            let item = matches!(ear.take(end), Taken::Item(5));
            item && matches!(ear.take(end), Taken::Closed) && Instant::now() < end
        });
        queue.put(Role::Sensor, 5);
        queue.close();
        assert!(writer.join().expect("it only listens"));
        queue.put(Role::Sensor, 6);
        assert_eq!(taken(&queue), "closed");
    }

    #[test]
    fn a_queue_that_is_closed_still_gives_what_waits_and_one_that_is_abandoned_does_not() {
        let queue = full(LIMIT);
        queue.close();
        // Nothing is waited for, and nothing counted.
        queue.put(Role::Sensor, MOST);
        assert!((0..MOST).all(|item| taken(&queue) == item.to_string()));
        assert_eq!(taken(&queue), "closed");
        let queue = full(LIMIT);
        queue.abandon();
        assert_eq!(taken(&queue), "closed");
    }
}
