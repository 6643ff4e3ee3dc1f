//! The weather on a UDP port: each datagram on its own comes later, maybe behind one that was sent after it, or never.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::lock::locked;

use super::{Chance, Sky};

/// How often what waits looks whether the weather has ended.
const LOOK: Duration = Duration::from_millis(50);
/// Longest datagram.
const LONGEST: usize = 65_535;

/// A UDP port that leads to another one.
pub struct DatagramWeather {
    shared: Arc<Shared>,
}

struct Shared {
    near: UdpSocket,
    towards: SocketAddr,
    sky: Mutex<Sky>,
    is_ended: AtomicBool,
}

/// A datagram on its way.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Flying {
    due: Instant,
    /// Out of the port, to this client; or into it, from this one.
    back: bool,
    client: SocketAddr,
    bytes: Vec<u8>,
}

impl DatagramWeather {
    /// The UDP port numbered `port`, which leads to the one numbered `towards`, in fair weather.
    ///
    /// # Panics
    /// If the port is taken.
    pub fn over(port: u16, towards: u16) -> Self {
        let near = UdpSocket::bind(("127.0.0.1", port)).expect("the port is free");
        near.set_read_timeout(Some(LOOK))
            .expect("a socket has a timeout");
        let shared = Arc::new(Shared {
            near,
            towards: SocketAddr::from(([127, 0, 0, 1], towards)),
            sky: Mutex::default(),
            is_ended: AtomicBool::new(false),
        });
        let (fly, flying) = channel();
        let (carrying, landing) = (Arc::clone(&shared), Arc::clone(&shared));
        let back = fly.clone();
        thread::spawn(move || carrying.carry(&fly));
        thread::spawn(move || landing.land(&flying, &back));
        Self { shared }
    }

    /// From now on the network is like that.
    pub fn turn(&self, sky: Sky) {
        *locked(&self.shared.sky) = sky;
    }
}

impl Drop for DatagramWeather {
    fn drop(&mut self) {
        self.shared.is_ended.store(true, Ordering::Relaxed);
    }
}

impl Shared {
    /// Takes what comes into the port.
    fn carry(&self, fly: &Sender<Flying>) {
        let mut chance = Chance::default();
        let mut bytes = [0; LONGEST];
        while !self.is_ended.load(Ordering::Relaxed) {
            let Ok((count, client)) = self.near.recv_from(&mut bytes) else {
                continue;
            };
            self.send(fly, &mut chance, false, client, &bytes[..count]);
        }
    }

    fn send(
        &self,
        fly: &Sender<Flying>,
        chance: &mut Chance,
        back: bool,
        client: SocketAddr,
        bytes: &[u8],
    ) {
        let sky = *locked(&self.sky);
        let delay = chance.delay(&sky);
        if !chance.loses(&sky) {
            // Who lands it may have ended.
            let _ = fly.send(Flying {
                due: Instant::now() + delay,
                back,
                client,
                bytes: bytes.to_vec(),
            });
        }
    }

    /// Gives on what is due. Each client has a socket of its own towards the other end.
    fn land(self: Arc<Self>, flying: &Receiver<Flying>, fly: &Sender<Flying>) {
        let mut air = BinaryHeap::new();
        let mut clients: HashMap<SocketAddr, Arc<UdpSocket>> = HashMap::new();
        while !self.is_ended.load(Ordering::Relaxed) {
            let wait = air.peek().map_or(LOOK, |Reverse(next): &Reverse<Flying>| {
                next.due.saturating_duration_since(Instant::now())
            });
            match flying.recv_timeout(wait) {
                Ok(new) => air.push(Reverse(new)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            while air
                .peek()
                .is_some_and(|Reverse(next)| next.due <= Instant::now())
            {
                let Some(Reverse(due)) = air.pop() else { break };
                if due.back {
                    // One who has gone does not hear it.
                    let _ = self.near.send_to(&due.bytes, due.client);
                    continue;
                }
                let far = clients
                    .entry(due.client)
                    .or_insert_with(|| Arc::clone(&self).open(due.client, fly.clone()));
                let _ = far.send_to(&due.bytes, self.towards);
            }
        }
    }

    fn open(self: Arc<Self>, client: SocketAddr, fly: Sender<Flying>) -> Arc<UdpSocket> {
        let far = Arc::new(UdpSocket::bind("127.0.0.1:0").expect("the system has ports"));
        far.set_read_timeout(Some(LOOK))
            .expect("a socket has a timeout");
        let heard = Arc::clone(&far);
        thread::spawn(move || {
            let mut chance = Chance::default();
            let mut bytes = [0; LONGEST];
            while !self.is_ended.load(Ordering::Relaxed) {
                if let Ok(count) = heard.recv(&mut bytes) {
                    self.send(&fly, &mut chance, true, client, &bytes[..count]);
                }
            }
        });
        far
    }
}
