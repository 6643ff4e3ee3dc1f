//! A network's weather on one TCP port: bytes come later, or not for a while, or the connection is cut.
//! TCP itself keeps their order, as it does on any network: what is lost comes when it was sent again, and all
//! that was sent after it waits for it. [`datagrams`] is the same for UDP, where nothing waits.

pub mod datagrams;

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// How often what waits looks round.
const LOOK: Duration = Duration::from_millis(1);
/// What TCP waits at least beyond a round trip before it sends again what nobody has answered, as Linux does.
const LEAST_TIMEOUT: Duration = Duration::from_millis(200);
/// Longest chunk that has a delay of its own.
const CHUNK: usize = 2_048;

/// A port that leads to another one.
pub struct Weather {
    address: SocketAddr,
    port: Arc<Port>,
}

/// How a network is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sky {
    /// What everything takes.
    pub delay: Duration,
    /// What some take longer, at most.
    pub jitter: Duration,
    /// The share that is lost, from 0 to 1.
    pub loss: f64,
}

impl Sky {
    /// What there and back takes.
    fn round_trip(&self) -> Duration {
        2 * self.delay + self.jitter
    }
}

/// The same in every run; a generator of Lehmer's.
#[derive(Clone, Debug)]
pub(crate) struct Chance(u64);

impl Default for Chance {
    fn default() -> Self {
        Self(1_000_003)
    }
}

impl Chance {
    /// From 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 0x7fff_ffff;
        self.0 as f64 / 2_147_483_647.0
    }

    /// What something takes.
    pub(crate) fn delay(&mut self, sky: &Sky) -> Duration {
        sky.delay + sky.jitter.mul_f64(self.next())
    }

    /// Whether something is lost.
    pub(crate) fn loses(&mut self, sky: &Sky) -> bool {
        self.next() < sky.loss
    }

    /// How much longer a segment of TCP takes that may be lost. It notices a loss by what comes after it, a round trip
    /// later; if it loses what it sends then as well, it waits for a timeout, and each time twice as long.
    pub(crate) fn repair(&mut self, sky: &Sky) -> Duration {
        let mut later = Duration::ZERO;
        let mut next = sky.round_trip();
        let mut timeout = sky.round_trip() + LEAST_TIMEOUT;
        while self.loses(sky) {
            later += next;
            next = timeout;
            timeout *= 2;
        }
        later
    }
}

struct Port {
    towards: SocketAddr,
    sky: Mutex<Sky>,
    is_still: AtomicBool,
    is_closed: AtomicBool,
    ended: AtomicBool,
    connections: AtomicUsize,
    /// Connections up to this number lead nowhere any more.
    stranded: AtomicUsize,
    open: Mutex<Vec<TcpStream>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Weather {
    /// A port of its own that leads to `towards`, in fair weather.
    ///
    /// # Panics
    /// If the system has no port.
    pub fn over(towards: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("the system has ports");
        let address = listener.local_addr().expect("a port has an address");
        let port = Arc::new(Port {
            towards: SocketAddr::from(([127, 0, 0, 1], towards)),
            sky: Mutex::default(),
            is_still: AtomicBool::new(false),
            is_closed: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            stranded: AtomicUsize::new(0),
            open: Mutex::new(Vec::new()),
        });
        let accepting = Arc::clone(&port);
        thread::spawn(move || accepting.accept(&listener));
        Self { address, port }
    }

    /// The port.
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// From now on the network is like that.
    pub fn turn(&self, sky: Sky) {
        *locked(&self.port.sky) = sky;
    }

    /// Holds everything up, and lets all of it go on again: a network that is stuck.
    pub fn hold_still(&self, is_still: bool) {
        self.port.is_still.store(is_still, Ordering::Relaxed);
    }

    /// Lets all connections that there are lead nowhere from now on, without a word to either end, as when
    /// one of them gets another address; new ones are as good as ever.
    pub fn strand(&self) {
        self.port
            .stranded
            .store(self.connections(), Ordering::Relaxed);
    }

    /// Cuts all connections. While it is `closed`, new ones are cut as well.
    pub fn cut(&self, closed: bool) {
        self.port.is_closed.store(closed, Ordering::Relaxed);
        for stream in locked(&self.port.open).drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// How often somebody has connected.
    pub fn connections(&self) -> usize {
        self.port.connections.load(Ordering::Relaxed)
    }
}

impl Drop for Weather {
    fn drop(&mut self) {
        self.port.ended.store(true, Ordering::Relaxed);
        self.cut(true);
        // Wakes who accepts.
        let _ = TcpStream::connect(self.address);
    }
}

impl Port {
    fn accept(self: Arc<Self>, listener: &TcpListener) {
        for stream in listener.incoming() {
            if self.ended.load(Ordering::Relaxed) {
                return;
            }
            let number = self.connections.fetch_add(1, Ordering::Relaxed) + 1;
            let Ok(near) = stream else { continue };
            if self.is_closed.load(Ordering::Relaxed) {
                continue;
            }
            let Ok(far) = TcpStream::connect(self.towards) else {
                continue;
            };
            for (from, to) in [(&near, &far), (&far, &near)] {
                let _ = to.set_nodelay(true);
                if let (Ok(from), Ok(to), Ok(open)) =
                    (from.try_clone(), to.try_clone(), to.try_clone())
                {
                    locked(&self.open).push(open);
                    Arc::clone(&self).carry(number, from, to);
                }
            }
        }
    }

    /// Carries one direction of the connection of this number.
    fn carry(self: Arc<Self>, number: usize, mut from: TcpStream, to: TcpStream) {
        let (put, taken) = channel();
        let later = Arc::clone(&self);
        thread::spawn(move || later.release(number, &taken, to));
        thread::spawn(move || {
            let mut chunk = [0; CHUNK];
            let mut chance = Chance::default();
            while let Ok(count @ 1..) = from.read(&mut chunk) {
                let sky = *locked(&self.sky);
                let due = Instant::now() + chance.delay(&sky) + chance.repair(&sky);
                if put.send((due, chunk[..count].to_vec())).is_err() {
                    break;
                }
            }
        });
    }

    fn release(&self, number: usize, taken: &Receiver<(Instant, Vec<u8>)>, mut to: TcpStream) {
        for (due, bytes) in taken {
            self.wait_while(|| self.is_still.load(Ordering::Relaxed) || self.is_stranded(number));
            loop {
                let wait = due.saturating_duration_since(Instant::now());
                if wait.is_zero() {
                    break;
                }
                thread::park_timeout(wait);
            }
            if to.write_all(&bytes).is_err() {
                break;
            }
        }
        self.wait_while(|| self.is_stranded(number));
        let _ = to.shutdown(Shutdown::Both);
    }

    fn is_stranded(&self, number: usize) -> bool {
        number <= self.stranded.load(Ordering::Relaxed)
    }

    /// Waits while `holds`, for as long as there is weather.
    fn wait_while(&self, holds: impl Fn() -> bool) {
        while holds() && !self.ended.load(Ordering::Relaxed) {
            thread::park_timeout(LOOK);
        }
    }
}
