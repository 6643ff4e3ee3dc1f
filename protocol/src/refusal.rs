//! What a board refuses of a configuration, and why.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Why a configuration was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Refusal {
    /// The setting.
    pub setting: Setting,
    /// The actuator it is of; 0 for other settings.
    pub index: u8,
    /// The lowest value that would be taken.
    pub low: i64,
    /// The highest value that would be taken.
    pub high: i64,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self {
            setting,
            index,
            low,
            high,
        } = self;
        match setting {
            Setting::Role => write!(f, "the configuration is for the other board"),
            Setting::Replaces => write!(
                f,
                "the configuration in force is not the one that was to be replaced, but {low:#010x}"
            ),
            Setting::Actuators => write!(
                f,
                "actuators names neither the description in force nor the one that was sent, {low:#010x}"
            ),
            Setting::ActuatorsFirst => {
                write!(
                    f,
                    "no block of actuators begins at {index}: give a multiple of ten up to {high}"
                )
            }
            Setting::ActuatorX
            | Setting::ActuatorY
            | Setting::ActuatorGain
            | Setting::ActuatorResonance
            | Setting::ActuatorDamping => {
                write!(
                    f,
                    "{} of actuator {index} is out of range: give {low} to {high}",
                    setting.name()
                )
            }
            Setting::Rendering => write!(
                f,
                "rendering is too much with these actuators: more than the fundamental, or a resonance, is worked out \
                 for at most {high} of them with different places, phases or resonances"
            ),
            _ => write!(
                f,
                "{} is out of range: give {low} to {high}",
                setting.name()
            ),
        }
    }
}

/// A setting that was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Setting {
    /// The configuration is for the other board.
    Role,
    /// [`crate::SensorConfiguration::window_ms`]
    WindowMs,
    /// [`crate::SensorConfiguration::counted_gauge`]
    CountedGauge,
    /// [`crate::SensorConfiguration::gauges`]
    Gauges,
    /// [`crate::SensorConfiguration::waves`]
    Waves,
    /// [`crate::SensorConfiguration::valid_percent`]
    ValidPercent,
    /// [`crate::SensorConfiguration::force_mn_per_v`]
    ForceScale,
    /// [`crate::SensorConfiguration::stiffness_n_per_m`]
    Stiffness,
    /// [`crate::SensorConfiguration::arm_full_scale_um_s`]
    ArmFullScale,
    /// [`crate::DisplayConfiguration::max_age_ms`]
    MaxAgeMs,
    /// [`crate::DisplayConfiguration::fade_in_ms`]
    FadeInMs,
    /// [`crate::DisplayConfiguration::fade_out_ms`]
    FadeOutMs,
    /// [`crate::DisplayConfiguration::glide_ms`]
    GlideMs,
    /// [`crate::DisplayConfiguration::amplitude_mv`]
    AmplitudeMv,
    /// [`crate::DisplayConfiguration::reference_lsb`]
    ReferenceLsb,
    /// [`crate::DisplayConfiguration::reference_mn`]
    ReferenceMn,
    /// [`crate::DisplayConfiguration::full_drive_s`]
    FullDriveS,
    /// [`crate::DisplayConfiguration::actuators`]: neither the description in force nor the one sent.
    Actuators,
    /// [`crate::Actuators::first`]
    ActuatorsFirst,
    /// [`crate::Actuator::x_um`]
    ActuatorX,
    /// [`crate::Actuator::y_um`]
    ActuatorY,
    /// [`crate::Actuator::gain_q15`]
    ActuatorGain,
    /// [`crate::Actuator::resonance_dhz`]
    ActuatorResonance,
    /// [`crate::Actuator::damping_percent`]
    ActuatorDamping,
    /// [`crate::Configure::replaces`]: another configuration is in force.
    Replaces,
    /// [`crate::DisplayConfiguration::rendering`]: more than the fundamental, or a resonance of an actuator, is asked for
    /// of actuators with more different places, phases and resonances than are worked out in time.
    Rendering,
}

impl Setting {
    /// Its name on the wire: a field's.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Role => "role",
            Self::WindowMs => "window_ms",
            Self::CountedGauge => "counted_gauge",
            Self::Gauges => "gauges",
            Self::Waves => "waves",
            Self::ValidPercent => "valid_percent",
            Self::ForceScale => "force_mn_per_v",
            Self::Stiffness => "stiffness_n_per_m",
            Self::ArmFullScale => "arm_full_scale_um_s",
            Self::MaxAgeMs => "max_age_ms",
            Self::FadeInMs => "fade_in_ms",
            Self::FadeOutMs => "fade_out_ms",
            Self::GlideMs => "glide_ms",
            Self::AmplitudeMv => "amplitude_mv",
            Self::ReferenceLsb => "reference_lsb",
            Self::ReferenceMn => "reference_mn",
            Self::FullDriveS => "full_drive_s",
            Self::Actuators => "actuators",
            Self::ActuatorsFirst => "first",
            Self::ActuatorX => "x_um",
            Self::ActuatorY => "y_um",
            Self::ActuatorGain => "gain_q15",
            Self::ActuatorResonance => "resonance_dhz",
            Self::ActuatorDamping => "damping_percent",
            Self::Replaces => "replaces",
            Self::Rendering => "rendering",
        }
    }
}

#[cfg(test)]
mod tests {
    use core::fmt::Write;

    use super::*;

    fn words(setting: Setting) -> heapless::String<256> {
        let refusal = Refusal {
            setting,
            index: 20,
            low: 3,
            high: 50,
        };
        let mut words = heapless::String::new();
        write!(words, "{refusal}").unwrap();
        words
    }

    #[test]
    fn a_refusal_says_what_and_what_to_give() {
        for (setting, said) in [
            (Setting::Role, "the configuration is for the other board"),
            (
                Setting::Replaces,
                "the configuration in force is not the one that was to be replaced, but 0x00000003",
            ),
            (
                Setting::Actuators,
                "actuators names neither the description in force nor the one that was sent, 0x00000003",
            ),
            (
                Setting::ActuatorsFirst,
                "no block of actuators begins at 20: give a multiple of ten up to 50",
            ),
            (
                Setting::ActuatorGain,
                "gain_q15 of actuator 20 is out of range: give 3 to 50",
            ),
            (Setting::WindowMs, "window_ms is out of range: give 3 to 50"),
        ] {
            assert_eq!(words(setting), said);
        }
    }
}
