//! The time that links and bridges go by, and how their threads wait for it: the computer's own, or one
//! that a test moves on.
//!
//! Whoever waits does so on a [`Notify`], and on nothing else. So a clock knows at any moment who waits for
//! what, and one that is not the computer's can go on as soon as everybody waits.

use std::sync::mpsc::{self, TryIter, TryRecvError};
use std::sync::{Arc, Condvar, LazyLock, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

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

/// The computer's own clock: [`now_us`].
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemClock;

#[derive(Debug, Default)]
struct SystemNotify {
    is_notified: Mutex<bool>,
    changed: Condvar,
}

impl Clock for SystemClock {
    fn now_us(&self) -> u64 {
        now_us()
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
        let wait = Duration::from_micros(until_us.saturating_sub(now_us()));
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

    /// All that are there.
    pub fn try_iter(&self) -> TryIter<'_, T> {
        self.receiver.try_iter()
    }
}

/// Since the computer was started, what it slept included; never steps back.
fn since_boot() -> Duration {
    read(ClockId::CLOCK_BOOTTIME)
}

/// Every Linux since 2.6.39 has both.
fn read(clock: ClockId) -> Duration {
    clock_gettime(clock).map_or(Duration::ZERO, |time| {
        let s = u64::try_from(time.tv_sec()).unwrap_or(0);
        Duration::new(s, u32::try_from(time.tv_nsec()).unwrap_or(0))
    })
}

/// The same moment since the computer's start and since 1970.
struct Epoch {
    started: Duration,
    unix_ns: u64,
}

impl Epoch {
    fn at(started: Duration, calendar: Duration) -> Self {
        Self {
            started,
            // In whole µs, as all moments are.
            unix_ns: u64::try_from(calendar.as_micros() * 1_000).unwrap_or(u64::MAX),
        }
    }

    fn us(&self, since_boot: Duration) -> u64 {
        let elapsed = since_boot.saturating_sub(self.started);
        u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX)
    }

    fn unix_ns(&self, at_us: u64) -> u64 {
        self.unix_ns.saturating_add(at_us.saturating_mul(1_000))
    }
}

/// A calendar before 1970 is as good as one that stands at its beginning.
static EPOCH: LazyLock<Epoch> =
    LazyLock::new(|| Epoch::at(since_boot(), read(ClockId::CLOCK_REALTIME)));

/// µs since this program first asked, what the computer slept included; never steps back.
pub fn now_us() -> u64 {
    EPOCH.us(since_boot())
}

/// A moment of [`now_us`] in ns since 1970, by the calendar as it stood when this program first asked.
pub fn unix_ns(at_us: u64) -> u64 {
    EPOCH.unix_ns(at_us)
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
        assert_eq!(receiver.recv_until(u64::MAX), None, "nobody is left");
    }
}

#[cfg(test)]
mod host_clock_tests {
    use std::time::{Instant, SystemTime, UNIX_EPOCH};

    use super::*;

    #[test]
    fn moments_lie_on_the_calendar_as_far_apart_as_on_the_clock() {
        let now_us = now_us();
        assert_eq!(unix_ns(now_us + 7) - unix_ns(now_us), 7_000);
        let today_ns = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map(|since| since.as_nanos())
            .unwrap_or(0);
        let off_ns = i128::from(unix_ns(super::now_us())) - today_ns.cast_signed();
        assert!(off_ns.abs() < 1_000_000_000, "{off_ns} ns off");
    }

    #[test]
    fn what_is_heard_after_the_computer_slept_lies_right_on_the_calendar() {
        let (started, calendar) = (Duration::from_secs(10), Duration::from_secs(1_000_010));
        let epoch = Epoch::at(started, calendar);
        // Three seconds awake, and an hour asleep.
        let later = Duration::from_secs(3_603);
        assert_eq!(epoch.us(started + later), 3_603_000_000);
        let today_ns = (calendar + later).as_nanos();
        assert_eq!(
            u128::from(epoch.unix_ns(epoch.us(started + later))),
            today_ns
        );
    }

    #[test]
    fn the_clock_is_the_systems_that_counts_its_sleep() {
        // The kernel's own word for it, in s with two decimals.
        let uptime_s = || -> f64 {
            let text = std::fs::read_to_string("/proc/uptime").expect("Linux has it");
            let first = text.split(' ').next().unwrap_or_default();
            first.parse().expect("a number")
        };
        let (before_s, began) = (uptime_s(), Instant::now());
        let since_boot_s = since_boot().as_secs_f64();
        let took_s = began.elapsed().as_secs_f64();
        assert!(since_boot_s >= before_s, "{since_boot_s} before {before_s}");
        assert!(
            since_boot_s <= before_s + took_s + 0.02,
            "{since_boot_s} after {before_s}"
        );
    }
}
