//! The word that everybody understands: [`Stop`], and the board's answer to it, [`Stopped`].
//!
//! Their payloads never change, so that any version stops any other:
//!
//! ```text
//! Stop     0x00 'S' 'T' 'O' 'P' reason: u8
//! Stopped  0x00 'H' 'A' 'L' 'T' cause: u8
//! ```
//!
//! They begin with the variant of [`crate::Hello`], which is frozen too, and whose 35 bytes nobody takes for
//! these six. Both are said to anybody, known or not, and are heard from anybody, whatever came before.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::safety::Trip;

/// Length of either payload, in bytes.
pub const STOP_LENGTH: usize = 6;

const STOP: [u8; 5] = *b"\0STOP";
const STOPPED: [u8; 5] = *b"\0HALT";

/// Why the boards are to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum StopReason {
    /// A person asked for it.
    Operator,
    /// A host program found something wrong.
    Host,
}

impl StopReason {
    /// The reason's byte in a [`Stop`]: that of the [`Trip`] that it leads to.
    pub const fn byte(self) -> u8 {
        match self {
            Self::Operator => 0,
            Self::Host => 1,
        }
    }

    /// The reason behind a [`Stop`]'s byte. One that only a later version knows is a host's: whatever the
    /// byte, it is a Stop.
    pub const fn from_byte(byte: u8) -> Self {
        match byte {
            0 => Self::Operator,
            _ => Self::Host,
        }
    }

    /// What a board that obeys is stopped by.
    pub const fn trip(self) -> Trip {
        match self {
            Self::Operator => Trip::Operator,
            Self::Host => Trip::Host,
        }
    }
}

/// Stops a board until its reset button or power: a display's outputs go to 0 V, a sensor's arm drive is
/// off. Who says it says it again until [`Stopped`] comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Stop {
    /// Why.
    pub reason: StopReason,
}

impl Stop {
    /// The payload of its frame.
    pub fn to_bytes(self) -> [u8; STOP_LENGTH] {
        payload(STOP, self.reason.byte())
    }

    /// Reads the payload of a frame. None if it is no Stop.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let reason = StopReason::from_byte(last(STOP, bytes)?);
        Some(Self { reason })
    }
}

/// A board's answer to every [`Stop`], on the port that it came by: its outputs are off, and stay so until
/// its reset button or power.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Stopped {
    /// What stopped the board first: the number of a [`Trip`].
    pub cause: u8,
}

impl Stopped {
    /// Stopped by `trip`.
    pub const fn by(trip: Trip) -> Self {
        Self { cause: trip as u8 }
    }

    /// What stopped the board; none if only a later version has such a cause.
    pub fn trip(self) -> Option<Trip> {
        Trip::ALL.get(usize::from(self.cause)).copied()
    }

    /// The payload of its frame.
    pub fn to_bytes(self) -> [u8; STOP_LENGTH] {
        payload(STOPPED, self.cause)
    }

    /// Reads the payload of a frame. None if it is no such answer.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let cause = last(STOPPED, bytes)?;
        Some(Self { cause })
    }
}

fn payload([a, b, c, d, e]: [u8; 5], last: u8) -> [u8; STOP_LENGTH] {
    [a, b, c, d, e, last]
}

/// What follows `word`, if that is a single byte.
fn last(word: [u8; 5], bytes: &[u8]) -> Option<u8> {
    match bytes.strip_prefix(&word)? {
        [last] => Some(*last),
        _ => None,
    }
}
