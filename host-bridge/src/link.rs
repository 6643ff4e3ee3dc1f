//! One board at the end of a serial line: opened, greeted, listened to, and opened again when it is lost.
//!
//! A thread of its own reads the line and runs the protocol's own [`Port`]; who wants to say something
//! writes it himself, at once. A board that is unplugged is looked for every [`RETRY`].

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use protocol::{
    ClockOffset, Hello, MAX_FRAME, Message, Peer, Ping, Port, PortCounters, Role, Status,
};
use serialport::{ErrorKind, TTYPort};

use crate::host_clock::now_us;
use crate::place::Place;
use crate::state::State;

/// Speed of a console, 8N1.
pub const BAUD: u32 = 921_600;
/// How long a lost board is waited for between two looks: a cable that is put back is seen well within
/// a second.
pub const RETRY: Duration = Duration::from_millis(100);
/// Longest wait for bytes; also how late a Hello or a ping may be.
const READ_TIMEOUT: Duration = Duration::from_millis(20);
/// Between two pings.
const PING_US: u64 = 1_000_000;
/// What a board may take for its first answer: two Hellos and a status.
const PATIENCE_US: u64 = 1_500_000;
/// How long a board that was known may say nothing: it reports once a second.
const SILENCE_US: u64 = 2_500_000;
/// Longest read: what comes in a [`READ_TIMEOUT`] at full speed, twice over.
const READ_BYTES: usize = 4_096;

/// What a link tells its owner.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "an event is handed over once, and boxing every message would cost more"
)]
pub enum Event {
    /// The board has said something.
    Heard {
        /// When its last byte was read, in µs of [`now_us`].
        at_us: u64,
        /// What it said.
        message: Message,
    },
    /// The board has started anew since it was heard last: its clock and counters begin again.
    Restarted,
    /// The link stands differently.
    Turned(State),
}

/// Why something was not said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotSent {
    /// Nobody is there who would understand it.
    #[error("the board is not there")]
    NotKnown,
    /// The line does not take bytes.
    #[error("the line takes no bytes")]
    Stuck,
}

/// What the two clocks of a link are to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// The board's clock minus [`now_us`], in µs.
    pub offset_us: i64,
    /// The shortest round trip of late, in µs: twice the bound of the offset's error.
    pub round_trip_us: u64,
}

/// The way to one board. Dropping it closes the line.
pub struct Link {
    shared: Arc<Shared>,
    reader: Option<JoinHandle<()>>,
}

/// What both sides of a link use.
struct Shared {
    role: Role,
    line: Mutex<Option<Line>>,
    state: Mutex<State>,
    clock: Mutex<ClockOffset>,
    counters: Mutex<PortCounters>,
    ended: AtomicBool,
    /// Wakes a reader that waits to try again.
    woken: (Mutex<()>, Condvar),
}

/// An open line.
struct Line {
    port: Box<Port>,
    tty: TTYPort,
}

impl Line {
    /// Writes what is to be said. False if the line does not take it.
    fn flush(&mut self) -> bool {
        let mut bytes = [0; MAX_FRAME];
        loop {
            let count = self.port.take(&mut bytes);
            if count == 0 {
                return true;
            }
            if self.tty.write_all(&bytes[..count]).is_err() {
                // The other end counts what is left of the frame as corrupt.
                while self.port.take(&mut bytes) != 0 {}
                return false;
            }
        }
    }
}

/// A mutex whose data are sound at every moment, whoever died holding it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How a host introduces itself.
pub fn host_hello() -> Hello {
    let number = |text: &str| text.parse().unwrap_or(0);
    Hello::new(
        Role::Host,
        "host-bridge",
        [
            number(env!("CARGO_PKG_VERSION_MAJOR")),
            number(env!("CARGO_PKG_VERSION_MINOR")),
            number(env!("CARGO_PKG_VERSION_PATCH")),
        ],
    )
}

impl Link {
    /// Looks for the board of `role` at `place`, for as long as the link lives. `tell` is called from the
    /// link's thread with everything that happens; it may [`Link::post`], and it holds up the reading for
    /// as long as it takes.
    pub fn open(role: Role, place: Place, tell: impl FnMut(Event) + Send + 'static) -> Self {
        let shared = Arc::new(Shared {
            role,
            line: Mutex::new(None),
            state: Mutex::new(State::Absent {
                place: place.to_string(),
            }),
            clock: Mutex::new(ClockOffset::new()),
            counters: Mutex::new(PortCounters::new()),
            ended: AtomicBool::new(false),
            woken: (Mutex::new(()), Condvar::new()),
        });
        let reader = Reader {
            shared: Arc::clone(&shared),
            place,
            tell,
            told: None,
        };
        Self {
            shared,
            reader: Some(thread::spawn(|| reader.run())),
        }
    }

    /// A way to say things that can be handed to other threads; it does not keep the link open.
    pub fn voice(&self) -> Voice {
        Voice {
            shared: Arc::clone(&self.shared),
        }
    }

    /// Says `message` now. See [`Voice::post`].
    ///
    /// # Errors
    /// If nobody is there, or the line is stuck.
    pub fn post(&self, message: &Message) -> Result<(), NotSent> {
        self.shared.post(message)
    }

    /// How the link stands.
    pub fn state(&self) -> State {
        locked(&self.shared.state).clone()
    }

    /// What this end of the line has counted since the line was opened last.
    pub fn counters(&self) -> PortCounters {
        *locked(&self.shared.counters)
    }

    /// The board's clock; none before the first exchange since it started.
    pub fn clocks(&self) -> Option<Clocks> {
        let clock = locked(&self.shared.clock);
        Some(Clocks {
            offset_us: clock.offset_us()?,
            round_trip_us: clock.round_trip_us()?,
        })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Release);
        self.shared.woken.1.notify_all();
        if let Some(reader) = self.reader.take() {
            // A reader that panicked has said so on standard error.
            let _ = reader.join();
        }
    }
}

/// Says things to a board, from any thread.
#[derive(Clone)]
pub struct Voice {
    shared: Arc<Shared>,
}

impl Voice {
    /// Says `message` now: it is with the system when this returns.
    ///
    /// # Errors
    /// If nobody is there, or the line is stuck.
    pub fn post(&self, message: &Message) -> Result<(), NotSent> {
        self.shared.post(message)
    }
}

impl Shared {
    fn post(&self, message: &Message) -> Result<(), NotSent> {
        if !locked(&self.state).is_known() {
            return Err(NotSent::NotKnown);
        }
        let mut line = locked(&self.line);
        let Some(line) = line.as_mut() else {
            return Err(NotSent::NotKnown);
        };
        line.port.post(message);
        if line.flush() {
            Ok(())
        } else {
            Err(NotSent::Stuck)
        }
    }

    fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }

    /// Waits for [`RETRY`], or until the link ends.
    fn rest(&self) {
        let (mutex, woken) = &self.woken;
        let guard = locked(mutex);
        if !self.is_ended() {
            let _ = woken.wait_timeout(guard, RETRY);
        }
    }
}

/// The thread that reads.
struct Reader<F> {
    shared: Arc<Shared>,
    place: Place,
    tell: F,
    told: Option<State>,
}

/// What has been heard on a line since it was opened.
#[derive(Default)]
struct Hearing {
    opened_us: u64,
    bytes: u64,
    /// Bytes that are neither text nor between lines of text.
    strange: u64,
    /// When a frame came last that was understood.
    understood_us: Option<u64>,
    pinged_us: Option<u64>,
    uptime_us: u64,
}

impl<F: FnMut(Event)> Reader<F> {
    fn run(mut self) {
        while !self.shared.is_ended() {
            let candidates = self.place.candidates();
            if candidates.is_empty() {
                self.turn(State::Absent {
                    place: self.place.to_string(),
                });
            }
            for port in candidates {
                match open(&port) {
                    Ok(tty) => self.converse(&port, tty),
                    Err(error) => self.turn(refused(port, &error)),
                }
                if self.shared.is_ended() {
                    return;
                }
            }
            self.shared.rest();
        }
    }

    /// Talks until the line is lost, or leads nowhere that was wanted.
    fn converse(&mut self, path: &Path, mut tty: TTYPort) {
        let Ok(mut writer) = tty.try_clone_native() else {
            return;
        };
        // What a terminal may have left half said is over with it.
        if writer.write_all(&[0]).is_err() {
            return;
        }
        *locked(&self.shared.clock) = ClockOffset::new();
        *locked(&self.shared.line) = Some(Line {
            port: Box::new(Port::new(host_hello())),
            tty: writer,
        });
        let mut hearing = Hearing {
            opened_us: now_us(),
            ..Hearing::default()
        };
        let mut bytes = vec![0; READ_BYTES];
        let mut messages = Vec::new();
        while !self.shared.is_ended() {
            let count = match tty.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => count,
                Err(error) if is_pause(&error) => 0,
                Err(_) => break,
            };
            let at_us = now_us();
            let Some(peer) = self.hear(&mut hearing, &bytes[..count], at_us, &mut messages) else {
                break;
            };
            let state = self.judge(path, peer, &hearing, at_us);
            let leads_nowhere = self.place == Place::Anywhere
                && !matches!(state, State::Opened { .. } | State::Known { .. });
            self.turn(state);
            for message in messages.drain(..) {
                self.pass(&mut hearing, at_us, message);
            }
            if leads_nowhere {
                break;
            }
        }
        *locked(&self.shared.line) = None;
        let lost = self
            .told
            .as_ref()
            .is_some_and(|told| matches!(told, State::Known { .. } | State::Opened { .. }));
        if lost && !self.shared.is_ended() {
            self.turn(State::Absent {
                place: self.place.to_string(),
            });
        }
    }

    /// Runs the protocol on what came, and says what is due; none if the line is lost.
    fn hear(
        &self,
        hearing: &mut Hearing,
        bytes: &[u8],
        at_us: u64,
        messages: &mut Vec<Message>,
    ) -> Option<Peer> {
        let mut line = locked(&self.shared.line);
        let line = line.as_mut()?;
        hearing.bytes += bytes.len() as u64;
        if matches!(line.port.peer(), Peer::Silent) {
            hearing.strange += bytes.iter().filter(|&&byte| !is_text(byte)).count() as u64;
        }
        line.port
            .receive(at_us, bytes, |message| messages.push(message));
        let peer = line.port.peer();
        let is_known = matches!(peer, Peer::Known(_));
        if !messages.is_empty() || (is_known && hearing.understood_us.is_none()) {
            hearing.understood_us = Some(at_us);
        }
        let due = hearing
            .pinged_us
            .is_none_or(|pinged_us| at_us.saturating_sub(pinged_us) >= PING_US);
        if is_known && due {
            hearing.pinged_us = Some(at_us);
            line.port.post(&Message::Ping(Ping { sent_us: at_us }));
        }
        line.flush();
        *locked(&self.shared.counters) = line.port.counters();
        Some(peer)
    }

    /// How the link stands, by what has been heard.
    fn judge(&self, path: &Path, peer: Peer, hearing: &Hearing, at_us: u64) -> State {
        let port = path.to_owned();
        let impatient = at_us.saturating_sub(hearing.opened_us) > PATIENCE_US;
        match peer {
            Peer::Known(hello) if hello.role != self.shared.role.byte() => State::Stranger {
                port,
                hello,
                wanted: self.shared.role,
            },
            Peer::Known(hello) => {
                let last_us = hearing.understood_us.unwrap_or(hearing.opened_us);
                if at_us.saturating_sub(last_us) > SILENCE_US {
                    State::Silent { port }
                } else {
                    State::Known { port, hello }
                }
            }
            Peer::Foreign(hello) => State::Foreign { port, hello },
            Peer::Silent if !impatient => State::Opened { port },
            Peer::Silent if hearing.bytes == 0 => State::Silent { port },
            Peer::Silent if hearing.strange == 0 => State::Deaf { port },
            Peer::Silent => State::Garbage { port },
        }
    }

    fn pass(&mut self, hearing: &mut Hearing, at_us: u64, message: Message) {
        match &message {
            Message::Pong(pong) => {
                locked(&self.shared.clock).on_pong(pong, at_us);
            }
            Message::Status(Status { uptime_us, .. }) => {
                if *uptime_us < hearing.uptime_us {
                    locked(&self.shared.clock).clear();
                    (self.tell)(Event::Restarted);
                }
                hearing.uptime_us = *uptime_us;
            }
            _ => {}
        }
        (self.tell)(Event::Heard { at_us, message });
    }

    /// Tells of a state that differs from the last one.
    fn turn(&mut self, state: State) {
        if self.told.as_ref() == Some(&state) {
            return;
        }
        *locked(&self.shared.state) = state.clone();
        self.told = Some(state.clone());
        (self.tell)(Event::Turned(state));
    }
}

/// Opens a console for this program alone.
fn open(port: &Path) -> serialport::Result<TTYPort> {
    serialport::new(port.to_string_lossy(), BAUD)
        .timeout(READ_TIMEOUT)
        .open_native()
}

fn refused(port: PathBuf, error: &serialport::Error) -> State {
    match error.kind() {
        ErrorKind::NoDevice => State::Busy { port },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => State::Denied { port },
        ErrorKind::Io(io::ErrorKind::NotFound) => State::Absent {
            place: port.display().to_string(),
        },
        _ => State::Failed {
            port,
            reason: error.to_string(),
        },
    }
}

/// Whether a read only had nothing to give yet.
fn is_pause(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}

/// What a board's lines of text, and the ends of frames, are made of.
const fn is_text(byte: u8) -> bool {
    matches!(byte, b' '..=b'~' | b'\r' | b'\n' | 0)
}
