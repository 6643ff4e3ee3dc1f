//! A network's weather on one TCP port: bytes come later, or not for a while, or the connection is cut.
//! TCP itself keeps their order, as it does on any network.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// How often what waits looks round.
const LOOK: Duration = Duration::from_millis(1);
/// Longest chunk that has a delay of its own.
const CHUNK: usize = 2_048;

/// A port that leads to another one.
pub struct Weather {
    address: SocketAddr,
    sky: Arc<Sky>,
}

struct Sky {
    towards: SocketAddr,
    delay: Mutex<(Duration, Duration)>,
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
        let sky = Arc::new(Sky {
            towards: SocketAddr::from(([127, 0, 0, 1], towards)),
            delay: Mutex::new((Duration::ZERO, Duration::ZERO)),
            is_still: AtomicBool::new(false),
            is_closed: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            stranded: AtomicUsize::new(0),
            open: Mutex::new(Vec::new()),
        });
        let accepting = Arc::clone(&sky);
        thread::spawn(move || accepting.accept(&listener));
        Self { address, sky }
    }

    /// The port.
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// From now on bytes take `delay`, and some of them up to `jitter` longer.
    pub fn delay(&self, delay: Duration, jitter: Duration) {
        *locked(&self.sky.delay) = (delay, jitter);
    }

    /// Holds everything up, and lets all of it go on again: a network that is stuck.
    pub fn hold_still(&self, is_still: bool) {
        self.sky.is_still.store(is_still, Ordering::Relaxed);
    }

    /// Lets all connections that there are lead nowhere from now on, without a word to either end, as when
    /// one of them gets another address; new ones are as good as ever.
    pub fn strand(&self) {
        self.sky
            .stranded
            .store(self.connections(), Ordering::Relaxed);
    }

    /// Cuts all connections. While it is `closed`, new ones are cut as well.
    pub fn cut(&self, closed: bool) {
        self.sky.is_closed.store(closed, Ordering::Relaxed);
        for stream in locked(&self.sky.open).drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// How often somebody has connected.
    pub fn connections(&self) -> usize {
        self.sky.connections.load(Ordering::Relaxed)
    }
}

impl Drop for Weather {
    fn drop(&mut self) {
        self.sky.ended.store(true, Ordering::Relaxed);
        self.cut(true);
        // Wakes who accepts.
        let _ = TcpStream::connect(self.address);
    }
}

impl Sky {
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
            let mut number: u64 = 1;
            while let Ok(count @ 1..) = from.read(&mut chunk) {
                let (delay, jitter) = *locked(&self.delay);
                number = number * 48_271 % 0x7fff_ffff;
                let due = Instant::now() + delay + jitter.mul_f64(number as f64 / 2_147_483_647.0);
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
