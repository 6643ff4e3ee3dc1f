//! A bench of emulated boards, and a host that opens its ports as it would open the real boards'.

use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use hil_sim_boards::bench::{Bench, Options};
use protocol::{Hello, MAX_FRAME, Message, Ping, Port, PortCounters, Role};
use serialport::SerialPort;

use crate::elves;

/// The boards' baud rate.
pub const BAUD: u32 = 921_600;
/// Only what hangs takes so long.
const PATIENCE: Duration = Duration::from_secs(300);
/// Between two looks.
const LOOK: Duration = Duration::from_millis(1);
/// How long a port is listened to at a time.
const LISTENS: Duration = Duration::from_millis(20);
/// How often one stays: well within what a board waits for at the fastest pace here.
const STAYS: Duration = Duration::from_millis(50);

/// Two boards keep two cores busy: one bench at a time.
static ALONE: Mutex<()> = Mutex::new(());

/// A bench in a folder of the test's own, the only one of its process.
pub struct ExclusiveBench {
    /// The bench.
    pub bench: Bench,
    _turn: MutexGuard<'static, ()>,
}

/// The folder of the test called `name`.
pub fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../target/tmp/bench")
        .join(name)
}

/// Sets up the bench of the test called `name`, as `change` has it.
///
/// # Panics
/// If it can't be set up.
pub fn bench(name: &str, change: impl FnOnce(&mut Options)) -> ExclusiveBench {
    // A test that failed has left its bench behind it.
    let turn = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let mut options = Options::new(folder(name));
    change(&mut options);
    let bench = Bench::start(options, elves::both()).unwrap_or_else(|error| panic!("{error}"));
    ExclusiveBench { bench, _turn: turn }
}

/// Waits until `wanted` gives something.
///
/// # Panics
/// If it does not in five minutes; `what` says what is missing.
pub fn until<T>(what: &str, mut wanted: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = wanted() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: not in five minutes");
        // Whoever looks without a pause takes from the boards the time in which it happens.
        std::thread::park_timeout(LOOK);
    }
}

/// A host at a port.
pub struct Client {
    serial: Box<dyn SerialPort>,
    port: Port,
    begun: Instant,
    /// Bytes that came.
    pub bytes: u64,
    stayed: Instant,
}

impl Client {
    /// Opens the port at `path`, ends whatever line another may have begun there, and says Hello.
    ///
    /// # Panics
    /// If it can't be opened.
    pub fn open(path: &Path, baud: u32) -> Self {
        let name = path.to_string_lossy();
        let serial = serialport::new(name.as_ref(), baud)
            .timeout(LISTENS)
            .open()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut client = Self {
            serial,
            port: Port::new(Hello::new(Role::Host, "test", [0, 1, 0])),
            begun: Instant::now(),
            bytes: 0,
            stayed: Instant::now(),
        };
        client.serial.write_all(&[0]).unwrap();
        client.speak().unwrap();
        client
    }

    /// Says `message`, once it is known who listens.
    ///
    /// # Panics
    /// If the port is gone.
    pub fn say(&mut self, message: &Message) {
        self.port.post(message);
        self.speak().unwrap();
    }

    /// Tells the board now and then that somebody is there, without reading what it says: it would speak
    /// text to who says nothing.
    ///
    /// # Panics
    /// If the port is gone.
    pub fn stay(&mut self) {
        if self.stayed.elapsed() >= STAYS {
            self.stayed = Instant::now();
            self.say(&Message::Ping(Ping { sent_us: 0 }));
        }
    }

    /// What the port has counted.
    pub fn counters(&self) -> PortCounters {
        self.port.counters()
    }

    fn speak(&mut self) -> std::io::Result<()> {
        self.port.poll(self.begun.elapsed().as_micros() as u64);
        let mut out = [0; MAX_FRAME];
        loop {
            let count = self.port.take(&mut out);
            if count == 0 {
                return Ok(());
            }
            self.serial.write_all(&out[..count])?;
        }
    }

    /// Hears what has come, or waits for a moment.
    ///
    /// # Errors
    /// If the port is gone.
    pub fn listen(&mut self, mut heard: impl FnMut(Message)) -> std::io::Result<()> {
        let mut bytes = [0; 1024];
        let count = match self.serial.read(&mut bytes) {
            Ok(0) => return Err(ErrorKind::BrokenPipe.into()),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::TimedOut => 0,
            Err(error) => return Err(error),
        };
        self.bytes += count as u64;
        let now_us = self.begun.elapsed().as_micros() as u64;
        self.port.receive(now_us, &bytes[..count], &mut heard);
        self.speak()
    }

    /// Waits for a message of which `wanted` makes something.
    ///
    /// # Panics
    /// If it does not come in five minutes, or the port is gone; `what` says what is missing.
    pub fn hear<T>(&mut self, what: &str, mut wanted: impl FnMut(Message) -> Option<T>) -> T {
        until(what, || {
            let mut found = None;
            self.listen(|message| found = found.take().or_else(|| wanted(message)))
                .unwrap_or_else(|error| panic!("{what}: {error}"));
            found
        })
    }

    /// Waits until the port is gone.
    ///
    /// # Panics
    /// If it stays for five minutes.
    pub fn hang_up(mut self) {
        until("the port to be gone", || self.listen(|_| {}).err());
    }
}
