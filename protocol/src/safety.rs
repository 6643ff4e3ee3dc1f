//! What the display board's safety supervisor says of itself.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Why the stimulus is on its way to 0 V, or kept there, for as long as the reason lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Hold {
    /// The last valid estimate is too old: the link, or the sensor, is silent or without an answer.
    Stale,
    /// Estimates that can't be true: out of range, not finite, jumping, or contradicting themselves.
    Distrust,
    /// More estimates than a sensor sends.
    Flood,
    /// The arm is said to move while the hand's encoder rests: one of the two does not tell the truth.
    Contradiction,
    /// The tasks that listen to the ports are held up, so that nobody would hear a Stop.
    Unheard,
    /// Full drive for longer than allowed: the hand has to rest first.
    FullDrive,
}

/// Why the stimulus was stopped for good: until the reset button or power.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Trip {
    /// [`crate::StopReason::Operator`]
    Operator,
    /// [`crate::StopReason::Host`]
    Host,
    /// The emergency-stop input opened.
    EmergencyStop,
    /// The hand's encoder jumped further than a hand moves.
    HandEncoder,
    /// A converter did not start, did not take its words, lost its settings, or raised its alarm.
    Converter,
    /// The words did not reach the converters in time, several times in a row.
    Transfer,
    /// What was to go out broke a limit of voltage, slew or energy.
    Limit,
    /// Memory that only changes on request has changed.
    Memory,
    /// The watchdog had to restart the board.
    Watchdog,
    /// The firmware panicked.
    Panic,
    /// The processor met a fault.
    Fault,
    /// The stack was full.
    StackOverflow,
}

/// The state of the supervisor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum DisplayState {
    /// The converters are being started and have not shown yet that they take words. 0 V.
    #[default]
    Boot,
    /// Everything is well, or will be as soon as there is a fresh estimate to be trusted. 0 V.
    Ready,
    /// The stimulus follows the hand.
    Driving,
    /// The stimulus is on its way to 0 V.
    Fading(Hold),
    /// 0 V for good.
    Stopped(Trip),
}

/// Tells of each change of the supervisor's state, within some milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Safety {
    /// When it changed, in µs of the display's clock.
    pub instant_us: u64,
    /// The state since then.
    pub state: DisplayState,
}
