//! What can be set on a board over the link, as a whole, checked before it is taken.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// How λ is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Method {
    /// A bank of wavenumbers over the arm's travel.
    #[default]
    Bank,
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
    /// Travel over which the bank averages, as percent of λ, 30 to 300: the knob between accuracy and
    /// latency.
    pub bank_travel_percent: u16,
    /// Wavenumbers in the bank, 12 to 36.
    pub bank_candidates: u8,
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
        method: Method::Bank,
        window_ms: 80,
        counted_gauge: 2,
        gauges: 0b11111,
        bank_travel_percent: 70,
        bank_candidates: 28,
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

/// The display board's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct DisplayConfiguration {
    /// How the actuators share the stimulus.
    pub mode: Mode,
    /// Age of the last valid estimate, in ms, at which the stimulus fades out, 20 to 5 000.
    pub max_age_ms: u16,
    /// Time from 0 to full stimulus, in ms, 1 to 1 000.
    pub fade_in_ms: u16,
    /// Time from full stimulus to 0, in ms, 1 to 1 000.
    pub fade_out_ms: u16,
    /// Distance between neighbouring actuators, in µm, 100 to 10 000.
    pub pitch_um: u16,
    /// The stimulus' amplitude in mV, 0 to 5 000; the paper's is 5 000 (equation (12)).
    pub amplitude_mv: u16,
}

impl DisplayConfiguration {
    /// What a board starts with: safe, and the paper's numbers where it gives some.
    pub const DEFAULT: Self = Self {
        mode: Mode::Uniform,
        max_age_ms: 500,
        fade_in_ms: 20,
        fade_out_ms: 50,
        pitch_um: 1_500,
        amplitude_mv: 5_000,
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

/// A board's answer to [`crate::Message::Configure`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ConfigurationReport {
    /// None if the configuration asked for is now in force; else the first setting that was out of
    /// its range, and nothing was changed.
    pub refused: Option<Setting>,
    /// The configuration in force.
    pub configuration: Configuration,
}

/// A setting that was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Setting {
    /// The configuration is for the other board.
    Role,
    /// [`SensorConfiguration::window_ms`]
    WindowMs,
    /// [`SensorConfiguration::counted_gauge`]
    CountedGauge,
    /// [`SensorConfiguration::gauges`]
    Gauges,
    /// [`SensorConfiguration::bank_travel_percent`]
    BankTravel,
    /// [`SensorConfiguration::bank_candidates`]
    BankCandidates,
    /// [`SensorConfiguration::force_mn_per_v`]
    ForceScale,
    /// [`SensorConfiguration::stiffness_n_per_m`]
    Stiffness,
    /// [`SensorConfiguration::arm_full_scale_um_s`]
    ArmFullScale,
    /// [`DisplayConfiguration::max_age_ms`]
    MaxAgeMs,
    /// [`DisplayConfiguration::fade_in_ms`]
    FadeInMs,
    /// [`DisplayConfiguration::fade_out_ms`]
    FadeOutMs,
    /// [`DisplayConfiguration::pitch_um`]
    PitchUm,
    /// [`DisplayConfiguration::amplitude_mv`]
    AmplitudeMv,
}

impl SensorConfiguration {
    /// Checks every range; the first setting outside of its own is the error.
    pub fn check(&self) -> Result<(), Setting> {
        within(self.window_ms.into(), 10, 200, Setting::WindowMs)?;
        within(self.counted_gauge.into(), 0, 4, Setting::CountedGauge)?;
        within(self.gauges.into(), 1, 31, Setting::Gauges)?;
        within(
            self.bank_travel_percent.into(),
            30,
            300,
            Setting::BankTravel,
        )?;
        within(self.bank_candidates.into(), 12, 36, Setting::BankCandidates)?;
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
    pub fn check(&self) -> Result<(), Setting> {
        within(self.max_age_ms.into(), 20, 5_000, Setting::MaxAgeMs)?;
        within(self.fade_in_ms.into(), 1, 1_000, Setting::FadeInMs)?;
        within(self.fade_out_ms.into(), 1, 1_000, Setting::FadeOutMs)?;
        within(self.pitch_um.into(), 100, 10_000, Setting::PitchUm)?;
        within(self.amplitude_mv.into(), 0, 5_000, Setting::AmplitudeMv)
    }
}

fn within(value: u32, low: u32, high: u32, setting: Setting) -> Result<(), Setting> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(setting)
    }
}
