//! Time that goes on when everybody waits: threads of a program by virtual time.
//!
//! One thread has the turn at any moment. It gives it up by waiting, and then the one comes whose wait is
//! over first; if that is later, time is later. So a machine's load decides how long a test takes, and
//! never what comes of it.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::{self, JoinHandle, ThreadId};
use std::time::Duration;

use host_bridge::clock::{Clock, Notify, micros};
use host_bridge::lock::locked;

/// Between two looks of [`wait_until`], in µs.
const LOOK_US: u64 = 1_000;

/// A clock that a test makes. Whoever makes it has the turn.
#[derive(Clone, Default)]
pub struct VirtualClock(Arc<Turns>);

#[derive(Default)]
struct Turns {
    state: Mutex<State>,
}

struct State {
    now_us: u64,
    /// Whose wait was ended last, while it goes on.
    turn: Option<u64>,
    is_taken: bool,
    /// Who waits: until when, in which order they came, and the number of what they wait on.
    waiting: BTreeSet<(u64, u64, u64)>,
    waiters: BTreeMap<u64, Waiter>,
    next: u64,
    /// Threads that run, and what wakes whoever waits for their end.
    running: HashMap<ThreadId, Option<Arc<dyn Notify>>>,
}

/// What is known of a [`VirtualNotify`].
struct Waiter {
    is_notified: bool,
    /// Its entry among those who wait.
    entry: Option<(u64, u64, u64)>,
    turn: Arc<Condvar>,
}

impl Default for State {
    fn default() -> Self {
        Self {
            now_us: 0,
            turn: None,
            is_taken: true,
            waiting: BTreeSet::new(),
            waiters: BTreeMap::new(),
            next: 0,
            running: HashMap::new(),
        }
    }
}

impl State {
    fn number(&mut self) -> u64 {
        self.next += 1;
        self.next
    }

    /// Has the one of this number wait.
    fn enter(&mut self, number: u64, until_us: u64) {
        let entry = (until_us, self.number(), number);
        if let Some(waiter) = self.waiters.get_mut(&number) {
            waiter.entry = Some(entry);
            self.waiting.insert(entry);
        }
    }

    /// The turn is the next one's; nobody's if all wait for ever.
    fn pass(&mut self) {
        self.is_taken = false;
        let Some(&entry) = self
            .waiting
            .first()
            .filter(|(until_us, ..)| *until_us < u64::MAX)
        else {
            return;
        };
        self.waiting.remove(&entry);
        let (until_us, _, number) = entry;
        self.now_us = self.now_us.max(until_us);
        self.is_taken = true;
        self.turn = Some(number);
        if let Some(waiter) = self.waiters.get_mut(&number) {
            waiter.entry = None;
            waiter.turn.notify_one();
        }
    }
}

/// Something to wait on by virtual time.
struct VirtualNotify {
    number: u64,
    turn: Arc<Condvar>,
    turns: Arc<Turns>,
}

impl VirtualNotify {
    fn new(turns: &Arc<Turns>) -> Self {
        let turn = Arc::<Condvar>::default();
        let mut state = locked(&turns.state);
        let number = state.number();
        let waiter = Waiter {
            is_notified: false,
            entry: None,
            turn: Arc::clone(&turn),
        };
        state.waiters.insert(number, waiter);
        drop(state);
        Self {
            number,
            turn,
            turns: Arc::clone(turns),
        }
    }

    /// Waits for the turn of who has entered.
    fn take_turn(&self, state: MutexGuard<'_, State>) {
        let is_others = |state: &mut State| !(state.is_taken && state.turn == Some(self.number));
        let waited = self.turn.wait_while(state, is_others);
        let mut state = waited.unwrap_or_else(std::sync::PoisonError::into_inner);
        state.turn = None;
        if let Some(waiter) = state.waiters.get_mut(&self.number) {
            waiter.is_notified = false;
        }
    }
}

impl Notify for VirtualNotify {
    fn notify(&self) {
        let mut state = locked(&self.turns.state);
        let now_us = state.now_us;
        let Some(waiter) = state.waiters.get_mut(&self.number) else {
            return;
        };
        waiter.is_notified = true;
        if let Some(entry) = waiter.entry.take() {
            state.waiting.remove(&entry);
            state.enter(self.number, now_us.min(entry.0));
            if !state.is_taken {
                state.pass();
            }
        }
    }

    fn wait_until(&self, until_us: u64) {
        let mut state = locked(&self.turns.state);
        let is_over = state.now_us >= until_us;
        let Some(waiter) = state.waiters.get_mut(&self.number) else {
            return;
        };
        if std::mem::take(&mut waiter.is_notified) || is_over {
            return;
        }
        state.enter(self.number, until_us);
        state.pass();
        self.take_turn(state);
    }
}

impl Drop for VirtualNotify {
    fn drop(&mut self) {
        locked(&self.turns.state).waiters.remove(&self.number);
    }
}

/// Gives the turn up when its thread ends, by itself or by a panic.
struct Leaving(Arc<Turns>);

impl Drop for Leaving {
    fn drop(&mut self) {
        let waits = locked(&self.0.state)
            .running
            .remove(&thread::current().id());
        if let Some(joiner) = waits.flatten() {
            joiner.notify();
        }
        locked(&self.0.state).pass();
    }
}

impl Clock for VirtualClock {
    fn now_us(&self) -> u64 {
        locked(&self.0.state).now_us
    }

    fn notify(&self) -> Arc<dyn Notify> {
        Arc::new(VirtualNotify::new(&self.0))
    }

    fn spawn(&self, work: Box<dyn FnOnce() + Send>) -> JoinHandle<()> {
        let first = VirtualNotify::new(&self.0);
        let mut state = locked(&self.0.state);
        let now_us = state.now_us;
        state.enter(first.number, now_us);
        drop(state);
        let turns = Arc::clone(&self.0);
        let thread = thread::spawn(move || {
            first.take_turn(locked(&first.turns.state));
            let _leaving = Leaving(turns);
            work();
        });
        // It has no turn before this thread waits.
        let id = thread.thread().id();
        locked(&self.0.state).running.insert(id, None);
        thread
    }

    fn join(&self, thread: JoinHandle<()>) {
        let ended = self.notify();
        let id = thread.thread().id();
        let runs = match locked(&self.0.state).running.get_mut(&id) {
            Some(joiner) => {
                *joiner = Some(Arc::clone(&ended));
                true
            }
            None => false,
        };
        if runs {
            ended.wait_until(u64::MAX);
        }
        let _ = thread.join();
    }
}

/// Waits until `holds`, looking every millisecond of `clock`, for at most `limit` of its time; whether it
/// did.
pub fn wait_until(clock: &dyn Clock, limit: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let end_us = clock.now_us().saturating_add(micros(limit));
    let notify = clock.notify();
    while !holds() {
        let now_us = clock.now_us();
        if now_us >= end_us {
            return false;
        }
        notify.wait_until(now_us + LOOK_US);
    }
    true
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[test]
    fn time_goes_from_one_wait_s_end_to_the_next_and_nothing_waits_in_truth() {
        let clock = VirtualClock::default();
        let notify = clock.notify();
        const DAY_US: u64 = 86_400_000_000;
        notify.wait_until(DAY_US);
        assert_eq!(clock.now_us(), DAY_US);
        notify.wait_until(5);
        assert_eq!(clock.now_us(), DAY_US, "never back");
    }

    #[test]
    fn threads_take_turns_in_the_order_of_their_time() {
        let clock = VirtualClock::default();
        let log = Arc::new(Mutex::new(Vec::new()));
        let threads: Vec<_> = [(3, "b"), (2, "a")]
            .map(|(period_us, name)| {
                let (log, own) = (Arc::clone(&log), clock.clone());
                clock.spawn(Box::new(move || {
                    let notify = own.notify();
                    for step in 1..=2 {
                        notify.wait_until(period_us * step);
                        locked(&log).push((own.now_us(), name));
                    }
                }))
            })
            .into();
        threads.into_iter().for_each(|thread| clock.join(thread));
        assert_eq!(*locked(&log), [(2, "a"), (3, "b"), (4, "a"), (6, "b")]);
    }

    #[test]
    fn who_is_notified_goes_on_before_time_does() {
        let clock = VirtualClock::default();
        let notify = clock.notify();
        let woken_us = Arc::new(AtomicU64::new(0));
        let (theirs, own, told) = (Arc::clone(&notify), clock.clone(), Arc::clone(&woken_us));
        let thread = clock.spawn(Box::new(move || {
            theirs.wait_until(u64::MAX);
            told.store(own.now_us(), Ordering::SeqCst);
        }));
        clock.notify().wait_until(7);
        notify.notify();
        clock.join(thread);
        assert_eq!(woken_us.load(Ordering::SeqCst), 7);
    }

    #[test]
    fn a_thread_that_panics_holds_nobody_up() {
        let clock = VirtualClock::default();
        let thread = clock.spawn(Box::new(|| panic!("on purpose")));
        clock.join(thread);
        assert!(wait_until(&clock, Duration::from_secs(1), || clock
            .now_us()
            > 900_000));
    }
}
