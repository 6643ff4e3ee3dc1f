//! A pseudo-terminal whose far end is opened and closed as a serial port is.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;
use std::{io, str};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{
    OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr,
};

use super::surroundings::Line;

/// The near end. Nothing here waits, and nothing holds the far end open: that the last of those who had
/// it has closed it is to be seen.
#[derive(Debug)]
pub struct Pty {
    near: File,
    path: PathBuf,
}

impl Pty {
    /// A new one, raw, set to `baud`, with nobody at its far end.
    ///
    /// # Errors
    /// What the system says: it may have no more of them.
    pub fn new(baud: u32) -> io::Result<Self> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let flags = rustix::fs::fcntl_getfl(&near)?;
        rustix::fs::fcntl_setfl(&near, flags | OFlags::NONBLOCK)?;
        let path = ptsname(&near, Vec::new())?;
        let path = str::from_utf8(path.as_bytes()).map_err(io::Error::other)?;
        let pty = Self {
            near: near.into(),
            path: path.into(),
        };
        let far = pty.open_far()?;
        let mut settings = tcgetattr(&far)?;
        settings.make_raw();
        settings.set_speed(baud)?;
        tcsetattr(&far, OptionalActions::Now, &settings)?;
        Ok(pty)
    }

    fn open_far(&self) -> io::Result<OwnedFd> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        Ok(rustix::fs::open(&self.path, flags, Mode::empty())?)
    }
}

impl Line for Pty {
    fn path(&self) -> &Path {
        &self.path
    }

    fn read(&self, bytes: &mut [u8]) -> io::Result<Option<usize>> {
        match (&self.near).read(bytes) {
            Ok(count) => Ok(Some(count)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(Some(0)),
            Err(error) if error.raw_os_error() == Some(Errno::IO.raw_os_error()) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        match (&self.near).write(bytes) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(0),
            written => written,
        }
    }

    fn baud(&self) -> io::Result<u32> {
        Ok(tcgetattr(&self.near)?.output_speed())
    }

    fn forget_client(&self) -> io::Result<()> {
        let far = self.open_far()?;
        ioctl_tiocnxcl(&far)?;
        tcflush(&far, QueueSelector::IFlush)?;
        Ok(())
    }

    fn wait_for_room(&self, limit: Duration) {
        let limit = Timespec::try_from(limit).unwrap_or_default();
        let mut room = [PollFd::new(&self.near, PollFlags::OUT)];
        // What it says is found out by trying.
        let _ = poll(&mut room, Some(&limit));
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    const BAUD: u32 = 921_600;

    fn client(pty: &Pty) -> OwnedFd {
        pty.open_far().unwrap()
    }

    /// The system hands bytes on when it comes to it.
    fn wait_for(mut condition: impl FnMut() -> bool) {
        let begun = Instant::now();
        while !condition() {
            assert!(begun.elapsed() < Duration::from_secs(60), "not in a minute");
        }
    }

    #[test]
    fn bytes_go_both_ways_as_they_are_and_a_client_s_going_shows() {
        let pty = Pty::new(BAUD).unwrap();
        let mut bytes = [0; 300];
        assert_eq!(pty.read(&mut bytes).unwrap(), None);
        let all: Vec<u8> = (0..=255).collect();
        for _ in 0..2 {
            let far = client(&pty);
            assert_eq!(pty.read(&mut bytes).unwrap(), Some(0));
            assert_eq!(pty.write(&all).unwrap(), 256);
            let mut taken = [0; 256];
            let mut count = 0;
            wait_for(|| {
                match rustix::io::read(&far, &mut taken[count..]) {
                    Err(Errno::AGAIN) => {}
                    more => count += more.unwrap(),
                }
                count == 256
            });
            assert_eq!(taken[..], all[..]);
            assert_eq!(rustix::io::write(&far, &all), Ok(256));
            drop(far);
            // What a client wrote before it went is still had.
            let mut count = 0;
            wait_for(|| match pty.read(&mut bytes[count..]).unwrap() {
                Some(more) => {
                    count += more;
                    false
                }
                None => true,
            });
            assert_eq!(bytes[..count], all[..]);
        }
    }

    #[test]
    fn the_next_client_gets_nothing_of_what_the_last_one_left_unread() {
        let pty = Pty::new(BAUD).unwrap();
        let far = client(&pty);
        rustix::termios::ioctl_tiocexcl(&far).unwrap();
        pty.write(b"stale").unwrap();
        // Seen to have arrived, so that there is something to forget.
        wait_for(|| rustix::io::ioctl_fionread(&far).unwrap() == 5);
        drop(far);
        assert_eq!(pty.read(&mut [0]).unwrap(), None);
        if pty.forget_client().is_ok() {
            let far = client(&pty);
            assert_eq!(rustix::io::ioctl_fionread(&far).unwrap(), 0);
        }
    }

    #[test]
    fn the_client_s_baud_rate_shows_even_one_without_a_name_of_its_own() {
        let pty = Pty::new(BAUD).unwrap();
        assert_eq!(pty.baud().unwrap(), BAUD);
        let far = client(&pty);
        for baud in [115_200, 460_800, 250_000] {
            let mut settings = tcgetattr(&far).unwrap();
            settings.set_speed(baud).unwrap();
            tcsetattr(&far, OptionalActions::Now, &settings).unwrap();
            assert_eq!(pty.baud().unwrap(), baud);
        }
    }
}
