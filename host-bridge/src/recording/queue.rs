//! What waits to be written, between the links' threads and the one that writes.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam_channel::{
    Receiver, RecvTimeoutError, SendTimeoutError, Sender, TrySendError, bounded,
};
use protocol::Role;

use crate::lock::locked;

/// How many may wait: everything that both boards say in 40 s.
pub const MOST: usize = 32_768;
/// How long the first one that finds no room waits for it: a disk that is only slower than what comes
/// slows it down, one that stands still does not hold up the links.
pub const PATIENCE: Duration = Duration::from_millis(100);

/// A queue of bounded length that counts what it could not take, and how long the first one that finds no
/// room waits for it.
pub fn queue<T>(patience: Duration) -> (Input<T>, Output<T>) {
    let (sender, receiver) = bounded(MOST);
    let refused = Arc::new(Refused::default());
    let input = Input {
        sender: Mutex::new(Some(sender)),
        refused: Arc::clone(&refused),
        patience,
    };
    (input, Output { receiver, refused })
}

/// What was not taken.
#[derive(Default)]
struct Refused {
    /// Since it was told last, of the sensor and of the display.
    counts: [AtomicU64; 2],
    /// Nobody takes anything: there is no use in waiting for room.
    is_stuck: AtomicBool,
}

const ROLES: [Role; 2] = [Role::Sensor, Role::Display];

/// Where things are put in.
pub struct Input<T> {
    /// `None` once it is closed.
    sender: Mutex<Option<Sender<T>>>,
    refused: Arc<Refused>,
    patience: Duration,
}

/// Where they are taken out. Dropping it throws away what waits, and what will be put in.
pub struct Output<T> {
    receiver: Receiver<T>,
    refused: Arc<Refused>,
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

impl<T> Input<T> {
    /// Puts in what is of the board of `role`, or counts it as refused.
    pub fn put(&self, role: Role, item: T) {
        // The lock is not held while room is waited for.
        let Some(sender) = locked(&self.sender).clone() else {
            return;
        };
        let Refused { counts, is_stuck } = &*self.refused;
        let is_refused = match sender.try_send(item) {
            Err(TrySendError::Full(item)) if !is_stuck.load(Ordering::Relaxed) => {
                let sent = sender.send_timeout(item, self.patience);
                matches!(sent, Err(SendTimeoutError::Timeout(_)))
            }
            sent => matches!(sent, Err(TrySendError::Full(_))),
        };
        is_stuck.store(is_refused, Ordering::Relaxed);
        if is_refused {
            counts[usize::from(role == Role::Display)].fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Nothing more is let in; what waits can still be taken.
    pub fn close(&self) {
        locked(&self.sender).take();
    }
}

impl<T> Output<T> {
    /// Takes the next one, waiting for it until `until`.
    pub fn take(&self, until: Instant) -> Taken<T> {
        if let Ok(item) = self.receiver.try_recv() {
            return Taken::Item(item);
        }
        // What was refused came after all that waited.
        for (role, count) in ROLES.into_iter().zip(&self.refused.counts) {
            let refused = count.swap(0, Ordering::Relaxed);
            if refused > 0 {
                return Taken::Refused(role, refused);
            }
        }
        match self.receiver.recv_deadline(until) {
            Ok(item) => Taken::Item(item),
            Err(RecvTimeoutError::Timeout) => Taken::Nothing,
            Err(RecvTimeoutError::Disconnected) => Taken::Closed,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    /// Only what hangs takes so long.
    const LIMIT: Duration = Duration::from_secs(120);

    /// What waits now, in words.
    fn taken(output: &Output<usize>) -> String {
        match output.take(Instant::now()) {
            Taken::Item(item) => item.to_string(),
            Taken::Refused(role, count) => format!("{count} of the {}", role.name()),
            Taken::Nothing => "nothing".to_owned(),
            Taken::Closed => "closed".to_owned(),
        }
    }

    fn full(patience: Duration) -> (Input<usize>, Output<usize>) {
        let (input, output) = queue(patience);
        (0..MOST).for_each(|item| input.put(Role::Sensor, item));
        (input, output)
    }

    #[test]
    fn what_is_put_in_comes_out_in_order_whoever_put_it_in() {
        let (input, output) = queue(PATIENCE);
        let roles = [Role::Sensor, Role::Display, Role::Sensor];
        for (item, role) in roles.into_iter().enumerate() {
            input.put(role, item);
        }
        let out = [(); 4].map(|()| taken(&output));
        assert_eq!(out, ["0", "1", "2", "nothing"]);
    }

    #[test]
    fn a_disk_that_stands_still_holds_its_speaker_up_only_once_and_what_is_missing_is_told_at_its_place()
     {
        let (input, output) = full(PATIENCE);
        let began = Instant::now();
        input.put(Role::Display, MOST);
        assert!(began.elapsed() >= PATIENCE);
        // From now on nobody waits: two thousand times the patience would be over the limit.
        for item in 0..2_000 {
            input.put(Role::Display, item);
        }
        input.put(Role::Sensor, 0);
        assert!(began.elapsed() < LIMIT, "{:?}", began.elapsed());
        // What waits was there before what was refused.
        assert!((0..MOST).all(|item| taken(&output) == item.to_string()));
        let out = [(); 3].map(|()| taken(&output));
        assert_eq!(out, ["1 of the sensor", "2001 of the display", "nothing"]);
        // The disk has caught up: all is taken again, in order.
        input.put(Role::Display, 7);
        assert_eq!(taken(&output), "7");
    }

    #[test]
    fn a_disk_that_is_slower_than_what_comes_slows_it_down_and_loses_nothing() {
        let (input, output) = full(LIMIT);
        let speaker = thread::spawn(move || {
            (MOST..MOST + 100).for_each(|item| input.put(Role::Sensor, item));
        });
        // Room is made one by one, for a speaker that waits for it.
        for want in 0..MOST + 100 {
            match output.take(Instant::now() + LIMIT) {
                Taken::Item(item) => assert_eq!(item, want),
                _ => panic!("{want} is missing"),
            }
        }
        speaker.join().expect("it only talks");
        assert_eq!(taken(&output), "closed");
    }

    #[test]
    fn a_queue_that_is_closed_still_gives_what_waits_and_one_whose_end_is_gone_takes_nothing() {
        let (input, output) = full(LIMIT);
        input.close();
        // Nothing is waited for, and nothing counted.
        input.put(Role::Sensor, MOST);
        assert!((0..MOST).all(|item| taken(&output) == item.to_string()));
        assert_eq!(taken(&output), "closed");
        let (input, output) = full(LIMIT);
        drop(output);
        input.put(Role::Sensor, MOST);
    }
}
