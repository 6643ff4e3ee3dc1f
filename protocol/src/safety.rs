//! What the display board's safety supervisor says of itself.

use core::fmt;

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

impl Hold {
    /// Every reason, in the wire's order.
    pub const ALL: [Self; 6] = [
        Self::Stale,
        Self::Distrust,
        Self::Flood,
        Self::Contradiction,
        Self::Unheard,
        Self::FullDrive,
    ];

    /// The reason in words, as used in messages to people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stale => "no fresh estimate",
            Self::Distrust => "estimates not to be trusted",
            Self::Flood => "too many estimates",
            Self::Contradiction => "the arm moves, the hand does not",
            Self::Unheard => "ports held up",
            Self::FullDrive => "full drive for too long",
        }
    }
}

/// Why the stimulus, or the arm, was stopped for good: until the reset button or power. The numbers never
/// change, since [`crate::Stopped`] carries them; new ones go to the end.
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
    /// The arm's encoder jumped further than an arm moves.
    ArmEncoder,
    /// The arm was told to move and did not: it is blocked, its drive is off, or its encoder is dead.
    ArmStall,
}

impl Trip {
    /// Every reason, in the wire's order.
    pub const ALL: [Self; 14] = [
        Self::Operator,
        Self::Host,
        Self::EmergencyStop,
        Self::HandEncoder,
        Self::Converter,
        Self::Transfer,
        Self::Limit,
        Self::Memory,
        Self::Watchdog,
        Self::Panic,
        Self::Fault,
        Self::StackOverflow,
        Self::ArmEncoder,
        Self::ArmStall,
    ];

    /// The reason in words, as used in messages to people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Operator => "by the operator",
            Self::Host => "by a host program",
            Self::EmergencyStop => "emergency stop",
            Self::HandEncoder => "hand encoder",
            Self::Converter => "converter",
            Self::Transfer => "transfer to the converters",
            Self::Limit => "limit broken",
            Self::Memory => "memory changed",
            Self::Watchdog => "watchdog",
            Self::Panic => "panic",
            Self::Fault => "processor fault",
            Self::StackOverflow => "stack full",
            Self::ArmEncoder => "arm encoder",
            Self::ArmStall => "arm stalled",
        }
    }
}

const _: () = assert!(Hold::ALL[Hold::ALL.len() - 1] as usize + 1 == Hold::ALL.len());
const _: () = assert!(Trip::ALL[Trip::ALL.len() - 1] as usize + 1 == Trip::ALL.len());

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

impl DisplayState {
    /// The state in a word, without the reason for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Boot => "starting",
            Self::Ready => "ready",
            Self::Driving => "driving",
            Self::Fading(_) => "fading",
            Self::Stopped(_) => "stopped",
        }
    }

    /// The reason for the state in words, if it has one.
    pub const fn reason(self) -> Option<&'static str> {
        match self {
            Self::Boot | Self::Ready | Self::Driving => None,
            Self::Fading(hold) => Some(hold.name()),
            Self::Stopped(trip) => Some(trip.name()),
        }
    }
}

/// The state in words, with the reason for it: "stopped: emergency stop".
impl fmt::Display for DisplayState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        if let Some(reason) = self.reason() {
            f.write_str(": ")?;
            f.write_str(reason)?;
        }
        Ok(())
    }
}

/// What the sensor board does with the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ArmState {
    /// It stands still: no motion of the hand has come for 100 ms.
    #[default]
    Resting,
    /// It follows the hand.
    Following,
    /// Its drive is off for good.
    Stopped(Trip),
}

impl ArmState {
    /// The state in a word, without the reason for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Resting => "resting",
            Self::Following => "following",
            Self::Stopped(_) => "stopped",
        }
    }

    /// What stopped it, if it is stopped.
    pub const fn trip(self) -> Option<Trip> {
        match self {
            Self::Stopped(trip) => Some(trip),
            Self::Resting | Self::Following => None,
        }
    }
}

/// The state in words, with the reason for it: "stopped: by the operator".
impl fmt::Display for ArmState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self.trip() {
            Some(trip) => write!(f, ": {}", trip.name()),
            None => Ok(()),
        }
    }
}

/// Tells of each change of what the arm does, within some milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Arm {
    /// When it changed, in µs of the sensor's clock.
    pub instant_us: u64,
    /// The state since then.
    pub state: ArmState,
}

/// Tells of each change of the supervisor's state, within some milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Safety {
    /// When it changed, in µs of the display's clock.
    pub instant_us: u64,
    /// The state since then.
    pub state: DisplayState,
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;

    #[test]
    fn a_state_says_what_it_is_and_why() {
        for (state, words) in [
            (DisplayState::Boot, "starting"),
            (DisplayState::Ready, "ready"),
            (DisplayState::Driving, "driving"),
            (
                DisplayState::Fading(Hold::Stale),
                "fading: no fresh estimate",
            ),
            (
                DisplayState::Stopped(Trip::EmergencyStop),
                "stopped: emergency stop",
            ),
            (
                DisplayState::Stopped(Trip::Operator),
                "stopped: by the operator",
            ),
        ] {
            assert_eq!(state.to_string(), words);
        }
        for (state, words) in [
            (ArmState::Following, "following"),
            (
                ArmState::Stopped(Trip::Operator),
                "stopped: by the operator",
            ),
        ] {
            assert_eq!(state.to_string(), words);
        }
    }

    #[test]
    fn the_lists_are_in_the_wires_order_and_leave_nothing_out() {
        for (number, hold) in Hold::ALL.into_iter().enumerate() {
            assert_eq!(hold as usize, number);
        }
        for (number, trip) in Trip::ALL.into_iter().enumerate() {
            assert_eq!(trip as usize, number);
        }
    }
}
