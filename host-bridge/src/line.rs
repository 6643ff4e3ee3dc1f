//! What is said on an open serial line: whole frames or nothing, without ever waiting.

use std::collections::VecDeque;
use std::io::{self, Write};

use protocol::{Hello, MAX_FRAME, Message, Port, PortCounters, Role};

/// Speed of a console, 8N1.
pub const BAUD: u32 = 921_600;

/// Pings whose answers are still waited for.
const PINGS: usize = 64;

/// Why something was not said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotSent {
    /// Nobody is there who would understand it.
    #[error("the board is not there")]
    NotKnown,
    /// The line does not take bytes now. A part of it may have been taken: then it is still said, late.
    #[error("the line takes no bytes")]
    Stuck,
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

/// What is said on an open line.
pub struct Line {
    /// The protocol's end of it.
    pub port: Box<Port>,
    /// Whether the other end is who is wanted, and understands.
    pub is_known: bool,
    output: Box<dyn Write + Send>,
    /// What is left of a frame of which the line has taken the beginning.
    rest: Vec<u8>,
    /// Frames that the line did not take.
    refused: u32,
    /// The last pings that were sent, by their instants.
    pings_us: VecDeque<u64>,
}

impl Line {
    /// A line on which nothing has been said yet, and nobody is known.
    pub fn new(output: Box<dyn Write + Send>) -> Self {
        Self {
            port: Box::new(Port::new(host_hello())),
            is_known: false,
            output,
            rest: Vec::new(),
            refused: 0,
            pings_us: VecDeque::with_capacity(PINGS),
        }
    }

    /// Says `message` now. A Stop is said to whoever is there: all versions understand it.
    ///
    /// # Errors
    /// If nobody is there who would understand it, or the line is stuck.
    pub fn say(&mut self, message: &Message) -> Result<(), NotSent> {
        if !self.is_known && !matches!(message, Message::Stop(_)) {
            return Err(NotSent::NotKnown);
        }
        self.queue(message);
        self.flush()
    }

    /// Queues `message`, whoever is there; [`Line::flush`] writes it.
    pub fn queue(&mut self, message: &Message) {
        if let Message::Ping(ping) = message {
            self.pings_us.truncate(PINGS - 1);
            self.pings_us.push_front(ping.sent_us);
        }
        self.port.post(message);
    }

    /// Whether a pong that returns `sent_us` answers a ping of this line's: other programs may share the port,
    /// and go by other clocks.
    pub fn is_answer(&self, sent_us: u64) -> bool {
        self.pings_us.contains(&sent_us)
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
        let (taken, result) = write(&mut self.output, &bytes);
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
}
