//! One serial port for any number of programs of one user.
//!
//! ```text
//! board ── port ── owner: the first program that opens it ── socket ─┬─ guest
//!                                                                    └─ guest
//! ```
//!
//! Every program hears every byte that the board says, and runs the protocol on it by itself. What programs say
//! goes to the board as whole frames, numbered by the owner: to the board they are one host. Whoever holds the
//! lock of [`claim`] owns the port. The system takes the lock from a program that ends, however it ends, and
//! the first guest that notices becomes the owner. Its link stays as it is: what was missed meanwhile shows as
//! frames lost. An owner that is halted would take the port from everybody, Stop included: a guest that finds one lets it go on.
//!
//! Nothing listens beyond this computer, nor to other users: the sockets lie in a folder of the user's own.

mod bus;
pub mod claim;
mod funnel;

use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam_channel::RecvTimeoutError;
use protocol::{Message, frame};

use crate::clock::SystemClock;
use crate::line::host_hello;
use crate::lock::locked;
use crate::place::{Place, is_far};
use crate::serial;
use crate::state::State;
use crate::system::{Input, Opened, Ports, System};
use bus::{Guest, Host};
use claim::{Claim, Device};
use funnel::Funnel;

/// Longest wait of a guest for bytes, as at a port.
const READ_TIMEOUT: Duration = Duration::from_millis(20);
/// An owner whose board is silent says so as often: nothing.
const HEARTBEAT: Duration = Duration::from_millis(100);
/// After so long without a word the owner is looked for anew, even if it seems to be there.
const SILENCE: Duration = Duration::from_millis(400);
/// After so long without an owner the port is given up.
const GIVEN_UP: Duration = Duration::from_millis(2_000);

/// How often this program has each port open.
static OPEN: Mutex<BTreeMap<PathBuf, usize>> = Mutex::new(BTreeMap::new());

/// This computer's ports, which other programs of this user may have open as well.
#[derive(Clone, Copy, Debug, Default)]
pub struct SharedPorts;

impl Default for System {
    fn default() -> Self {
        Self {
            clock: Arc::new(SystemClock),
            ports: Arc::new(SharedPorts),
        }
    }
}

impl Ports for SharedPorts {
    fn candidates(&self, place: &Place) -> Vec<PathBuf> {
        place.candidates()
    }

    fn is_open(&self, port: &Path) -> bool {
        locked(&OPEN).contains_key(port)
    }

    fn open(&self, path: &Path) -> Result<Opened, State> {
        if is_far(path) {
            let absent = State::Absent(path.display().to_string());
            return open_source(&path.to_string_lossy(), move || Err(absent.clone()));
        }
        // What is no port is refused in the words of who knows ports.
        let Some(device) = Device::of(path) else {
            return serial::open(path);
        };
        let named = path.to_owned();
        Seat {
            path: path.to_owned(),
            device,
            open: Box::new(move || serial::open(&named)),
        }
        .take()
    }
}

/// Opens a source of bytes that is no port, and shares it under `name` as a port is shared. Fails as
/// `open` does, which is called where no other program has the source, and whenever its owner has gone.
pub fn open_source(
    name: &str,
    open: impl Fn() -> Result<Opened, State> + Send + 'static,
) -> Result<Opened, State> {
    Seat {
        path: PathBuf::from(name),
        device: Device::named(name),
        open: Box::new(open),
    }
    .take()
}

/// A source of bytes that is not on this computer, for the programs that are.
pub struct Outlet {
    host: Host,
    _claim: Claim,
}

impl Outlet {
    /// Offers what is called `name`; `on_asked` is called with the frames that programs say to it. `None` if
    /// another program offers it already.
    pub fn open(name: &str, on_asked: impl Fn(&[u8]) + Send + Sync + 'static) -> Option<Self> {
        let device = Device::named(name);
        let claim = device.claim().ok().flatten()?;
        Some(Self {
            host: Host::open(device.socket(), on_asked),
            _claim: claim,
        })
    }

    /// Lets the programs hear something, maybe nothing, which tells them that it is still there: at least every
    /// 100 ms.
    pub fn say(&self, bytes: &[u8]) {
        self.host.say(bytes);
    }
}

/// Which port, and how it is opened.
struct Seat {
    path: PathBuf,
    device: Device,
    open: Box<dyn Fn() -> Result<Opened, State> + Send>,
}

impl Seat {
    fn take(self) -> Result<Opened, State> {
        let part = match self.device.claim() {
            Ok(Some(claim)) => Part::Owner(self.own(claim)?),
            Ok(None) => self.join()?,
            // Nobody can be told of it: better alone than not at all, for there may be a Stop to be said.
            Err(_) => return (self.open)(),
        };
        let way = Arc::new(Mutex::new(part.way()));
        let path = self.path.clone();
        *locked(&OPEN).entry(path.clone()).or_default() += 1;
        Ok(Opened {
            input: Box::new(SharedInput {
                seat: self,
                part,
                way: Arc::clone(&way),
                changes: 0,
            }),
            output: Box::new(SharedOutput {
                way,
                begun: Vec::new(),
                path,
            }),
        })
    }

    fn own(&self, claim: Claim) -> Result<Owner, State> {
        let Opened { input, output } = (self.open)()?;
        let funnel = Arc::new(Mutex::new(Funnel::new(output)));
        let asked = Arc::clone(&funnel);
        let host = Host::open(self.device.socket(), move |frames| {
            // A line that takes nothing is its own program's to tell of.
            let _ = locked(&asked).put(frames);
        });
        Ok(Owner {
            input,
            funnel,
            host,
            said: Instant::now(),
            _claim: claim,
        })
    }

    /// Joins the owner, who may have begun just now; or owns the port, if he lets go of it without having shared it.
    fn join(&self) -> Result<Part, State> {
        let until = Instant::now() + GIVEN_UP;
        loop {
            if let Ok(Some(claim)) = self.device.claim() {
                return self.own(claim).map(Part::Owner);
            }
            self.device.wake_holder();
            match Guest::open(&self.device.socket()) {
                Ok(guest) => return Ok(Part::Guest(Hearing::new(guest))),
                Err(_) if Instant::now() >= until => {
                    return Err(State::Hung(self.path.clone(), self.device.holder()));
                }
                Err(_) => std::thread::park_timeout(READ_TIMEOUT),
            }
        }
    }
}

/// What this program is to the port.
enum Part {
    Owner(Owner),
    Guest(Hearing),
    /// The owner has gone, and the port is to be opened; another program may still be letting go of it.
    Heir {
        claim: Claim,
        since: Instant,
    },
    Nobody,
}

impl Part {
    fn way(&self) -> Way {
        match self {
            Self::Owner(owner) => Way::Port(Arc::clone(&owner.funnel)),
            Self::Guest(hearing) => Way::Bus(hearing.guest.asker()),
            Self::Heir { .. } | Self::Nobody => Way::None,
        }
    }
}

/// The program that has the port.
struct Owner {
    input: Box<dyn Input>,
    funnel: Arc<Mutex<Funnel>>,
    host: Host,
    /// When anything was said to the guests.
    said: Instant,
    /// Given up last of all: whoever gets it finds the port closed.
    _claim: Claim,
}

impl Owner {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.input.read(bytes);
        let count = *read.as_ref().unwrap_or(&0);
        if count > 0 || self.said.elapsed() >= HEARTBEAT {
            self.said = Instant::now();
            self.host.say(&bytes[..count]);
        }
        read
    }
}

/// A program that hears what the owner hears.
struct Hearing {
    guest: Guest,
    /// What there was no room for.
    rest: Vec<u8>,
    heard: Instant,
    joined: Instant,
}

impl Hearing {
    fn new(guest: Guest) -> Self {
        Self {
            guest,
            rest: Vec::new(),
            heard: Instant::now(),
            joined: Instant::now(),
        }
    }

    /// What has come; `None` if the owner has gone.
    fn read(&mut self, bytes: &mut [u8]) -> Option<usize> {
        if self.rest.is_empty() {
            match self.guest.said().recv_timeout(READ_TIMEOUT) {
                Ok(said) => {
                    self.heard = Instant::now();
                    self.rest = said;
                }
                Err(RecvTimeoutError::Timeout) => return Some(0),
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
        let count = self.rest.len().min(bytes.len());
        bytes[..count].copy_from_slice(&self.rest[..count]);
        self.rest.drain(..count);
        Some(count)
    }
}

/// Where bytes come from, whoever owns the port.
struct SharedInput {
    seat: Seat,
    part: Part,
    way: Arc<Mutex<Way>>,
    changes: u32,
}

impl Input for SharedInput {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match &mut self.part {
            Part::Owner(owner) => owner.read(bytes),
            Part::Guest(hearing) => match hearing.read(bytes) {
                Some(count @ 1..) => Ok(count),
                _ => {
                    self.look()?;
                    Err(ErrorKind::TimedOut.into())
                }
            },
            Part::Heir { .. } => {
                self.inherit()?;
                Err(ErrorKind::TimedOut.into())
            }
            Part::Nobody => Err(ErrorKind::BrokenPipe.into()),
        }
    }

    fn changes(&self) -> u32 {
        self.changes
    }

    fn close(self: Box<Self>, discards: bool) {
        let Self { part, way, .. } = *self;
        // The other half may live on a while.
        *locked(&way) = Way::None;
        match part {
            Part::Owner(owner) => {
                owner.input.close(discards);
                drop(owner.host);
                // What is left of it goes now, the claim last.
            }
            Part::Guest(hearing) => hearing.guest.leave(),
            Part::Heir { .. } | Part::Nobody => {}
        }
    }
}

impl SharedInput {
    fn become_part(&mut self, part: Part) {
        *locked(&self.way) = part.way();
        self.part = part;
        self.changes = self.changes.wrapping_add(1);
    }

    /// A guest hears nothing: is the owner still there?
    fn look(&mut self) -> io::Result<()> {
        if let Some(claim) = self.seat.device.claim()? {
            let since = Instant::now();
            self.become_part(Part::Heir { claim, since });
            return self.inherit();
        }
        let Part::Guest(hearing) = &mut self.part else {
            return Ok(());
        };
        let is_quiet = hearing.joined.elapsed() >= SILENCE && hearing.heard.elapsed() >= SILENCE;
        if !is_quiet && hearing.guest.is_joined() {
            return Ok(());
        }
        if self.seat.device.wake_holder() {
            return Ok(());
        }
        // There is an owner, and not the one that was joined.
        match Guest::open(&self.seat.device.socket()) {
            Ok(guest) => {
                let heard = hearing.heard;
                if heard.elapsed() < GIVEN_UP {
                    let joined = Hearing::new(guest);
                    self.become_part(Part::Guest(Hearing { heard, ..joined }));
                    return Ok(());
                }
            }
            // The next owner may not listen yet.
            Err(_) if hearing.heard.elapsed() < GIVEN_UP => {
                std::thread::park_timeout(READ_TIMEOUT);
                return Ok(());
            }
            Err(_) => {}
        }
        self.become_part(Part::Nobody);
        Err(ErrorKind::BrokenPipe.into())
    }

    /// Opens the port in the place of an owner who has gone.
    fn inherit(&mut self) -> io::Result<()> {
        let Part::Heir { claim, since } = std::mem::replace(&mut self.part, Part::Nobody) else {
            return Ok(());
        };
        // The claim is shared, so that it is kept if the port can't be opened yet.
        match self.seat.own(claim.again()) {
            Ok(owner) => {
                // The frames of the owner before had other numbers: a Hello that asks begins anew.
                let hello = Message::Hello(host_hello().asking(true));
                let mut bytes = [0; frame::MAX_FRAME];
                if let Some(hello) = frame::encode(0, &hello, &mut bytes) {
                    let _ = locked(&owner.funnel).put(hello);
                }
                self.become_part(Part::Owner(owner));
                Ok(())
            }
            // A program that was killed lets go of the lock first.
            Err(State::Busy { .. }) if since.elapsed() < GIVEN_UP => {
                self.part = Part::Heir { claim, since };
                std::thread::park_timeout(READ_TIMEOUT);
                Ok(())
            }
            Err(_) => Err(ErrorKind::BrokenPipe.into()),
        }
    }
}

enum Way {
    Port(Arc<Mutex<Funnel>>),
    Bus(bus::Asker),
    None,
}

/// Where bytes go, whoever owns the port: frame by frame.
struct SharedOutput {
    way: Arc<Mutex<Way>>,
    /// A frame that has not ended yet.
    begun: Vec<u8>,
    path: PathBuf,
}

impl Write for SharedOutput {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.begun.extend_from_slice(bytes);
        let Some(end) = self.begun.iter().rposition(|&byte| byte == 0) else {
            return Ok(bytes.len());
        };
        let frames: Vec<u8> = self.begun.drain(..=end).collect();
        let sent = match &*locked(&self.way) {
            Way::Port(funnel) => locked(funnel).put(&frames),
            Way::Bus(asker) => asker.ask(frames),
            Way::None => Err(ErrorKind::WouldBlock.into()),
        };
        match sent {
            Ok(()) => Ok(bytes.len()),
            Err(error) => {
                self.begun.clear();
                Err(error)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for SharedOutput {
    fn drop(&mut self) {
        let mut open = locked(&OPEN);
        if let Some(count) = open.get_mut(&self.path) {
            *count -= 1;
            if *count == 0 {
                open.remove(&self.path);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Silent;

    impl Input for Silent {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(ErrorKind::TimedOut.into())
        }

        fn close(self: Box<Self>, _: bool) {}
    }

    fn seat(device: Device) -> Seat {
        Seat {
            path: PathBuf::from("port"),
            device,
            open: Box::new(|| {
                let (input, output) = (Box::new(Silent), Box::new(io::sink()));
                Ok(Opened { input, output })
            }),
        }
    }

    #[test]
    fn a_port_that_another_program_lets_go_of_unshared_is_had() {
        // Another one had it a moment ago: that is why it is joined, and not claimed.
        let seat = seat(Device::named(&format!("seat-test-{}", std::process::id())));
        let part = seat.join();
        assert!(matches!(part, Ok(Part::Owner(_))), "{:?}", part.err());
    }

    #[test]
    fn a_port_that_cannot_be_shared_is_had_alone() {
        let opened = seat(Device::without_folder()).take();
        let Ok(Opened { mut output, .. }) = opened else {
            panic!("it is not opened");
        };
        output.write_all(b"!").expect("it takes a Stop");
    }
}
