//! What is said on an open serial line: whole frames or nothing, without ever waiting.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Write};

use protocol::{Hello, MAX_FRAME, Message, Port, PortCounters, Role};

/// Speed of a console, 8N1.
pub const BAUD: u32 = 921_600;

/// Pings whose answers are still waited for.
const PINGS: usize = 64;

/// Why something was not said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum NotSent {
    #[error("the board is not there")]
    NotKnown,
    #[error("the line takes no bytes")]
    Stuck,
}

/// Frames that were not heard because the port changed hands between programs: among the counters of this end, and
/// no fault of the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Missed {
    /// Never came.
    pub lost: u32,
    /// Came without their beginning, or their end.
    pub corrupt: u32,
}

/// Tells what is missed at changes of hands from what the line loses.
#[derive(Default)]
pub struct Handovers {
    changes: u32,
    /// What had been counted before a change after which nothing has been understood yet.
    before: Option<PortCounters>,
    missed: Missed,
}

impl Handovers {
    /// The port has changed hands `changes` times, and no more than this had been counted before the last.
    pub fn begin(&mut self, changes: u32, counters: &PortCounters) {
        if std::mem::replace(&mut self.changes, changes) != changes && self.before.is_none() {
            self.before = Some(*counters);
        }
    }

    /// What has been missed so far, by what is counted now.
    pub fn missed(&mut self, counters: &PortCounters) -> Missed {
        if let Some(before) = self.before
            && counters.received != before.received
        {
            self.before = None;
            self.missed.lost += counters.lost.saturating_sub(before.lost);
            self.missed.corrupt += counters.corrupt.saturating_sub(before.corrupt);
        }
        self.missed
    }
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

    /// Says `message` now. A Stop is said to whoever is there: all versions understand it. Fails if nobody is there
    /// who would understand it, or the line is stuck.
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

    /// Writes what is to be said. What the line takes no byte of is dropped; a frame of which it has taken the
    /// beginning is ended as soon as it takes more. Fails if the line does not take all of it.
    pub fn flush(&mut self) -> Result<(), NotSent> {
        let mut bytes = std::mem::take(&mut self.rest);
        let begun = bytes.len();
        let mut part = [0; MAX_FRAME];
        while let count @ 1.. = self.port.take(&mut part) {
            bytes.extend_from_slice(&part[..count]);
        }
        let (taken, result) = write_some(&mut self.output, &bytes);
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
        result.map_err(|error| match error.kind() {
            ErrorKind::WouldBlock => NotSent::Stuck,
            // Unplugged: the reader finds out as well.
            _ => NotSent::NotKnown,
        })
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

/// Writes as many bytes as `output` takes at once, and says how many. Fails with [`ErrorKind::WouldBlock`] if those
/// are not all; else what broke the line.
pub fn write_some(output: &mut impl Write, bytes: &[u8]) -> (usize, io::Result<()>) {
    let mut taken = 0;
    while taken < bytes.len() {
        match output.write(&bytes[taken..]) {
            Ok(0) => return (taken, Err(ErrorKind::WouldBlock.into())),
            Ok(count) => taken += count,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return (taken, Err(error)),
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
                return Err(ErrorKind::WouldBlock.into());
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
    fn what_is_missed_at_a_change_of_hands_is_told_from_what_the_line_loses() {
        let counted = |received, lost, corrupt| PortCounters {
            received,
            lost,
            corrupt,
            ..PortCounters::new()
        };
        let mut handovers = Handovers::default();
        let mut missed = |changes, before: &PortCounters, after: &PortCounters| {
            handovers.begin(changes, before);
            let Missed { lost, corrupt } = handovers.missed(after);
            (lost, corrupt)
        };
        // The line's own.
        assert_eq!(missed(0, &counted(5, 1, 1), &counted(6, 3, 1)), (0, 0));
        // A guest is heir, then owner, before it understands anything: a torn frame, then one that is whole.
        assert_eq!(missed(1, &counted(6, 3, 1), &counted(6, 3, 1)), (0, 0));
        assert_eq!(missed(2, &counted(6, 3, 1), &counted(6, 3, 2)), (0, 0));
        assert_eq!(missed(2, &counted(6, 3, 2), &counted(7, 12, 2)), (9, 1));
        assert_eq!(missed(2, &counted(7, 12, 2), &counted(8, 13, 3)), (9, 1));
        assert_eq!(missed(3, &counted(8, 13, 3), &counted(9, 14, 3)), (10, 1));
    }

    #[test]
    fn a_line_takes_what_it_can_and_says_so() {
        let mut tty = Narrow(7, Vec::new());
        let (taken, result) = write_some(&mut tty, b"0123456789");
        let refused = result.map_err(|error| error.kind());
        assert_eq!((taken, refused), (7, Err(ErrorKind::WouldBlock)));
        assert_eq!(tty.1, b"0123456");
        let (taken, result) = write_some(&mut Narrow(9, Vec::new()), b"012");
        assert!(taken == 3 && result.is_ok());
    }
}
