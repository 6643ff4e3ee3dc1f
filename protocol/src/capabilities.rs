//! What a board can do: the exchange of capabilities of IEEE 1918.1.1, so that a host need not know.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::refusal::{Refusal, Setting};

/// What a host wants to know of a board. Changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Question {
    /// What is in force: answered by [`crate::Message::Configuration`].
    Configuration,
    /// What the board can do: answered by [`crate::Message::Capabilities`].
    Capabilities,
}

/// The range of a setting that is a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SettingRange {
    /// The setting, in its own unit.
    pub setting: Setting,
    /// The lowest value that is taken.
    pub low: u32,
    /// The highest value that is taken.
    pub high: u32,
    /// Whether 0 is taken too.
    pub or_zero: bool,
}

impl SettingRange {
    /// From `low` to `high`.
    pub(crate) const fn new(setting: Setting, low: u32, high: u32) -> Self {
        Self {
            setting,
            low,
            high,
            or_zero: false,
        }
    }

    /// The same, and 0.
    pub(crate) const fn or_zero(mut self) -> Self {
        self.or_zero = true;
        self
    }

    /// Checks `value`.
    ///
    /// # Errors
    /// If it is outside of the range.
    pub fn check(&self, value: u32) -> Result<(), Refusal> {
        if (self.low..=self.high).contains(&value) || (self.or_zero && value == 0) {
            Ok(())
        } else {
            Err(Refusal {
                setting: self.setting,
                index: 0,
                low: self.low.into(),
                high: self.high.into(),
            })
        }
    }
}

/// What a sensor board can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SensorCapabilities {
    /// Strain gauges.
    pub gauges: u8,
    /// Channels of a sample: the gauges, then the tangential force.
    pub channels: u8,
    /// Scans of all channels in a second.
    pub scan_rate_hz: u16,
    /// Samples in a second.
    pub sample_rate_hz: u16,
    /// Estimates in a second.
    pub estimate_rate_hz: u16,
    /// The voltage of a sample's highest code, in mV; the lowest is 0 V.
    pub full_scale_mv: u16,
    /// Travel of the arm to a count of its encoder, in µm.
    pub count_um: u16,
    /// The shortest wavelength that is stood by, in µm.
    pub shortest_um: u16,
    /// The longest wavelength that is stood by, in µm.
    pub longest_um: u16,
    /// Methods of estimation: each number below it is a [`crate::Method`]'s.
    pub methods: u8,
    /// The longest time that [`crate::StreamGauges`] asks for, in ms; what asks for more gets this.
    pub stream_ms: u16,
    /// The ranges of all settings that are numbers.
    pub ranges: [SettingRange; 8],
}

/// What a display board can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DisplayCapabilities {
    /// Actuators.
    pub actuators: u8,
    /// Distance between neighbours of the grid that the board starts with, in µm.
    pub pitch_um: u16,
    /// The furthest that an actuator may be described from the fingertip's middle, along either axis, in µm.
    pub furthest_um: u16,
    /// Ways for the actuators to share the stimulus: each number below it is a [`crate::Mode`]'s.
    pub modes: u8,
    /// How much of the surface can be played: each number below it is a [`crate::Rendering`]'s.
    pub renderings: u8,
    /// New voltages in a second: one for each [`crate::UpdateRate`].
    pub update_rates_hz: [u16; 2],
    /// Motions in a second.
    pub motion_rate_hz: u16,
    /// Travel of the hand to a count of its encoder, in µm.
    pub count_um: u16,
    /// The largest voltage of an actuator, either way, in mV.
    pub full_scale_mv: u16,
    /// The steepest voltage, in mV/ms.
    pub slew_mv_per_ms: u16,
    /// The largest mean square of an actuator's voltage, in V².
    pub energy_v2: u16,
    /// The largest mean of an actuator's voltage, either way, in mV.
    pub standing_mv: u16,
    /// The ranges of all settings that are numbers.
    pub ranges: [SettingRange; 8],
}

/// What a board can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Capabilities {
    /// Of a sensor board.
    Sensor(SensorCapabilities),
    /// Of a display board.
    Display(DisplayCapabilities),
}

impl Capabilities {
    /// The ranges of all settings that are numbers.
    pub const fn ranges(&self) -> &[SettingRange] {
        match self {
            Self::Sensor(sensor) => &sensor.ranges,
            Self::Display(display) => &display.ranges,
        }
    }
}
