//! One of a bench's ports: where a cable is plugged in, and pulled.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::baud::Mismatch;
use super::folder::Folder;
use super::surroundings::{Line, Surroundings};
use super::{PortName, ServeError};
use crate::lockstep::QUANTUM_NS;
use crate::wire::TimedByte;
use hil_sim_core::link::impairments::BYTE_NS;

/// The boards' rate.
pub const BAUD: u32 = 921_600;
/// Bytes that a line carries in a quantum.
pub const LINE_BYTES: usize = (QUANTUM_NS / BYTE_NS) as usize;
/// Bytes that wait for a slow reader before any are lost: some 700 ms of a busy line.
const WAITING_BYTES: usize = 64 << 10;

/// A port by name, with or without a cable.
#[derive(Debug)]
pub struct Socket {
    name: PortName,
    folder: Arc<Folder>,
    surroundings: Arc<dyn Surroundings>,
    cable: Mutex<Cable>,
}

#[derive(Debug, Default)]
struct Cable {
    line: Option<Arc<dyn Line>>,
    /// Whether somebody has the port open.
    has_client: bool,
    /// What a client has not had room for.
    waiting: VecDeque<u8>,
    /// What it never gets.
    dropped: u64,
    /// The client's baud rate, if it is not the boards'.
    mismatch: Option<Lines>,
}

/// Both directions at the wrong rate.
#[derive(Debug)]
struct Lines {
    baud: u32,
    to_client: Mismatch,
    to_board: Mismatch,
    /// When the client's own word is over, in ns.
    free_ns: f64,
}

impl Socket {
    /// A port of `folder`, without a cable yet.
    pub fn new(name: PortName, folder: Arc<Folder>, surroundings: Arc<dyn Surroundings>) -> Self {
        Self {
            name,
            folder,
            surroundings,
            cable: Mutex::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Cable> {
        self.cable.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plugs a cable in, unless there is one.
    ///
    /// # Errors
    /// If there is no pseudo-terminal to be had, or the folder can't be written to.
    pub fn plug(&self) -> Result<(), ServeError> {
        let mut cable = self.lock();
        if cable.line.is_none() {
            self.renew(&mut cable)?;
        }
        Ok(())
    }

    /// Pulls it: whoever had the port open finds it hung up.
    pub fn pull(&self) {
        let mut cable = self.lock();
        let dropped = cable.dropped;
        self.folder.unlink(self.name);
        *cable = Cable {
            dropped,
            ..Cable::default()
        };
    }

    /// Whether a cable is plugged in.
    pub fn is_plugged(&self) -> bool {
        self.lock().line.is_some()
    }

    /// Whether somebody had the port open when it was looked at last.
    pub fn has_client(&self) -> bool {
        self.lock().has_client
    }

    /// Bytes lost because their reader was too slow.
    pub fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    fn renew(&self, cable: &mut Cable) -> Result<(), ServeError> {
        let name = self.name;
        let refuse = |source| ServeError::Terminal { name, source };
        let line = self.surroundings.cable(name).map_err(refuse)?;
        self.folder.link(self.name, line.path())?;
        cable.line = Some(line);
        Ok(())
    }

    /// Hands on what a board has `sent` up to `now_ns`, and takes what a client has for it, as much as the
    /// line carries in a quantum, of which `taken` bytes are on their way already.
    pub fn carry(&self, now_ns: u64, sent: &[TimedByte], taken: usize) -> Vec<u8> {
        let mut cable = self.lock();
        let Some(line) = cable.line.clone() else {
            return Vec::new();
        };
        let heard = self.hear(&mut cable, &*line, now_ns, LINE_BYTES.saturating_sub(taken));
        if !cable.has_client {
            return heard;
        }
        cable.take(now_ns, sent);
        while !cable.waiting.is_empty() {
            let (bytes, _) = cable.waiting.as_slices();
            // A port that fails is one without a client, which the next reading shows.
            let Ok(written @ 1..) = line.write(bytes) else {
                break;
            };
            cable.waiting.drain(..written);
        }
        if cable.waiting.len() > WAITING_BYTES {
            let lost = cable.waiting.len() - WAITING_BYTES;
            cable.waiting.truncate(WAITING_BYTES);
            cable.dropped += lost as u64;
        }
        heard
    }

    /// Takes up to `room` bytes from the client, and sees whether it is there.
    fn hear(&self, cable: &mut Cable, line: &dyn Line, now_ns: u64, room: usize) -> Vec<u8> {
        let room = match &cable.mismatch {
            // At another rate a quantum holds another number of words.
            Some(lines) if lines.free_ns > now_ns as f64 => 0,
            Some(lines) => (QUANTUM_NS as f64 / lines.to_board.word_ns()).ceil() as usize,
            None => room,
        };
        if room == 0 {
            return Vec::new();
        }
        let mut bytes = [0; LINE_BYTES];
        let room = room.min(LINE_BYTES);
        let count = line.read(&mut bytes[..room]).unwrap_or_default();
        let had_client = std::mem::replace(&mut cable.has_client, count.is_some());
        let Some(count) = count else {
            if had_client {
                self.forget_client(cable, line);
            }
            return Vec::new();
        };
        if self.name.is_serial() {
            cable.follow_baud(line.baud().unwrap_or(BAUD));
        }
        match &mut cable.mismatch {
            Some(lines) => lines.hear(now_ns as f64, &bytes[..count]),
            None => bytes[..count].to_vec(),
        }
    }

    fn forget_client(&self, cable: &mut Cable, line: &dyn Line) {
        cable.waiting.clear();
        cable.mismatch = None;
        // One that was killed may have left it locked: nobody is there to miss the old one.
        if line.forget_client().is_err() && self.renew(cable).is_err() {
            self.folder.unlink(self.name);
            cable.line = None;
        }
    }

    /// Whether a client has yet to read what it was sent; waits up to `limit` for room.
    pub fn is_behind(&self, limit: Duration) -> bool {
        let line = {
            let cable = self.lock();
            if cable.waiting.is_empty() {
                return false;
            }
            cable.line.clone()
        };
        let Some(line) = line else { return false };
        line.wait_for_room(limit);
        true
    }
}

impl Cable {
    fn follow_baud(&mut self, baud: u32) {
        if baud == BAUD || baud == 0 {
            self.mismatch = None;
        } else if self
            .mismatch
            .as_ref()
            .is_none_or(|lines| lines.baud != baud)
        {
            self.mismatch = Some(Lines {
                baud,
                to_client: Mismatch::new(BAUD, baud),
                to_board: Mismatch::new(baud, BAUD),
                free_ns: 0.0,
            });
        }
    }

    fn take(&mut self, now_ns: u64, sent: &[TimedByte]) {
        let Some(lines) = &mut self.mismatch else {
            self.waiting.extend(sent.iter().map(|&(_, byte)| byte));
            return;
        };
        for &(ends_ns, byte) in sent {
            lines
                .to_client
                .send(ends_ns.saturating_sub(BYTE_NS) as f64, byte);
        }
        let known_ns = now_ns.saturating_sub(BYTE_NS) as f64;
        while let Some(byte) = lines.to_client.hear(known_ns) {
            self.waiting.push_back(byte);
        }
    }
}

impl Lines {
    fn hear(&mut self, now_ns: f64, bytes: &[u8]) -> Vec<u8> {
        for &byte in bytes {
            self.to_board.send(now_ns, byte);
            self.free_ns = self.free_ns.max(now_ns) + self.to_board.word_ns();
        }
        // The client's next word comes no sooner than that.
        let known_ns = self.free_ns.max(now_ns);
        std::iter::from_fn(|| self.to_board.hear(known_ns)).collect()
    }
}
