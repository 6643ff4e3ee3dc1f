//! This computer's serial ports: opened for this program alone, and written to without ever waiting.

use std::fs::{self, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, ErrorKind, SerialPort, TTYPort};

use crate::line::BAUD;
use crate::state::State;
use crate::system::{Input, Opened};

/// Longest wait for bytes; also how late a Hello or a ping may be.
const READ_TIMEOUT: Duration = Duration::from_millis(20);

/// How long what was said last may take to leave a line that is closed.
const DRAIN: Duration = Duration::from_millis(40);

/// Opens a port for this program alone. Fails if it can't be: the state says why.
pub fn open(path: &Path) -> Result<Opened, State> {
    // A link that is put elsewhere between the two openings must not lead to two boards.
    let device = fs::canonicalize(path).map_err(|error| refused(path, &error))?;
    let kind = fs::metadata(&device)
        .map_err(|error| refused(path, &error))?
        .file_type();
    if !kind.is_char_device() {
        let what = if kind.is_dir() { "a folder" } else { "a file" };
        return Err(State::Failed(
            path.to_owned(),
            format!("is {what}, not a serial port"),
        ));
    }
    let mut tty = OpenOptions::new()
        .write(true)
        .custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY)
        .open(&device)
        .map_err(|error| refused(path, &error))?;
    let input = serialport::new(device.to_string_lossy(), BAUD)
        .timeout(READ_TIMEOUT)
        .open_native()
        .map_err(|error| refused_port(path, &error))?;
    // What a terminal may have left half said is over with it. A line that does not even take this is
    // found out later.
    let _ = tty.write(&[0]);
    Ok(Opened {
        input: Box::new(input),
        // Opened by itself so that it alone never blocks: a blocked write would hold up the reader.
        output: Box::new(tty),
    })
}

impl Input for TTYPort {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        Read::read(self, bytes)
    }

    /// For a line that is stuck the system would wait up to half a minute.
    fn close(self: Box<Self>, discards: bool) {
        let end = Instant::now() + DRAIN;
        let waits = || self.bytes_to_write().is_ok_and(|count| count > 0);
        while !discards && waits() && Instant::now() < end {
            thread::park_timeout(DRAIN / 20);
        }
        if discards || waits() {
            // Nothing can be done for a line that does not even allow this.
            let _ = self.clear(ClearBuffer::Output);
        }
    }
}

fn refused(path: &Path, error: &io::Error) -> State {
    let port = path.to_owned();
    match error.raw_os_error() {
        Some(libc::EBUSY) => State::Busy(port),
        Some(libc::EACCES | libc::EPERM) => State::Denied(port),
        // The last three: it has just been unplugged, and its name is still there.
        Some(libc::ENOENT | libc::ENXIO | libc::ENODEV | libc::EIO) => {
            State::Absent(port.display().to_string())
        }
        _ => State::Failed(port, format!("can't be opened: {error}")),
    }
}

fn refused_port(path: &Path, error: &serialport::Error) -> State {
    let port = path.to_owned();
    match error.kind() {
        ErrorKind::NoDevice => State::Busy(port),
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => State::Denied(port),
        ErrorKind::Io(io::ErrorKind::NotFound) => State::Absent(port.display().to_string()),
        _ => State::Failed(port, format!("can't be used as a serial port: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
