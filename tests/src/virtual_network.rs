//! A network in memory, which goes by virtual time: bytes come later, or not for a while, or not at all. Their
//! order is kept, as by TCP.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use host_bridge::clock::{Clock, Notify, micros};
use host_bridge::lock::locked;
use host_bridge::relay::endpoint::Endpoint;
use host_bridge::relay::envelope::Envelope;
use host_bridge::relay::name::{Channel, Name};
use host_bridge::relay::network::NetworkError;
use host_bridge::relay::reach::Reach;
use host_bridge::relay::transport::{Connection, OnBytes, Subscription, Transport};
use protocol::Role;

use crate::virtual_clock::VirtualClock;

/// A network to which any number of programs can connect.
#[derive(Clone)]
pub struct VirtualNetwork(Arc<Shared>);

struct Shared {
    clock: VirtualClock,
    state: Mutex<State>,
    /// Wakes who delivers.
    changed: Arc<dyn Notify>,
    is_ended: AtomicBool,
    connected: AtomicU64,
}

#[derive(Default)]
struct State {
    delay_us: u64,
    jitter_us: u64,
    random: u64,
    is_still: bool,
    is_cut: bool,
    /// What is on its way: when it comes, and in which order it went.
    flying: BTreeMap<(u64, u64), Flying>,
    sent: u64,
    /// When the last of each program comes.
    last_us: BTreeMap<u64, u64>,
    listeners: Vec<Listener>,
}

struct Flying {
    from: u64,
    key: String,
    bytes: Vec<u8>,
}

#[derive(Clone)]
struct Listener {
    owner: u64,
    keys: String,
    on_bytes: Arc<OnBytes>,
}

impl VirtualNetwork {
    /// One that takes no time.
    pub fn new(clock: &VirtualClock) -> Self {
        let shared = Arc::new(Shared {
            clock: clock.clone(),
            state: Mutex::default(),
            changed: clock.notify(),
            is_ended: AtomicBool::new(false),
            connected: AtomicU64::new(0),
        });
        let delivering = Arc::clone(&shared);
        // It ends with the network; nobody waits for it.
        drop(clock.spawn(Box::new(move || delivering.deliver())));
        Self(shared)
    }

    /// From now on bytes take `delay`, and some of them up to `jitter` longer.
    pub fn delay(&self, delay: Duration, jitter: Duration) {
        let mut state = locked(&self.0.state);
        (state.delay_us, state.jitter_us) = (micros(delay), micros(jitter));
    }

    /// Holds everything up, and lets all of it go on again: a network that is stuck.
    pub fn hold_still(&self, is_still: bool) {
        locked(&self.0.state).is_still = is_still;
        self.0.changed.notify();
    }

    /// Loses what is on its way, and everything for as long as it is cut.
    pub fn cut(&self, is_cut: bool) {
        let mut state = locked(&self.0.state);
        state.is_cut = is_cut;
        state.flying.clear();
    }

    /// Ends it: nothing is delivered any more.
    pub fn end(&self) {
        self.0.is_ended.store(true, Ordering::Release);
        self.0.changed.notify();
    }
}

impl Shared {
    fn deliver(&self) {
        while !self.is_ended.load(Ordering::Acquire) {
            let (due, until_us) = self.due();
            for (listener, bytes) in due {
                (listener.on_bytes)(&bytes);
            }
            self.changed.wait_until(until_us);
        }
    }

    /// What is to be delivered now, and until when there is nothing else to do.
    fn due(&self) -> (Vec<(Listener, Vec<u8>)>, u64) {
        let now_us = self.clock.now_us();
        let mut state = locked(&self.state);
        let mut due = Vec::new();
        if state.is_still {
            return (due, u64::MAX);
        }
        while let Some(first) = state.flying.first_entry() {
            if first.key().0 > now_us {
                return (due, first.key().0);
            }
            let Flying { from, key, bytes } = first.remove();
            let hears = |listener: &&Listener| listener.owner != from && listener.hears(&key);
            due.extend(
                state
                    .listeners
                    .iter()
                    .filter(hears)
                    .map(|listener| (listener.clone(), bytes.clone())),
            );
        }
        (due, u64::MAX)
    }
}

impl Listener {
    fn hears(&self, key: &str) -> bool {
        match self.keys.strip_suffix('*') {
            Some(start) => key.starts_with(start),
            None => self.keys == key,
        }
    }
}

impl Transport for VirtualNetwork {
    fn connect(
        &self,
        name: &Name,
        role: Role,
        subscriptions: Vec<Subscription>,
    ) -> Result<Box<dyn Connection>, NetworkError> {
        let owner = self.0.connected.fetch_add(1, Ordering::Relaxed);
        let listeners = subscriptions.into_iter().map(|subscription| Listener {
            owner,
            keys: subscription.keys,
            on_bytes: Arc::new(subscription.on_bytes),
        });
        locked(&self.0.state).listeners.extend(listeners);
        Ok(Box::new(Program {
            shared: Arc::clone(&self.0),
            owner,
            name: name.clone(),
            role,
        }))
    }

    fn endpoints(&self) -> &[Endpoint] {
        &[]
    }

    fn reach(&self, _: &Endpoint) -> Reach {
        Reach::Reached
    }
}

/// A program that takes part.
struct Program {
    shared: Arc<Shared>,
    owner: u64,
    name: Name,
    role: Role,
}

impl Connection for Program {
    fn publish(&self, channel: Channel, envelope: &Envelope) -> bool {
        let now_us = self.shared.clock.now_us();
        let mut state = locked(&self.shared.state);
        if !state.is_cut {
            // Never the same twice in a row, and the same in every run.
            state.random = (state.random + 1) * 48_271 % 0x7fff_ffff;
            let jitter_us = state.jitter_us * state.random / 0x7fff_ffff;
            let last_us = state.last_us.get(&self.owner).copied().unwrap_or(0);
            let comes_us = (now_us + state.delay_us + jitter_us).max(last_us);
            state.last_us.insert(self.owner, comes_us);
            state.sent += 1;
            let place = (comes_us, state.sent);
            let flying = Flying {
                from: self.owner,
                key: self.name.key(self.role, channel),
                bytes: envelope.to_bytes(),
            };
            state.flying.insert(place, flying);
        }
        drop(state);
        self.shared.changed.notify();
        true
    }

    fn neighbours(&self) -> usize {
        1
    }

    fn close(&self) {
        locked(&self.shared.state)
            .listeners
            .retain(|listener| listener.owner != self.owner);
    }
}
