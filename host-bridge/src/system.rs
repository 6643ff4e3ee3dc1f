//! What links live on: a clock and serial ports, the computer's own or a test's.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::clock::Clock;
use crate::place::Place;
use crate::state::State;

/// A clock and serial ports.
#[derive(Clone)]
pub struct System {
    /// What time it is.
    pub clock: Arc<dyn Clock>,
    /// The serial ports.
    pub ports: Arc<dyn Ports>,
}

/// Serial ports.
pub trait Ports: Send + Sync {
    /// The ports to try for a board at `place`, in order; empty if there is none at the moment.
    fn candidates(&self, place: &Place) -> Vec<PathBuf>;

    /// Whether this program has `port` open.
    fn is_open(&self, port: &Path) -> bool;

    /// Opens `port` for this program alone. Fails if it can't be: the state says why.
    fn open(&self, port: &Path) -> Result<Opened, State>;
}

/// An open port. Both halves are to be dropped to close it.
pub struct Opened {
    /// Where bytes come from.
    pub input: Box<dyn Input>,
    /// Where bytes go; it never blocks, and says [`io::ErrorKind::WouldBlock`] instead.
    pub output: Box<dyn Write + Send>,
}

/// Where a port's bytes come from.
pub trait Input: Send {
    /// Reads what has come; waits 20 ms for it at the longest, and then says [`io::ErrorKind::TimedOut`]. Fails if
    /// nothing came, or nothing will: the port is gone.
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize>;

    /// How often the port has changed hands between programs since it was opened: some of what the board said
    /// then is missing.
    fn changes(&self) -> u32 {
        0
    }

    /// Closes the port. What was written last, maybe a Stop, has a moment to leave, unless `discards`.
    fn close(self: Box<Self>, discards: bool);
}
