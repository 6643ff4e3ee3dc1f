//! What can be set on a board over the link, as a whole, checked before it is taken.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::actuators::{self, DEFAULT_ACTUATORS};
use crate::capabilities::SettingRange;
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

impl Method {
    /// All of them, as they are listed for people.
    pub const ALL: [Self; 4] = [
        Self::Spectrum,
        Self::Crossings,
        Self::Counting,
        Self::AdaptedCounting,
    ];

    /// Its name in scenes, tables and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Spectrum => "spectrum",
            Self::Crossings => "crossings",
            Self::Counting => "counting",
            Self::AdaptedCounting => "counting-adapted",
        }
    }
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

impl Mode {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Uniform, Self::Travelling];

    /// Its name in scenes, tables and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Travelling => "travelling",
        }
    }
}

/// How much of the surface the actuators play.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Rendering {
    /// The fundamental alone: the paper's sine, equation (12).
    #[default]
    Fundamental,
    /// The fundamental and its partials ([`crate::Texture::partials`]).
    Shape,
    /// These, and a random part with the levels of [`crate::Texture::bands`] that is the same at the same place.
    Texture,
}

impl Rendering {
    /// All of them, the simplest first.
    pub const ALL: [Self; 3] = [Self::Fundamental, Self::Shape, Self::Texture];

    /// Its name in scenes, tables and commands.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fundamental => "fundamental",
            Self::Shape => "shape",
            Self::Texture => "texture",
        }
    }
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
    /// How much of the surface they play.
    #[serde(default)] // Recordings of protocol 5 and before have none.
    pub rendering: Rendering,
    /// How often they get new voltages.
    pub update_rate: UpdateRate,
    /// Age of the last valid estimate, in ms, at which the stimulus fades out at the latest, 20 to 5 000.
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
    /// The fluctuation of the tangential force ([`crate::Friction::fluctuation_mn`]) that is played at
    /// `amplitude_mv`, in mN, 1 to 60 000; what fluctuates less is played weaker in proportion. 0: the force counts for
    /// nothing. It counts only as far as the sensor tells it.
    #[serde(default)]
    pub reference_mn: u16,
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
        rendering: Rendering::Fundamental,
        update_rate: UpdateRate::Hz2000,
        max_age_ms: 500,
        fade_in_ms: 20,
        fade_out_ms: 50,
        glide_ms: 20,
        amplitude_mv: 5_000,
        reference_lsb: 0,
        reference_mn: 0,
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

/// Asks a board to take a configuration as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Configure {
    /// [`Configuration::hash`] of the one that it is to replace: if another is in force, it is refused, so that
    /// nobody undoes what somebody else has just changed. None: whatever is in force.
    pub replaces: Option<u32>,
    /// The configuration.
    pub configuration: Configuration,
}

impl Configure {
    /// Whatever is in force.
    pub const fn anyway(configuration: Configuration) -> Self {
        Self {
            replaces: None,
            configuration,
        }
    }

    /// Checks that what is in force is what is to be replaced.
    ///
    /// # Errors
    /// If it is not: a refusal of [`Setting::Replaces`].
    pub fn check_replaces(&self, in_force: u32) -> Result<(), Refusal> {
        match self.replaces {
            Some(replaces) if replaces != in_force => Err(Refusal {
                setting: Setting::Replaces,
                index: 0,
                low: in_force.into(),
                high: in_force.into(),
            }),
            _ => Ok(()),
        }
    }
}

/// A board's answer to [`crate::Message::Configure`] and [`crate::Question::Configuration`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct ConfigurationReport {
    /// None if the configuration asked for, if any, is now in force; else why it is not, and nothing was changed.
    pub refused: Option<Refusal>,
    /// [`Configuration::hash`] of the configuration in force.
    pub hash: u32,
    /// The configuration in force.
    pub configuration: Configuration,
}

impl ConfigurationReport {
    /// That `configuration` is in force.
    pub fn of(configuration: Configuration, refused: Option<Refusal>) -> Self {
        Self {
            refused,
            hash: configuration.hash(),
            configuration,
        }
    }
}

impl SensorConfiguration {
    /// The ranges of all settings that are numbers.
    pub const RANGES: [SettingRange; 8] = [
        SettingRange::new(Setting::WindowMs, 10, 200),
        SettingRange::new(Setting::CountedGauge, 0, 4),
        SettingRange::new(Setting::Gauges, 1, 31),
        SettingRange::new(Setting::Waves, 2, 8),
        SettingRange::new(Setting::ValidPercent, 50, 99),
        SettingRange::new(Setting::ForceScale, 1, 60_000),
        SettingRange::new(Setting::Stiffness, 10, 60_000).or_zero(),
        SettingRange::new(Setting::ArmFullScale, 1_000, 2_000_000),
    ];

    /// Checks every range; the first setting outside of its own is the error.
    pub fn check(&self) -> Result<(), Refusal> {
        let values: [u32; 8] = [
            self.window_ms.into(),
            self.counted_gauge.into(),
            self.gauges.into(),
            self.waves.into(),
            self.valid_percent.into(),
            self.force_mn_per_v.into(),
            self.stiffness_n_per_m.into(),
            self.arm_full_scale_um_s,
        ];
        check(&Self::RANGES, &values)
    }
}

impl DisplayConfiguration {
    /// The largest amplitude of the stimulus, in mV (Okamoto et al. 2009, equation (12)).
    pub const MOST_AMPLITUDE_MV: u16 = 5_000;

    /// The ranges of all settings that are numbers.
    pub const RANGES: [SettingRange; 8] = [
        SettingRange::new(Setting::MaxAgeMs, 20, 5_000),
        SettingRange::new(Setting::FadeInMs, 1, 1_000),
        SettingRange::new(Setting::FadeOutMs, 1, 1_000),
        SettingRange::new(Setting::GlideMs, 0, 500),
        SettingRange::new(Setting::AmplitudeMv, 0, Self::MOST_AMPLITUDE_MV as u32),
        SettingRange::new(Setting::ReferenceLsb, 0, 2_000),
        SettingRange::new(Setting::ReferenceMn, 0, 60_000),
        SettingRange::new(Setting::FullDriveS, 10, 3_600),
    ];

    /// Checks every range; the first setting outside of its own is the error.
    pub fn check(&self) -> Result<(), Refusal> {
        let values = [
            self.max_age_ms,
            self.fade_in_ms,
            self.fade_out_ms,
            self.glide_ms,
            self.amplitude_mv,
            self.reference_lsb,
            self.reference_mn,
            self.full_drive_s,
        ];
        check(&Self::RANGES, &values.map(u32::from))
    }
}

fn check<const N: usize>(ranges: &[SettingRange; N], values: &[u32; N]) -> Result<(), Refusal> {
    let mut checks = ranges.iter().zip(values);
    checks.try_for_each(|(range, &value)| range.check(value))
}
