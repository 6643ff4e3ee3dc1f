//! What can be set on a board over the link, as a whole, checked before it is taken.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::actuators::{self, DEFAULT_ACTUATORS};
use crate::checksum::CRC_32;
use crate::refusal::{Refusal, Setting};

/// How λ is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Method {
    /// The wavenumber of the line that stays put in the gauges' spectrum over the arm's travel.
    #[default]
    Spectrum,
    /// The paper's count of zero crossings in a fixed window, equations (1), (2) and (5).
    Counting,
    /// The same in the window that equation (11) asks for at the hand's present frequency.
    AdaptedCounting,
    /// Zero crossings timed between samples, their spacing taken in position.
    Crossings,
}

/// The sensor board's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SensorConfiguration {
    /// How λ is estimated.
    pub method: Method,
    /// The counting window A in ms, 10 to 200; the paper's is 80.
    pub window_ms: u16,
    /// The gauge whose crossings are counted, 0 to 4.
    pub counted_gauge: u8,
    /// Bit g set: gauge g may take part in the estimate, 1 to 31.
    pub gauges: u8,
    /// The longest fit of [`Method::Spectrum`], in wavelengths of travel, 2 to 8: the knob between
    /// accuracy and latency.
    pub waves: u8,
    /// An estimate of [`Method::Spectrum`] is stood by when its [`crate::Estimate::confidence`], the
    /// probability that it is within 5 %, is at least this many percent, 50 to 99.
    pub valid_percent: u8,
    /// Whether the sixth channel carries the tangential force.
    pub force_channel: bool,
    /// Scale of the force channel in mN/V, 1 to 60 000; mid-rail is no force.
    pub force_mn_per_v: u16,
    /// Shear stiffness k of the fingertip in N/m, 10 to 60 000; 0 to estimate it.
    pub stiffness_n_per_m: u16,
    /// Whether [`crate::Gauges`] blocks are sent.
    pub stream_gauges: bool,
    /// The arm's speed in µm/s at full PWM duty, 1 000 to 2 000 000.
    pub arm_full_scale_um_s: u32,
}

impl SensorConfiguration {
    /// What a board starts with: safe, and the paper's numbers where it gives some.
    pub const DEFAULT: Self = Self {
        method: Method::Spectrum,
        window_ms: 80,
        counted_gauge: 2,
        gauges: 0b11111,
        waves: 8,
        valid_percent: 60,
        force_channel: false,
        force_mn_per_v: 1_000,
        stiffness_n_per_m: 400,
        stream_gauges: false,
        arm_full_scale_um_s: 200_000,
    };
}

impl Default for SensorConfiguration {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// How the fifty actuators share the stimulus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Mode {
    /// All in phase, as in the paper.
    #[default]
    Uniform,
    /// Each at the phase of its place, 2π xᵢ/λ ahead: the pattern moves over the skin.
    Travelling,
}

/// How often the actuators get new voltages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum UpdateRate {
    /// Ten times a cycle of 200 Hz.
    #[default]
    Hz2000,
    /// Twenty times.
    Hz4000,
}

impl UpdateRate {
    /// Updates per second.
    pub const fn hz(self) -> u32 {
        match self {
            Self::Hz2000 => 2_000,
            Self::Hz4000 => 4_000,
        }
    }
}

/// The display board's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DisplayConfiguration {
    /// How the actuators share the stimulus.
    pub mode: Mode,
    /// How often they get new voltages.
    pub update_rate: UpdateRate,
    /// Age of the last valid estimate, in ms, at which the stimulus fades out, 20 to 5 000.
    pub max_age_ms: u16,
    /// Time from 0 to full stimulus, in ms, 1 to 1 000.
    pub fade_in_ms: u16,
    /// Time from full stimulus to 0, in ms, 1 to 1 000.
    pub fade_out_ms: u16,
    /// Time in which the wavenumber 1/λ glides to that of a new estimate, in ms, 0 to 500.
    pub glide_ms: u16,
    /// The stimulus' amplitude in mV, 0 to 5 000; the paper's is 5 000 (equation (12)).
    pub amplitude_mv: u16,
    /// The surface's amplitude ([`crate::Estimate::amplitude_lsb`]) that is played at `amplitude_mv`, in
    /// ADC steps, 1 to 2 000; weaker surfaces are played weaker in proportion. 0: all surfaces alike.
    pub reference_lsb: u16,
    /// Longest time in s that the hand may rub without a rest, 10 to 3 600.
    pub full_drive_s: u16,
    /// [`crate::actuators::hash`] of the actuators' description: that of the one in force, or of the
    /// one that [`crate::Message::Actuators`] have sent.
    pub actuators: u32,
}

impl DisplayConfiguration {
    /// What a board starts with: safe, and the paper's numbers where it gives some.
    pub const DEFAULT: Self = Self {
        mode: Mode::Uniform,
        update_rate: UpdateRate::Hz2000,
        max_age_ms: 500,
        fade_in_ms: 20,
        fade_out_ms: 50,
        glide_ms: 20,
        amplitude_mv: 5_000,
        reference_lsb: 0,
        full_drive_s: 600,
        actuators: actuators::hash(&DEFAULT_ACTUATORS),
    };
}

impl Default for DisplayConfiguration {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A configuration, for the board whose role it names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Configuration {
    /// For the sensor board.
    Sensor(SensorConfiguration),
    /// For the display board.
    Display(DisplayConfiguration),
}

impl Configuration {
    /// Names a configuration: the CRC-32 over its postcard bytes.
    pub fn hash(&self) -> u32 {
        let mut bytes = [0; size_of::<Self>() * 2];
        // Postcard takes less than twice what memory does, so nothing is cut off.
        let bytes = postcard::to_slice(self, &mut bytes).unwrap_or_default();
        CRC_32.checksum(bytes)
    }
}

/// A board's answer to [`crate::Message::Configure`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ConfigurationReport {
    /// None if the configuration asked for is now in force; else the first setting that was out of
    /// its range, and nothing was changed.
    pub refused: Option<Refusal>,
    /// [`Configuration::hash`] of the configuration in force.
    pub hash: u32,
    /// The configuration in force.
    pub configuration: Configuration,
}

impl SensorConfiguration {
    /// Checks every range; the first setting outside of its own is the error.
    pub fn check(&self) -> Result<(), Refusal> {
        within(self.window_ms.into(), 10, 200, Setting::WindowMs)?;
        within(self.counted_gauge.into(), 0, 4, Setting::CountedGauge)?;
        within(self.gauges.into(), 1, 31, Setting::Gauges)?;
        within(self.waves.into(), 2, 8, Setting::Waves)?;
        within(self.valid_percent.into(), 50, 99, Setting::ValidPercent)?;
        within(self.force_mn_per_v.into(), 1, 60_000, Setting::ForceScale)?;
        if self.stiffness_n_per_m != 0 {
            within(
                self.stiffness_n_per_m.into(),
                10,
                60_000,
                Setting::Stiffness,
            )?;
        }
        within(
            self.arm_full_scale_um_s,
            1_000,
            2_000_000,
            Setting::ArmFullScale,
        )
    }
}

impl DisplayConfiguration {
    /// Checks every range; the first setting outside of its own is the error.
    pub fn check(&self) -> Result<(), Refusal> {
        within(self.max_age_ms.into(), 20, 5_000, Setting::MaxAgeMs)?;
        within(self.fade_in_ms.into(), 1, 1_000, Setting::FadeInMs)?;
        within(self.fade_out_ms.into(), 1, 1_000, Setting::FadeOutMs)?;
        within(self.glide_ms.into(), 0, 500, Setting::GlideMs)?;
        within(self.amplitude_mv.into(), 0, 5_000, Setting::AmplitudeMv)?;
        within(self.reference_lsb.into(), 0, 2_000, Setting::ReferenceLsb)?;
        within(self.full_drive_s.into(), 10, 3_600, Setting::FullDriveS)
    }
}

fn within(value: u32, low: u32, high: u32, setting: Setting) -> Result<(), Refusal> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(Refusal {
            setting,
            index: 0,
            low: low.into(),
            high: high.into(),
        })
    }
}
