//! A pseudo-terminal that no program which a test starts gets hold of: its cable can be pulled.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, fcntl_setfl, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// How long a full line is waited for: a reader on a busy machine takes its time.
const FULL: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 50_000_000,
};

/// The end that a board has.
pub struct Near {
    file: File,
    patience: Timespec,
}

impl Near {
    /// A raw pseudo-terminal: the board's end, the other end, to be held open, and its name. The board
    /// waits no longer than `patience` for bytes.
    ///
    /// # Errors
    /// The system's.
    pub fn pair(patience: Duration) -> io::Result<(Self, OwnedFd, PathBuf)> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        // A line with room for some of the bytes takes some: whoever writes is never held for the rest.
        fcntl_setfl(&near, OFlags::RDWR | OFlags::NONBLOCK)?;
        let name = ptsname(&near, Vec::new())?;
        let path = PathBuf::from(name.to_str().map_err(io::Error::other)?);
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let far = open(&path, flags, Mode::empty())?;
        let mut settings = tcgetattr(&far)?;
        settings.make_raw();
        tcsetattr(&far, OptionalActions::Now, &settings)?;
        let patience = Timespec::try_from(patience).map_err(io::Error::other)?;
        let file = near.into();
        Ok((Self { file, patience }, far, path))
    }

    fn wait(&self, flags: PollFlags, limit: &Timespec) -> io::Result<()> {
        match poll(&mut [PollFd::new(&self.file, flags)], Some(limit))? {
            0 => Err(ErrorKind::TimedOut.into()),
            _ => Ok(()),
        }
    }
}

impl Read for Near {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.wait(PollFlags::IN, &self.patience)?;
        self.file.read(bytes)
    }
}

impl Write for Near {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.wait(PollFlags::OUT, &FULL)?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
