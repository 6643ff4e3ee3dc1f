//! Serial ports in memory, which go by virtual time: a bench without a system beneath it.

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
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
/// The boards' rate, which a host sets when it opens a port.
const BAUD: u32 = 921_600;
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
            is_open: AtomicBool::new(false),
            baud: AtomicU32::new(BAUD),
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

    /// Sets the rate of the port called `path`, as a program beside its client may do.
    ///
    /// # Panics
    /// If there is no such port.
    pub fn set_baud(&self, path: &Path, baud: u32) {
        let cable = self.cable(path).expect("the port is there");
        cable.baud.store(baud, Ordering::Relaxed);
    }

    /// The cable at `path`, or at what a link in a bench's folder leads to.
    fn cable(&self, path: &Path) -> Option<Arc<Cable>> {
        let link = fs::read_link(path).ok();
        let cables = locked(&self.cables);
        let cable = cables.get(link.as_deref().unwrap_or(path));
        cable.filter(|cable| !cable.is_pulled()).cloned()
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
        let cable = self.cable(port);
        cable.is_some_and(|cable| cable.is_open.load(Ordering::Acquire))
    }

    fn open(&self, port: &Path) -> Result<Opened, State> {
        let cable = self
            .cable(port)
            .ok_or_else(|| State::Absent(port.display().to_string()))?;
        if cable.is_open.swap(true, Ordering::AcqRel) {
            return Err(State::Busy(port.to_owned()));
        }
        cable.baud.store(BAUD, Ordering::Relaxed);
        let _ = cable.to_board.write(&[0]);
        Ok(Opened {
            input: Box::new(HostInput {
                cable: Arc::clone(&cable),
                reads: Arc::clone(&self.reads),
            }),
            output: Box::new(HostOutput { cable }),
        })
    }
}

struct Cable {
    to_host: Pipe,
    to_board: Pipe,
    is_pulled: AtomicBool,
    /// Whether a program has the port open.
    is_open: AtomicBool,
    /// The rate that it has set.
    baud: AtomicU32,
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

    /// What has come, as far as it fits: how many bytes.
    fn take(&self, bytes: &mut [u8]) -> usize {
        let mut held = locked(&self.bytes);
        let count = held.len().min(bytes.len());
        for (place, byte) in bytes.iter_mut().zip(held.drain(..count)) {
            *place = byte;
        }
        count
    }

    fn read(
        &self,
        bytes: &mut [u8],
        wait_us: u64,
        is_gone: impl Fn() -> bool,
    ) -> io::Result<usize> {
        let mut count = self.take(bytes);
        if count == 0 && !is_gone() {
            self.came.wait_until(self.clock.now_us() + wait_us);
            count = self.take(bytes);
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
        self.cable.is_open.store(false, Ordering::Release);
    }
}

/// The end that a board has.
pub struct BoardEnd {
    cable: Arc<Cable>,
    /// The clock that it goes by.
    pub clock: Arc<dyn Clock>,
}

impl BoardEnd {
    /// Whether a program has the port open.
    pub fn has_client(&self) -> bool {
        self.cable.is_open.load(Ordering::Acquire)
    }

    /// The rate that it has set.
    pub fn baud(&self) -> u32 {
        self.cable.baud.load(Ordering::Relaxed)
    }

    /// What has come by now, as far as it fits: how many bytes.
    pub fn take(&self, bytes: &mut [u8]) -> usize {
        self.cable.to_board.take(bytes)
    }

    /// Hands on what there is room for now: how many bytes.
    pub fn put(&self, bytes: &[u8]) -> usize {
        self.cable.to_host.write(bytes).unwrap_or(0)
    }

    /// Forgets what nobody has read.
    pub fn forget_unread(&self) {
        self.cable.to_host.clear();
    }

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
