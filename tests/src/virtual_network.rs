//! A network in memory, which goes by virtual time: bytes come later, or not for a while, or not at all. Their
//! order is kept, as by TCP; or, for what may be lost, not, as by datagrams.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use host_bridge::clock::{Clock, Notify, micros};
use host_bridge::lock::locked;
use host_bridge::relay::endpoint::Endpoint;
use host_bridge::relay::endpoint::Reach;
use host_bridge::relay::envelope::Envelope;
use host_bridge::relay::name::{Channel, Name};
use host_bridge::relay::network::NetworkError;
use host_bridge::relay::transport::{Connection, Subscription, Transport};
use protocol::Role;

use crate::virtual_clock::VirtualClock;
use crate::weather::{Chance, Sky};

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
    sky: Sky,
    chance: Chance,
    has_datagrams: bool,
    /// All that was said, if somebody wants to know.
    tape: Option<Vec<(String, Vec<u8>)>>,
    is_still: bool,
    is_cut: bool,
    /// Whose programs neither say nor hear anything.
    cut_off: Option<Role>,
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
    role: Role,
    subscription: Arc<Subscription>,
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
        let loss = 0.0;
        self.turn(Sky {
            delay,
            jitter,
            loss,
        });
    }

    /// From now on the network is like that.
    pub fn turn(&self, sky: Sky) {
        locked(&self.0.state).sky = sky;
    }

    /// Whether what may be lost goes by datagrams from now on, or by a stream as all the rest.
    pub fn use_datagrams(&self, has_datagrams: bool) {
        locked(&self.0.state).has_datagrams = has_datagrams;
    }

    /// Begins to keep all that is said, with its key.
    pub fn listen_in(&self) {
        locked(&self.0.state).tape = Some(Vec::new());
    }

    /// Says again what was said, as a stranger who has listened.
    pub fn replay(&self) {
        let mut state = locked(&self.0.state);
        let at_us = self.0.clock.now_us();
        for (key, bytes) in state.tape.take().unwrap_or_default() {
            state.sent += 1;
            let place = (at_us, state.sent);
            let from = u64::MAX;
            state.flying.insert(place, Flying { from, key, bytes });
        }
        drop(state);
        self.0.changed.notify();
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

    /// Loses what programs of `role` say, and what they would hear, for as long as they are cut off.
    pub fn cut_off(&self, role: Role, is_cut: bool) {
        locked(&self.0.state).cut_off = is_cut.then_some(role);
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
                (listener.subscription.on_bytes)(&bytes);
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
            let hears = |listener: &&Listener| {
                listener.owner != from
                    && Some(listener.role) != state.cut_off
                    && listener.subscription.hears(&key)
            };
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
            role,
            subscription: Arc::new(subscription),
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
        if !state.is_cut && state.cut_off != Some(self.role) {
            let sky = state.sky;
            let key = self.name.key(self.role, channel);
            let bytes = envelope.to_bytes();
            if let Some(tape) = &mut state.tape {
                tape.push((key.clone(), bytes.clone()));
            }
            let is_datagram = state.has_datagrams && channel.is_fleeting();
            if is_datagram && state.chance.loses(&sky) {
                return true;
            }
            let mut comes_us = now_us + micros(state.chance.delay(&sky));
            if !is_datagram {
                comes_us += micros(state.chance.repair(&sky));
                let last_us = state.last_us.entry(self.owner).or_default();
                comes_us = comes_us.max(*last_us);
                *last_us = comes_us;
            }
            state.sent += 1;
            let place = (comes_us, state.sent);
            let from = self.owner;
            state.flying.insert(place, Flying { from, key, bytes });
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
