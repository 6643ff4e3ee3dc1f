//! Every counter of a board, sent once a second.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::safety::{DisplayState, Trip};

/// Why a board started last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetCause {
    /// Power came on, or fell too low.
    Power,
    /// The reset pin.
    Pin,
    /// The independent watchdog: the firmware had stopped, or panicked.
    Watchdog,
    /// The firmware asked for it.
    Software,
}

impl ResetCause {
    /// The cause in words, as used in messages to people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Power => "power",
            Self::Pin => "reset pin",
            Self::Watchdog => "watchdog",
            Self::Software => "software",
        }
    }
}

/// What one port has seen since the board's start. All counts wrap at 2³².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct PortCounters {
    /// Frames encoded to be sent.
    pub sent: u32,
    /// Frames not sent, because the port's queue was full.
    pub dropped: u32,
    /// Good frames, handed on.
    pub received: u32,
    /// Frames that never came: gaps in the sequence, less those that came late. A frame that came
    /// corrupt or overlong leaves a gap too.
    pub lost: u32,
    /// Frames whose CRC or COBS coding was wrong.
    pub corrupt: u32,
    /// Frames longer than the longest allowed.
    pub overlong: u32,
    /// Good frames that came after a frame sent later; they are not handled.
    pub late: u32,
    /// Good frames that came twice; the second is not handled.
    pub duplicated: u32,
    /// Frames with a right CRC whose content is no message of this version.
    pub malformed: u32,
    /// Frames from a peer of another protocol or schema; nothing but its Hello is read.
    pub foreign: u32,
    /// Frames from a peer that has not said [`crate::Hello`]; they are not read.
    pub unheralded: u32,
    /// Bytes lost because the receiver's DMA ring was overrun.
    pub overruns: u32,
    /// Noise and framing errors the UART reported.
    pub line_errors: u32,
}

impl PortCounters {
    /// All counts at 0.
    pub const fn new() -> Self {
        Self {
            sent: 0,
            dropped: 0,
            received: 0,
            lost: 0,
            corrupt: 0,
            overlong: 0,
            late: 0,
            duplicated: 0,
            malformed: 0,
            foreign: 0,
            unheralded: 0,
            overruns: 0,
            line_errors: 0,
        }
    }
}

/// What only a sensor board counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SensorCounters {
    /// Samples at 1 kHz since the start.
    pub samples: u32,
    /// Conversions lost by the ADC.
    pub adc_overruns: u32,
    /// Times the DMA ring was overrun, so that scans were lost.
    pub dma_overruns: u32,
    /// Samples that were not done when the next one was due.
    pub deadline_misses: u32,
    /// Estimates sent.
    pub estimates: u32,
    /// Motions that reached the arm's drive.
    pub motions: u32,
    /// What has stopped the arm's drive for good; none while it may follow.
    pub stopped: Option<Trip>,
}

impl SensorCounters {
    /// Nothing counted.
    pub const ZERO: Self = Self {
        samples: 0,
        adc_overruns: 0,
        dma_overruns: 0,
        deadline_misses: 0,
        estimates: 0,
        motions: 0,
        stopped: None,
    };
}

/// What only a display board counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DisplayCounters {
    /// Output ticks since the start, at the update rate in force: 2 or 4 kHz.
    pub ticks: u32,
    /// Ticks whose words were sent to the DACs (a tick that changes nothing sends nothing).
    pub updates: u32,
    /// Ticks that were not done when the next one was due.
    pub deadline_misses: u32,
    /// Valid estimates that the stimulus followed.
    pub estimates: u32,
    /// Estimates that were not used: older than one already seen, or out of range.
    pub refused_estimates: u32,
    /// Times that the stimulus faded out because the last estimate was too old.
    pub fades: u32,
    /// SPI transfers that failed.
    pub spi_errors: u32,
    /// Estimates that can't be true: jumping, or contradicting themselves.
    pub implausible: u32,
    /// Estimates that came faster than a sensor sends them, and were not used.
    pub flooded: u32,
    /// Times that the hand's encoder jumped further than a hand moves.
    pub encoder_jumps: u32,
    /// Times that the converters did not hold what was written to them, or raised their alarm.
    pub converter_faults: u32,
    /// Times that CLR fell by itself, because ticks were not served.
    pub clears: u32,
    /// Motions that found no room because the tasks behind the ports were held up.
    pub unheard: u32,
    /// Times that a state of the supervisor began.
    pub changes: u32,
    /// The supervisor's state now.
    pub state: DisplayState,
}

impl DisplayCounters {
    /// Nothing counted.
    pub const ZERO: Self = Self {
        ticks: 0,
        updates: 0,
        deadline_misses: 0,
        estimates: 0,
        refused_estimates: 0,
        fades: 0,
        spi_errors: 0,
        implausible: 0,
        flooded: 0,
        encoder_jumps: 0,
        converter_faults: 0,
        clears: 0,
        unheard: 0,
        changes: 0,
        state: DisplayState::Boot,
    };
}

/// The part of a [`Status`] that depends on the board's role.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum RoleCounters {
    /// Of a sensor board.
    Sensor(SensorCounters),
    /// Of a display board.
    Display(DisplayCounters),
}

/// Every counter of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Time since the board's start, in µs of its clock.
    pub uptime_us: u64,
    /// Why it started.
    pub reset: ResetCause,
    /// Watchdog resets since power came on.
    pub watchdog_resets: u32,
    /// The port towards the other board.
    pub peer: PortCounters,
    /// The console port.
    pub console: PortCounters,
    /// What the role counts.
    pub role: RoleCounters,
    /// The least room that the stack has ever had since the start, in bytes, as of four seconds ago at most; 0 where
    /// nobody knows: in the first four, and in a simulator without a processor.
    pub stack_free_bytes: u32,
}
