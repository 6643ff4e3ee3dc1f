//! An open serial line: opened for this program alone, and written to without ever waiting for it.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use protocol::{MAX_FRAME, Message, Port, PortCounters};
use serialport::{ClearBuffer, ErrorKind, SerialPort, TTYPort};

use crate::link::{BAUD, NotSent, host_hello};
use crate::state::State;

/// Longest wait for bytes; also how late a Hello or a ping may be.
const READ_TIMEOUT: Duration = Duration::from_millis(20);

/// How long what was said last may take to leave a line that is closed.
const DRAIN: Duration = Duration::from_millis(40);

/// The ports that lines of this program have open.
static HELD: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Whether a line of this program has `port` open.
pub fn is_held(port: &Path) -> bool {
    HELD.lock()
        .unwrap_or_else(PoisonError::into_inner)
        .contains(port)
}

/// The ear of an open line.
pub struct Ear {
    /// Where bytes come from: a read ends after at most 20 ms.
    pub tty: TTYPort,
}

/// The mouth of an open line.
pub struct Line {
    /// The protocol's end of it.
    pub port: Box<Port>,
    /// Whether the other end is who is wanted, and understands.
    pub is_known: bool,
    path: PathBuf,
    /// Opened by itself so that it alone never blocks: a blocked write would hold up the reader.
    tty: File,
    /// What is left of a frame of which the line has taken the beginning.
    rest: Vec<u8>,
    /// Frames that the line did not take.
    refused: u32,
}

/// Opens `path` for this program alone.
///
/// # Errors
/// If it can't be: the state says why.
pub fn open(path: &Path) -> Result<(Ear, Line), State> {
    // A link that is put elsewhere between the two openings must not lead to two boards.
    let device = fs::canonicalize(path).map_err(|error| refused(path, &error))?;
    let kind = fs::metadata(&device)
        .map_err(|error| refused(path, &error))?
        .file_type();
    if !kind.is_char_device() {
        let what = if kind.is_dir() { "a folder" } else { "a file" };
        return Err(State::Failed {
            port: path.to_owned(),
            reason: format!("is {what}, not a serial port"),
        });
    }
    let mut tty = OpenOptions::new()
        .write(true)
        .custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY)
        .open(&device)
        .map_err(|error| refused(path, &error))?;
    let ear = serialport::new(device.to_string_lossy(), BAUD)
        .timeout(READ_TIMEOUT)
        .open_native()
        .map_err(|error| refused_port(path, &error))?;
    // What a terminal may have left half said is over with it. A line that does not even take this is
    // found out later.
    let _ = tty.write(&[0]);
    HELD.lock()
        .unwrap_or_else(PoisonError::into_inner)
        .insert(path.to_owned());
    let line = Line {
        port: Box::new(Port::new(host_hello())),
        is_known: false,
        path: path.to_owned(),
        tty,
        rest: Vec::new(),
        refused: 0,
    };
    Ok((Ear { tty: ear }, line))
}

impl Line {
    /// Says `message` now.
    ///
    /// # Errors
    /// If nobody is there who would understand it, or the line is stuck.
    pub fn say(&mut self, message: &Message) -> Result<(), NotSent> {
        if !self.is_known {
            return Err(NotSent::NotKnown);
        }
        self.port.post(message);
        self.flush()
    }

    /// Writes what is to be said. What the line takes no byte of is dropped; a frame of which it has taken
    /// the beginning is ended as soon as it takes more.
    ///
    /// # Errors
    /// If the line does not take all of it.
    pub fn flush(&mut self) -> Result<(), NotSent> {
        let mut bytes = std::mem::take(&mut self.rest);
        let begun = bytes.len();
        let mut part = [0; MAX_FRAME];
        while let count @ 1.. = self.port.take(&mut part) {
            bytes.extend_from_slice(&part[..count]);
        }
        let (taken, result) = write(&mut self.tty, &bytes);
        let left = &bytes[taken..];
        let is_within_frame = taken < begun || (taken > 0 && bytes[taken - 1] != 0);
        let kept = match left.iter().position(|&byte| byte == 0) {
            Some(end) if is_within_frame => end + 1,
            _ => 0,
        };
        let frames = left[kept..].iter().filter(|&&byte| byte == 0).count();
        self.refused = self
            .refused
            .wrapping_add(u32::try_from(frames).unwrap_or(u32::MAX));
        bytes.truncate(taken + kept);
        bytes.drain(..taken);
        self.rest = bytes;
        result
    }

    /// What this end of the line has counted.
    pub fn counters(&self) -> PortCounters {
        let counters = self.port.counters();
        PortCounters {
            dropped: counters.dropped.wrapping_add(self.refused),
            ..counters
        }
    }

    /// Whether the line has taken only a part of what was written.
    pub fn is_stuck(&self) -> bool {
        !self.rest.is_empty()
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        HELD.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .remove(&self.path);
    }
}

impl Ear {
    /// Closes the line. What was said last, maybe a Stop, has [`DRAIN`] to leave; for a stuck line the
    /// system would wait up to half a minute, so its bytes are thrown away.
    pub fn close(self, stuck: bool) {
        let end = Instant::now() + DRAIN;
        let waits = || self.tty.bytes_to_write().is_ok_and(|count| count > 0);
        while !stuck && waits() && Instant::now() < end {
            thread::park_timeout(DRAIN / 20);
        }
        if stuck || waits() {
            // Nothing can be done for a line that does not even allow this.
            let _ = self.tty.clear(ClearBuffer::Output);
        }
    }
}

/// Writes as many bytes as are taken at once.
fn write(tty: &mut impl Write, bytes: &[u8]) -> (usize, Result<(), NotSent>) {
    let mut taken = 0;
    while taken < bytes.len() {
        match tty.write(&bytes[taken..]) {
            Ok(0) => return (taken, Err(NotSent::Stuck)),
            Ok(count) => taken += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                return (taken, Err(NotSent::Stuck));
            }
            // Unplugged: the reader finds out as well.
            Err(_) => return (taken, Err(NotSent::NotKnown)),
        }
    }
    (taken, Ok(()))
}

fn refused(path: &Path, error: &io::Error) -> State {
    let port = path.to_owned();
    match error.raw_os_error() {
        Some(libc::EBUSY) => State::Busy { port },
        Some(libc::EACCES | libc::EPERM) => State::Denied { port },
        // The last three: it has just been unplugged, and its name is still there.
        Some(libc::ENOENT | libc::ENXIO | libc::ENODEV | libc::EIO) => State::Absent {
            place: port.display().to_string(),
        },
        _ => State::Failed {
            port,
            reason: format!("can't be opened: {error}"),
        },
    }
}

fn refused_port(path: &Path, error: &serialport::Error) -> State {
    let port = path.to_owned();
    match error.kind() {
        ErrorKind::NoDevice => State::Busy { port },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => State::Denied { port },
        ErrorKind::Io(io::ErrorKind::NotFound) => State::Absent {
            place: port.display().to_string(),
        },
        _ => State::Failed {
            port,
            reason: format!("can't be used as a serial port: {error}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes so many bytes, then would block.
    struct Narrow(usize, Vec<u8>);

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.0 == 0 {
                return Err(io::ErrorKind::WouldBlock.into());
            }
            let count = bytes.len().min(self.0).min(3);
            self.0 -= count;
            self.1.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_line_takes_what_it_can_and_says_so() {
        let mut tty = Narrow(7, Vec::new());
        assert_eq!(write(&mut tty, b"0123456789"), (7, Err(NotSent::Stuck)));
        assert_eq!(tty.1, b"0123456");
        assert_eq!(write(&mut Narrow(9, Vec::new()), b"012"), (3, Ok(())));
    }

    #[test]
    fn the_systems_reasons_are_told_apart() {
        let word = |code| refused(Path::new("/dev/x"), &io::Error::from_raw_os_error(code)).word();
        assert_eq!(word(libc::EBUSY), "busy");
        assert_eq!(word(libc::EACCES), "denied");
        assert_eq!(word(libc::EPERM), "denied");
        assert_eq!(word(libc::ENOENT), "absent");
        assert_eq!(word(libc::ENXIO), "absent");
        assert_eq!(word(libc::EIO), "absent");
        assert_eq!(word(libc::EMFILE), "failed");
    }

    #[test]
    fn what_is_no_terminal_is_refused_by_what_it_is() {
        let said = |path: &Path| open(path).map(|_| ()).expect_err("no terminal").to_string();
        assert_eq!(
            said(&std::env::temp_dir()),
            format!(
                "{}: is a folder, not a serial port",
                std::env::temp_dir().display()
            )
        );
        let file = std::env::current_exe().expect("a test is a file");
        assert_eq!(
            said(&file),
            format!("{}: is a file, not a serial port", file.display())
        );
        let null = said(Path::new("/dev/null"));
        assert!(
            null.starts_with("/dev/null: can't be used as a serial port: "),
            "{null}"
        );
        assert_eq!(said(Path::new("/dev/no-such")), "/dev/no-such: not there");
    }
}
