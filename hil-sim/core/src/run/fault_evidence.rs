//! What shows from outside that something is wrong.

use protocol::Role;

use crate::run::decoder::TimedMessage;

/// A reset of a board after its power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reset {
    /// Which board's.
    pub role: Role,
    /// When, in ns since the scene's start.
    pub at_ns: u64,
    /// Whether the scene cut its power.
    pub is_injected: bool,
}

/// All that a run shows of faults, beside the outputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaultEvidence {
    /// What the display sent to the sensor, and when: its bytes, not what arrived of them.
    pub display: Vec<TimedMessage>,
    /// What the sensor sent to the display.
    pub sensor: Vec<TimedMessage>,
    /// Resets of either board.
    pub resets: Vec<Reset>,
    /// When CLR fell, in ns since the scene's start.
    pub clears_ns: Vec<u64>,
}
