//! Serial ports in memory, which go by virtual time: a bench without a system beneath it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use host_bridge::clock::{Clock, Notify};
use host_bridge::lock::locked;
use host_bridge::place::Place;
use host_bridge::state::State;
use host_bridge::system::{Input, Opened, Ports, System};

use crate::virtual_clock::VirtualClock;

/// How long a host waits for bytes, in µs, as at a real port.
const READ_US: u64 = 20_000;
/// How long a board waits for them, in µs.
const BOARD_READ_US: u64 = 1_000;
/// What a line holds that nobody reads.
const LINE_BYTES: usize = 4_096;

/// A clock and ports that one test has for itself.
#[derive(Clone, Default)]
pub struct VirtualBench {
    /// Its clock.
    pub clock: VirtualClock,
    /// Its ports.
    pub ports: Arc<VirtualPorts>,
}

impl VirtualBench {
    /// What links live on.
    pub fn system(&self) -> System {
        let ports: Arc<dyn Ports> = Arc::clone(&self.ports) as Arc<dyn Ports>;
        System {
            clock: Arc::new(self.clock.clone()),
            ports,
        }
    }

    /// A new port, called by a name that no other has.
    pub fn cable(&self) -> (PathBuf, BoardEnd) {
        let number = self.ports.named.fetch_add(1, Ordering::Relaxed);
        let path = PathBuf::from(format!("/virtual/tty{number}"));
        let cable = Arc::new(Cable {
            to_host: Pipe::new(&self.clock),
            to_board: Pipe::new(&self.clock),
            is_pulled: AtomicBool::new(false),
        });
        self.ports.plug(&path, &cable);
        let clock: Arc<dyn Clock> = Arc::new(self.clock.clone());
        (path, BoardEnd { cable, clock })
    }
}

/// Ports by name.
#[derive(Default)]
pub struct VirtualPorts {
    cables: Mutex<BTreeMap<PathBuf, Arc<Cable>>>,
    open: Arc<Mutex<BTreeSet<PathBuf>>>,
    named: AtomicU64,
    reads: Arc<AtomicU64>,
    looks: AtomicU64,
}

impl VirtualPorts {
    fn plug(&self, path: &Path, cable: &Arc<Cable>) {
        locked(&self.cables).insert(path.to_owned(), Arc::clone(cable));
    }

    /// Puts `name` on the port called `path`, as udev does when a cable is put in.
    pub fn link(&self, path: &Path, name: &Path) {
        let cable = locked(&self.cables).get(path).cloned();
        if let Some(cable) = cable {
            self.plug(name, &cable);
        }
    }

    /// Takes a name away.
    pub fn remove(&self, name: &Path) {
        locked(&self.cables).remove(name);
    }

    /// How often hosts have looked at their lines.
    pub fn reads(&self) -> u64 {
        self.reads.load(Ordering::Relaxed)
    }

    /// How often hosts have looked which ports there are.
    pub fn looks(&self) -> u64 {
        self.looks.load(Ordering::Relaxed)
    }

    fn cable(&self, path: &Path) -> Option<Arc<Cable>> {
        let cables = locked(&self.cables);
        cables.get(path).filter(|cable| !cable.is_pulled()).cloned()
    }
}

impl Ports for VirtualPorts {
    fn candidates(&self, place: &Place) -> Vec<PathBuf> {
        self.looks.fetch_add(1, Ordering::Relaxed);
        let named = match place {
            Place::Port(path) => std::slice::from_ref(path),
            Place::Among(ports) => ports,
            Place::Usb(_) | Place::Anywhere => &[],
        };
        let is_there = |path: &&PathBuf| self.cable(path).is_some();
        named.iter().filter(is_there).cloned().collect()
    }

    fn is_open(&self, port: &Path) -> bool {
        locked(&self.open).contains(port)
    }

    fn open(&self, port: &Path) -> Result<Opened, State> {
        let cable = self
            .cable(port)
            .ok_or_else(|| State::Absent(port.display().to_string()))?;
        if !locked(&self.open).insert(port.to_owned()) {
            let port = port.to_owned();
            return Err(State::Busy(port));
        }
        let _ = cable.to_board.write(&[0]);
        Ok(Opened {
            input: Box::new(HostInput {
                cable: Arc::clone(&cable),
                reads: Arc::clone(&self.reads),
            }),
            output: Box::new(HostOutput {
                cable,
                path: port.to_owned(),
                open: Arc::clone(&self.open),
            }),
        })
    }
}

struct Cable {
    to_host: Pipe,
    to_board: Pipe,
    is_pulled: AtomicBool,
}

impl Cable {
    fn is_pulled(&self) -> bool {
        self.is_pulled.load(Ordering::Acquire)
    }
}

/// One direction of a line.
struct Pipe {
    bytes: Mutex<VecDeque<u8>>,
    came: Arc<dyn Notify>,
    clock: VirtualClock,
}

impl Pipe {
    fn new(clock: &VirtualClock) -> Self {
        Self {
            bytes: Mutex::default(),
            came: clock.notify(),
            clock: clock.clone(),
        }
    }

    fn clear(&self) {
        locked(&self.bytes).clear();
    }

    fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        let mut held = locked(&self.bytes);
        let count = bytes.len().min(LINE_BYTES - held.len());
        if count == 0 && !bytes.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        held.extend(&bytes[..count]);
        drop(held);
        self.came.notify();
        Ok(count)
    }

    fn read(
        &self,
        bytes: &mut [u8],
        wait_us: u64,
        is_gone: impl Fn() -> bool,
    ) -> io::Result<usize> {
        let take = |bytes: &mut [u8]| -> usize {
            let mut held = locked(&self.bytes);
            let count = held.len().min(bytes.len());
            for (place, byte) in bytes.iter_mut().zip(held.drain(..count)) {
                *place = byte;
            }
            count
        };
        let mut count = take(bytes);
        if count == 0 && !is_gone() {
            self.came.wait_until(self.clock.now_us() + wait_us);
            count = take(bytes);
        }
        match count {
            0 if is_gone() => Err(ErrorKind::BrokenPipe.into()),
            0 => Err(ErrorKind::TimedOut.into()),
            count => Ok(count),
        }
    }
}

struct HostInput {
    cable: Arc<Cable>,
    reads: Arc<AtomicU64>,
}

impl Input for HostInput {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.reads.fetch_add(1, Ordering::Relaxed);
        let is_pulled = || self.cable.is_pulled();
        self.cable.to_host.read(bytes, READ_US, is_pulled)
    }

    fn close(self: Box<Self>, discards: bool) {
        if discards {
            self.cable.to_board.clear();
        }
    }
}

struct HostOutput {
    cable: Arc<Cable>,
    path: PathBuf,
    open: Arc<Mutex<BTreeSet<PathBuf>>>,
}

impl Write for HostOutput {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.cable.is_pulled() {
            return Err(ErrorKind::BrokenPipe.into());
        }
        self.cable.to_board.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for HostOutput {
    fn drop(&mut self) {
        locked(&self.open).remove(&self.path);
    }
}

/// The end that a board has.
pub struct BoardEnd {
    cable: Arc<Cable>,
    /// The clock that it goes by.
    pub clock: Arc<dyn Clock>,
}

impl BoardEnd {
    /// Pulls the cable when it is dropped.
    pub fn plug(&self) -> Plug {
        Plug(Arc::clone(&self.cable))
    }
}

impl Read for BoardEnd {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let is_pulled = || self.cable.is_pulled();
        self.cable.to_board.read(bytes, BOARD_READ_US, is_pulled)
    }
}

impl Write for BoardEnd {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = self.cable.to_host.write(bytes);
        if taken.is_ok() {
            return taken;
        }
        // As at a pseudo-terminal, a full line is waited for.
        let until_us = self.clock.now_us() + BOARD_READ_US;
        self.clock.notify().wait_until(until_us);
        if self.cable.is_pulled() {
            return Err(ErrorKind::BrokenPipe.into());
        }
        self.cable.to_host.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A cable that is in. Dropping it pulls it.
pub struct Plug(Arc<Cable>);

impl Drop for Plug {
    fn drop(&mut self) {
        self.0.is_pulled.store(true, Ordering::Release);
        self.0.to_host.came.notify();
    }
}
