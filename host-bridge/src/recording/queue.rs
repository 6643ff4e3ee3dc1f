//! What waits to be written, between the links' threads and the one that writes.

use std::sync::atomic::{AtomicBool, Ordering};
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
    let refused = Arc::<Mutex<Refused>>::default();
    let input = Input {
        sender: Mutex::new(Some(sender)),
        refused: Arc::clone(&refused),
        is_stuck: AtomicBool::new(false),
        patience,
    };
    let output = Output {
        receiver,
        refused,
        told: Vec::new(),
        next: None,
    };
    (input, output)
}

/// What was not taken since it was told last.
#[derive(Default)]
struct Refused(Vec<Loss>);

/// Some of a board that were not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loss {
    pub role: Role,
    pub count: u64,
    /// When the first of them was put in, in µs of this host's clock.
    pub at_us: u64,
}

impl Refused {
    fn add(&mut self, loss: Loss) {
        match self.0.iter_mut().find(|known| known.role == loss.role) {
            Some(known) => {
                known.count += loss.count;
                known.at_us = known.at_us.min(loss.at_us);
            }
            None => self.0.push(loss),
        }
    }
}

/// Something, and what was not taken right before it.
struct Waiting<T> {
    losses: Vec<Loss>,
    item: T,
}

pub struct Input<T> {
    /// `None` once it is closed.
    sender: Mutex<Option<Sender<Waiting<T>>>>,
    refused: Arc<Mutex<Refused>>,
    /// Nobody takes anything: there is no use in waiting for room.
    is_stuck: AtomicBool,
    patience: Duration,
}

/// Where they are taken out. Dropping it throws away what waits, and what will be put in.
pub struct Output<T> {
    receiver: Receiver<Waiting<T>>,
    refused: Arc<Mutex<Refused>>,
    /// To be told before anything else.
    told: Vec<Loss>,
    /// Comes after what is to be told.
    next: Option<T>,
}

/// What a look at the queue gives.
pub enum Taken<T> {
    Item(T),
    /// Some were not taken, between the one before and the next one.
    Refused(Loss),
    /// Nothing has come by the time given.
    Nothing,
    Closed,
}

impl<T> Input<T> {
    /// Puts in what is of the board of `role`, of `at_us` of this host's clock, or counts it as refused.
    pub fn put(&self, role: Role, at_us: u64, item: T) {
        // The lock is not held while room is waited for.
        let Some(sender) = locked(&self.sender).clone() else {
            return;
        };
        // Whatever gets in next tells of what did not.
        let losses = std::mem::take(&mut locked(&self.refused).0);
        let waiting = Waiting { losses, item };
        let refused = match sender.try_send(waiting) {
            Err(TrySendError::Full(waiting)) if !self.is_stuck.load(Ordering::Relaxed) => {
                match sender.send_timeout(waiting, self.patience) {
                    Err(SendTimeoutError::Timeout(waiting)) => Some(waiting),
                    _ => None,
                }
            }
            Err(TrySendError::Full(waiting)) => Some(waiting),
            _ => None,
        };
        self.is_stuck.store(refused.is_some(), Ordering::Relaxed);
        if let Some(waiting) = refused {
            let mut refused = locked(&self.refused);
            waiting
                .losses
                .into_iter()
                .for_each(|loss| refused.add(loss));
            let count = 1;
            refused.add(Loss { role, count, at_us });
        }
    }

    /// Nothing more is let in; what waits can still be taken.
    pub fn close(&self) {
        locked(&self.sender).take();
    }
}

impl<T> Output<T> {
    /// Takes the next one, waiting for it until `until`.
    pub fn take(&mut self, until: Instant) -> Taken<T> {
        if let Some(ready) = self.ready() {
            return ready;
        }
        let waiting = match self.receiver.try_recv() {
            Ok(waiting) => Some(waiting),
            // Nothing has got in since they were refused.
            Err(_) => {
                self.told = std::mem::take(&mut locked(&self.refused).0);
                if let Some(ready) = self.ready() {
                    return ready;
                }
                match self.receiver.recv_deadline(until) {
                    Ok(waiting) => Some(waiting),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => return Taken::Closed,
                }
            }
        };
        let Some(waiting) = waiting else {
            return Taken::Nothing;
        };
        self.told = waiting.losses;
        self.next = Some(waiting.item);
        self.ready().unwrap_or(Taken::Nothing)
    }

    fn ready(&mut self) -> Option<Taken<T>> {
        if let Some(loss) = self.told.pop() {
            return Some(Taken::Refused(loss));
        }
        self.next.take().map(Taken::Item)
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    /// Only what hangs takes so long.
    const LIMIT: Duration = Duration::from_secs(120);

    /// What waits now, in words.
    fn taken(output: &mut Output<usize>) -> String {
        match output.take(Instant::now()) {
            Taken::Item(item) => item.to_string(),
            Taken::Refused(loss) => format!("{} of the {}", loss.count, loss.role.name()),
            Taken::Nothing => "nothing".to_owned(),
            Taken::Closed => "closed".to_owned(),
        }
    }

    fn full(patience: Duration) -> (Input<usize>, Output<usize>) {
        let (input, output) = queue(patience);
        (0..MOST).for_each(|item| input.put(Role::Sensor, 0, item));
        (input, output)
    }

    #[test]
    fn what_is_put_in_comes_out_in_order_whoever_put_it_in() {
        let (input, mut output) = queue(PATIENCE);
        let roles = [Role::Sensor, Role::Display, Role::Sensor];
        for (item, role) in roles.into_iter().enumerate() {
            input.put(role, 0, item);
        }
        let out = [(); 4].map(|()| taken(&mut output));
        assert_eq!(out, ["0", "1", "2", "nothing"]);
    }

    #[test]
    fn a_disk_that_stands_still_holds_its_speaker_up_only_once_and_what_is_missing_is_told_at_its_place()
     {
        let (input, mut output) = full(PATIENCE);
        let began = Instant::now();
        input.put(Role::Display, 0, MOST);
        assert!(began.elapsed() >= PATIENCE);
        // From now on nobody waits: two thousand times the patience would be over the limit.
        for item in 0..2_000 {
            input.put(Role::Display, 0, item);
        }
        input.put(Role::Sensor, 0, 0);
        assert!(began.elapsed() < LIMIT, "{:?}", began.elapsed());
        // What waits was there before what was refused.
        assert!((0..MOST).all(|item| taken(&mut output) == item.to_string()));
        let out = [(); 3].map(|()| taken(&mut output));
        assert_eq!(out, ["1 of the sensor", "2001 of the display", "nothing"]);
        // The disk has caught up: all is taken again, in order.
        input.put(Role::Display, 0, 7);
        assert_eq!(taken(&mut output), "7");
    }

    #[test]
    fn what_is_missing_is_told_before_what_came_later() {
        let (input, mut output) = full(Duration::ZERO);
        for at_us in [70, 80] {
            input.put(Role::Display, at_us, 0);
        }
        assert_eq!(taken(&mut output), "0");
        input.put(Role::Sensor, 90, MOST);
        // Full again.
        input.put(Role::Sensor, 100, 0);
        assert_eq!(taken(&mut output), "1");
        input.put(Role::Display, 110, MOST + 1);
        assert!((2..MOST).all(|item| taken(&mut output) == item.to_string()));
        match output.take(Instant::now()) {
            Taken::Refused(loss) => {
                let want = Loss {
                    role: Role::Display,
                    count: 2,
                    at_us: 70,
                };
                assert_eq!(loss, want);
            }
            _ => panic!("the loss is missing"),
        }
        let out = [(); 4].map(|()| taken(&mut output));
        let want = [
            MOST.to_string(),
            "1 of the sensor".to_owned(),
            (MOST + 1).to_string(),
            "nothing".to_owned(),
        ];
        assert_eq!(out, want);
    }

    #[test]
    fn a_disk_that_is_slower_than_what_comes_slows_it_down_and_loses_nothing() {
        let (input, mut output) = full(LIMIT);
        let speaker = thread::spawn(move || {
            (MOST..MOST + 100).for_each(|item| input.put(Role::Sensor, 0, item));
        });
        // Room is made one by one, for a speaker that waits for it.
        for want in 0..MOST + 100 {
            match output.take(Instant::now() + LIMIT) {
                Taken::Item(item) => assert_eq!(item, want),
                _ => panic!("{want} is missing"),
            }
        }
        speaker.join().expect("it only talks");
        assert_eq!(taken(&mut output), "closed");
    }

    #[test]
    fn a_queue_that_is_closed_still_gives_what_waits_and_one_whose_end_is_gone_takes_nothing() {
        let (input, mut output) = full(LIMIT);
        input.close();
        // Nothing is waited for, and nothing counted.
        input.put(Role::Sensor, 0, MOST);
        assert!((0..MOST).all(|item| taken(&mut output) == item.to_string()));
        assert_eq!(taken(&mut output), "closed");
        let (input, output) = full(LIMIT);
        drop(output);
        input.put(Role::Sensor, 0, MOST);
    }
}
