//! The time that links and bridges go by, and how their threads wait for it: the computer's own, or one
//! that a test moves on.
//!
//! Whoever waits does so on a [`Notify`], and on nothing else. So a clock knows at any moment who waits for
//! what, and one that is not the computer's can go on as soon as everybody waits.

use std::sync::mpsc::{self, TryIter, TryRecvError};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::host_clock;
use crate::lock::locked;

/// Time, and threads that go by it.
pub trait Clock: Send + Sync {
    /// µs since some moment; never steps back.
    fn now_us(&self) -> u64;

    /// Something for one thread to wait on.
    fn notify(&self) -> Arc<dyn Notify>;

    /// Runs `work` on a thread of its own.
    fn spawn(&self, work: Box<dyn FnOnce() + Send>) -> JoinHandle<()>;

    /// Waits for the end of a thread that was spawned here. One that panicked has said so on standard error.
    fn join(&self, thread: JoinHandle<()>);
}

/// Wakes the one thread that waits on it. What comes while nobody waits is kept: the next wait ends at once.
pub trait Notify: Send + Sync {
    /// Wakes who waits.
    fn notify(&self);

    /// Waits to be notified, until `until_us` of the clock at the longest; [`u64::MAX`] is for ever.
    fn wait_until(&self, until_us: u64);
}

/// The computer's own clock: [`host_clock::now_us`].
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

#[derive(Debug, Default)]
struct SystemNotify {
    is_notified: Mutex<bool>,
    changed: Condvar,
}

impl Clock for SystemClock {
    fn now_us(&self) -> u64 {
        host_clock::now_us()
    }

    fn notify(&self) -> Arc<dyn Notify> {
        Arc::<SystemNotify>::default()
    }

    fn spawn(&self, work: Box<dyn FnOnce() + Send>) -> JoinHandle<()> {
        thread::spawn(work)
    }

    fn join(&self, thread: JoinHandle<()>) {
        let _ = thread.join();
    }
}

impl Notify for SystemNotify {
    fn notify(&self) {
        *locked(&self.is_notified) = true;
        self.changed.notify_one();
    }

    fn wait_until(&self, until_us: u64) {
        let wait = Duration::from_micros(until_us.saturating_sub(host_clock::now_us()));
        let (mut is_notified, _) = self
            .changed
            .wait_timeout_while(locked(&self.is_notified), wait, |notified| !*notified)
            .unwrap_or_else(PoisonError::into_inner);
        *is_notified = false;
    }
}

/// A time in whole µs.
pub fn micros(time: Duration) -> u64 {
    u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
}

/// Whether what was done at `last_us`, if ever, is to be done again at `now_us`.
pub fn is_due(last_us: Option<u64>, period_us: u64, now_us: u64) -> bool {
    last_us.is_none_or(|last_us| now_us.saturating_sub(last_us) >= period_us)
}

/// A channel whose receiver waits by `clock`.
pub fn channel<T>(clock: &Arc<dyn Clock>) -> (Sender<T>, Receiver<T>) {
    let (sender, receiver) = mpsc::channel();
    let came = clock.notify();
    (
        Sender {
            sender,
            came: Arc::clone(&came),
        },
        Receiver {
            receiver,
            came,
            clock: Arc::clone(clock),
        },
    )
}

/// The end of a [`channel`] that things are put into.
pub struct Sender<T> {
    sender: mpsc::Sender<T>,
    came: Arc<dyn Notify>,
}

impl<T> Clone for Sender<T> {
    fn clone(&self) -> Self {
        Self {
            sender: self.sender.clone(),
            came: Arc::clone(&self.came),
        }
    }
}

impl<T> Sender<T> {
    /// Puts something in. Who does not listen any more does not want to know.
    pub fn send(&self, value: T) {
        let _ = self.sender.send(value);
        self.came.notify();
    }
}

/// The end of a [`channel`] that things are taken out of.
pub struct Receiver<T> {
    receiver: mpsc::Receiver<T>,
    came: Arc<dyn Notify>,
    clock: Arc<dyn Clock>,
}

impl<T> Receiver<T> {
    /// The next one; `None` if nothing comes until `until_us`, or if nobody is left who could send.
    pub fn recv_until(&self, until_us: u64) -> Option<T> {
        loop {
            match self.receiver.try_recv() {
                Ok(value) => return Some(value),
                Err(TryRecvError::Disconnected) => return None,
                Err(TryRecvError::Empty) if self.clock.now_us() >= until_us => return None,
                Err(TryRecvError::Empty) => self.came.wait_until(until_us),
            }
        }
    }

    /// The next one; `None` if nothing comes within `limit`.
    pub fn recv_within(&self, limit: Duration) -> Option<T> {
        self.recv_until(self.clock.now_us().saturating_add(micros(limit)))
    }

    /// All that are there.
    pub fn try_iter(&self) -> TryIter<'_, T> {
        self.receiver.try_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_notified_before_anybody_waits_is_not_lost() {
        let notify = SystemClock.notify();
        notify.notify();
        notify.wait_until(u64::MAX);
        let now_us = SystemClock.now_us();
        notify.wait_until(now_us + 1_000);
        assert!(SystemClock.now_us() >= now_us + 1_000);
    }

    #[test]
    fn a_receiver_waits_for_what_comes_and_no_longer_than_it_was_told() {
        let clock: Arc<dyn Clock> = Arc::new(SystemClock);
        let (sender, receiver) = channel(&clock);
        assert_eq!(receiver.recv_until(0), None);
        let sending = clock.spawn(Box::new(move || sender.send(7)));
        assert_eq!(receiver.recv_until(u64::MAX), Some(7));
        clock.join(sending);
        assert_eq!(
            receiver.recv_within(Duration::from_secs(600)),
            None,
            "nobody is left"
        );
    }
}
