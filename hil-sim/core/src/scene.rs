//! A scene: what is rubbed, how, through which link, and what must come out.
//!
//! Scenes are TOML files ([`Scene::load`]); [`Scene::constant`] builds the paper's in code. A scene that
//! loaded has been checked as a whole, the files that it names included: nothing in it can stop a run.

mod display;
mod error;
pub mod fault;
mod integrator;
mod motion;
mod series;
mod waveform;
mod windowed_sinc;

use std::sync::Arc;

use firmware_display::Settings;
use protocol::{DisplayConfiguration, GAUGES, Method, Refusal, Rendering, SensorConfiguration};

use crate::scene::fault::Fault;
use strum::{IntoStaticStr, VariantArray};

pub use display::Display;
pub use error::SceneError;
pub use integrator::Integrator;
pub use motion::{LiveHand, Motion};
pub use series::Series;
pub use waveform::Waveform;

/// Everything that decides a run. Two runs of equal scenes are equal, byte for byte.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Names the scene and its outputs: 1 to 64 of `A–Z a–z 0–9 . _ -`, no dot in front. Default: the
    /// file's name without its ending.
    pub name: String,
    /// All randomness comes from it. Default 1.
    pub seed: u64,
    /// Virtual time to run, in s: above 0, to 600. Default 3.
    pub duration_s: f64,
    /// What is rubbed.
    pub surface: Surface,
    /// How the operator's hand moves.
    pub motion: Motion,
    /// How the arm follows the hand.
    pub arm: ArmDrive,
    /// How the fingertip follows the arm.
    pub contact: Contact,
    /// Why that rung, if `"auto"` chose it.
    pub contact_reason: Option<String>,
    /// What the ADC sees.
    pub gauges: Gauges,
    /// The sixth channel, and the shear stiffness that it is read with.
    pub force: Force,
    /// What the way between the boards does to the bytes, in either direction.
    pub link: Link,
    /// What the sensor makes of it.
    pub estimator: Estimator,
    /// How the display board is set.
    pub display: Display,
    /// What breaks, and when, in the order of the file.
    pub faults: Vec<Fault>,
    /// What must come out.
    pub expect: Expect,
    /// What its author should know, though it runs.
    pub notes: Vec<SceneError>,
}

/// `[surface]`: specimens side by side along x.
#[derive(Clone, Debug)]
pub struct Surface {
    /// At least one, in the order of x. The first also covers everything before it, the last goes on
    /// for ever.
    pub specimens: Vec<Specimen>,
    /// Where the first one begins, in mm. Default 0.
    pub start_mm: f64,
    /// The shape of the ridges. Default trapezoid.
    pub profile: Profile,
    /// What a real surface has on top. None with a recorded profile. Default none.
    pub irregularity: Irregularity,
}

impl Surface {
    /// The true wavelength at `x_mm`, in mm.
    pub fn wavelength_mm(&self, x_mm: f64) -> f64 {
        let mut end_mm = self.start_mm;
        let mut specimens = self.specimens.iter();
        let here = specimens.find(|specimen| {
            end_mm += specimen.length_mm;
            x_mm < end_mm
        });
        let last = self.specimens.last();
        here.or(last)
            .map_or(f64::NAN, |specimen| specimen.wavelength_mm)
    }
}

/// `[surface]`: what real surfaces have and gratings have not. "Relative" is to the amplitude of the
/// fundamental, as the gauges feel it. The truth stays the specimens' λ: no second wave is stronger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Irregularity {
    /// RMS of heights at random, relative, 0 to 10: see [`crate::plant::surface`]. Default 0.
    pub random: f64,
    /// Amplitude of a second wave, a sine, relative, 0 to 1. Default 0.
    pub second_wave: f64,
    /// Its wavelength over λ, 0.1 to 10. Default the golden section, so that the two have no short period
    /// in common.
    pub second_ratio: f64,
    /// Share of the ridges that are missing, at random, 0 to 0.9. Default 0.
    pub worn: f64,
    /// Which heights and ridges: the scene's seed.
    pub seed: u64,
}

impl Irregularity {
    /// A grating.
    pub const NONE: Self = Self {
        random: 0.0,
        second_wave: 0.0,
        second_ratio: 0.618,
        worn: 0.0,
        seed: 1,
    };

    /// A surface that gives a rendering all that it can play: a second partial of λ/2, and heights at random, so low that λ can
    /// be known. The grating's own shape has a third partial.
    pub fn rich(rendering: Rendering) -> Self {
        Self {
            random: if rendering == Rendering::Texture {
                0.12
            } else {
                0.0
            },
            second_wave: if rendering == Rendering::Fundamental {
                0.0
            } else {
                0.4
            },
            second_ratio: 0.5,
            ..Self::NONE
        }
    }

    /// Whether there is nothing irregular.
    pub fn is_none(&self) -> bool {
        self.random == 0.0 && self.second_wave == 0.0 && self.worn == 0.0
    }
}

/// A piece of a surface with one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    /// λ in mm: 0.01 to 100.
    pub wavelength_mm: f64,
    /// Its extent along x in mm, above 0; infinite if it is the last.
    pub length_mm: f64,
}

/// The shape of the ridges.
#[derive(Clone, Debug)]
pub enum Profile {
    /// A sine.
    Sine,
    /// A grating with ridges as wide as its grooves and ramps of 0.1 λ.
    Trapezoid,
    /// Measured heights over x, in any unit, from CSV, WAV, MCAP or `.hjif`: see `docs/src/how-to/recordings.md`. The
    /// specimens are then only the truth to judge against.
    Recorded(Arc<Series>),
    /// The same, but what a gauge feels there, 1 being a fundamental's amplitude: neither blurred nor scaled.
    Felt(Arc<Series>),
}

/// `[arm]`: how the remote fingertip follows the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmDrive {
    /// Default motion.
    pub follows: Follows,
    /// The drive's first-order lag in ms, 0 to 1000. Default 0. Only with [`Follows::Link`].
    pub lag_ms: f64,
    /// Resolution of the arm's encoder in µm, a multiple of [`ENCODER_COUNT_UM`], to 500. Default 5. The
    /// counter goes on by so many counts at a time.
    pub encoder_um: u16,
}

/// A count of either encoder, in µm.
pub const ENCODER_COUNT_UM: u16 = 5;

/// What the arm follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// The hand, exactly.
    Motion,
    /// The `Motion` frames that reach the sensor board, through its drive.
    Link,
}

/// `[contact]`: how the fingertip follows the arm, a rung of [`crate::plant::contact`]'s ladder. Without effect
/// on recorded gauges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Which rung: the scene's, or with `"auto"` what [`crate::plant::contact::select`] chose.
    pub rung: ContactModel,
    /// How sticky the surface is; none: not at all. Always some with [`ContactModel::StickSlip`], none below it.
    pub friction: Option<Friction>,
    /// How its equations are solved.
    pub solver: Solver,
}

/// The rungs of the ladder of contact models, the simplest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum ContactModel {
    /// The fingertip is where the arm is, a point.
    Kinematic,
    /// The same, a patch.
    Rigid,
    /// It hangs on a spring and a damper.
    Viscoelastic,
    /// It hangs there, and sticks and slips.
    StickSlip,
    /// It does all that, clinging by bristles: slow, to judge the others by.
    Reference,
}

/// `[contact] integrator` and `step_us`: how a rung's equations are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    /// In closed form, or from event to event: the default.
    Exact,
    /// By steps. Friction has bristles then ([`crate::plant::contact::Bristles`]).
    Stepped {
        /// By which method.
        integrator: Integrator,
        /// Longest step in s, above 0; a scan's 250 µs at most, where the method takes what it is told.
        step_s: f64,
    },
}

impl ContactModel {
    /// All of them, the simplest first.
    pub const ALL: [Self; 5] = *Self::VARIANTS.as_array().unwrap();

    /// As scenes call it.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether a gauge feels a patch, not a point.
    pub const fn has_patch(self) -> bool {
        matches!(self, Self::Rigid | Self::Viscoelastic | Self::Reference)
    }
}

impl Contact {
    /// Where the arm is, a point.
    pub const KINEMATIC: Self = Self::of(ContactModel::Kinematic, None);

    /// A rung as it is solved by default.
    pub const fn of(rung: ContactModel, friction: Option<Friction>) -> Self {
        Self {
            rung,
            friction,
            solver: Solver::Exact,
        }
    }

    /// A slider that sticks and slips.
    pub const fn stick_slip(friction: Friction) -> Self {
        Self::of(ContactModel::StickSlip, Some(friction))
    }
}

impl Default for Contact {
    fn default() -> Self {
        Self::KINEMATIC
    }
}

/// `[contact] friction`: how sticky the surface is; see [`crate::plant::contact::Stribeck`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Friction {
    /// μs = 0.75.
    Mild,
    /// μs = 1.0.
    Strong,
    /// μs = 1.3.
    Severe,
}

/// `[gauges]`: the sixth channel, a tangential force at the base of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Force {
    /// Whether it is wired (`tangential`). Default no, and mid-rail; yes with a recording that has it.
    pub present: bool,
    /// Newton for a volt above mid-rail (`tangential_n_per_v`), 0.05 to 20. Default 1.
    pub n_per_v: f64,
    /// Shear stiffness of the fingertip in N/m (`stiffness_n_per_m`), 10 to 10 000; the slider's spring,
    /// too. Default 400, a guess.
    pub stiffness_n_per_m: f64,
}

/// `[gauges]`: where the ADC's voltages come from.
#[derive(Clone, Debug)]
pub enum Gauges {
    /// Computed: each gauge feels the texture under its own place. See [`crate::plant::gauges`].
    Kinematic(Kinematic),
    /// Voltages at the pins, five columns or six with the tangential force, from CSV, WAV or MCAP: see
    /// `docs/src/how-to/recordings.md`.
    Recorded(Arc<Waveform>),
}

/// The computed gauges' imperfections. "Relative" is to the amplitude of the fundamental at unit gain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kinematic {
    /// Power of the fundamental at unit gain over the white noise's in 0–500 Hz, in dB, −40 to 120.
    /// Default none: no noise.
    pub snr_db: Option<f64>,
    /// Mains hum, common to all gauges, its amplitude relative to the fundamental's at unit gain, 0 to
    /// 10. Default 0.
    pub hum_50_hz: f64,
    /// The same where the mains have 60 Hz. Default 0.
    pub hum_60_hz: f64,
    /// How far off nominal the mains are, in Hz, −2 to 2; that of `humming` gauges, too. Default 0.
    pub hum_off_hz: f64,
    /// A second harmonic, relative to the fundamental, 0 to 1. Default 0.
    pub second_harmonic: f64,
    /// Gauges that say nothing: mid-rail, without signal, hum or noise. Default none.
    pub dead: [bool; GAUGES],
    /// Gauges whose amplifier drives the ADC into both ends. Default none.
    pub saturated: [bool; GAUGES],
    /// Gauges that stand at one code, off mid-rail ([`crate::plant::gauges::STUCK_CODE`]). Default none.
    pub stuck: [bool; GAUGES],
    /// Gauges with white noise of their own, RMS 3 relative. Default none.
    pub noisy: [bool; GAUGES],
    /// Gauges with 50 Hz hum of their own, amplitude 2 relative. Default none.
    pub humming: [bool; GAUGES],
    /// From when on the gauges of these five lists are so, in s, 0 to 600; sound before. Default 0.
    pub trouble_from_s: f64,
    /// For how long, in s, above 0, to 600; sound again after. Default for good.
    pub trouble_for_s: Option<f64>,
    /// The sensor's resonance, between the texture and the gauges. Default none.
    pub resonance: Option<Resonance>,
    /// RMS of 1/f noise, each gauge its own, relative, 0 to 10. Default 0.
    pub pink: f64,
    /// Amplitude of a sine of [`crate::plant::gauges::DRIFT_HZ`], its phase differing by gauge, relative, 0 to
    /// 10. Default 0.
    pub drift: f64,
    /// Largest static offset, relative, 0 to 10; each gauge has its share
    /// ([`crate::plant::gauges::OFFSET_SHARES`]), and beyond ±5.5 the ADC clips. Default 0.
    pub offset: f64,
    /// How much later than the position the ADC is read, in µs, −5000 to 5000: its channels at t belong
    /// to x(t − skew). Default 0. See [`crate::plant::skew`].
    pub skew_us: f64,
}

/// A resonance of second order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Its frequency without damping (`resonance_hz`), in Hz, 10 to 2000. 180 is a guess.
    pub hz: f64,
    /// Its damping ratio ζ (`resonance_damping`), 0.01 to 0.99. Default 0.15, a guess.
    pub damping: f64,
}

/// `[link]`: the weather between the boards, the same for either direction. All default to 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    /// One way, in ms, 0 to 10 000.
    pub delay_ms: f64,
    /// Largest further delay of a frame in ms, 0 to 10 000, evenly spread; it changes no order.
    pub jitter_ms: f64,
    /// Share of frames that never come.
    pub loss: f64,
    /// Share of frames that come after the frame that was sent after them.
    pub reorder: f64,
    /// Share of bytes of which one bit is turned.
    pub corrupt: f64,
}

/// `[estimator]`: how λ is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimator {
    /// `"default"` is the boards' own default.
    pub method: Method,
    /// The counting window A in ms, 10 to 200. Default 80, the paper's.
    pub window_ms: u16,
    /// The gauge whose crossings are counted, 0 to 4. Default 2.
    pub counted_gauge: u8,
    /// Gauges that may take part in the estimate, at least one. Default all.
    pub gauges: [bool; GAUGES],
    /// The longest fit, in wavelengths of travel, 2 to 8: the knob between accuracy and latency. Default 8.
    pub waves: u8,
    /// An estimate is stood by when its confidence, the probability that it is within 5 %, is at least
    /// this many percent, 50 to 99. Default 60.
    pub valid_percent: u8,
    /// Where the fingertip's stiffness comes from. Default configured.
    pub stiffness: Stiffness,
}

/// Where the sensor has the fingertip's shear stiffness from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stiffness {
    /// It is told.
    Configured,
    /// It finds it out.
    Estimated,
}

/// `[expect]`: bounds on the summary. One that is absent is not judged.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Expect {
    /// `rms_percent` at most this.
    pub wavelength_rms_percent: Option<f64>,
    /// `bias_percent` within ± this.
    pub wavelength_bias_percent: Option<f64>,
    /// `mean_mm` within ± [`Expect::mean_tolerance_mm`] of this.
    pub mean_mm: Option<f64>,
    /// In mm. Default 0.03.
    pub mean_tolerance_mm: f64,
    /// `valid_share` at least this, 0 to 1.
    pub valid_share_min: Option<f64>,
    /// `wrong_share` at most this, 0 to 1.
    pub wrong_share_max: Option<f64>,
    /// `felt_right_share` at least this, 0 to 1.
    pub felt_right_share_min: Option<f64>,
    /// `felt_wrong_share` at most this, 0 to 1.
    pub felt_wrong_share_max: Option<f64>,
    /// `settling_ms` at most this.
    pub settling_ms: Option<f64>,
    /// `latency_ms` at most this.
    pub latency_ms: Option<f64>,
    /// The actuators' frequency within ± this many percent of v/λ̂.
    pub frequency_percent: Option<f64>,
    /// `phase_error_rms_cycles` at most this.
    pub phase_rms_cycles: Option<f64>,
}

impl Scene {
    /// One specimen of `wavelength_mm`, a trapezoid, rubbed at `speed_mm_s` for 3 s without noise, as in a
    /// cell of the paper's Table I, estimated by the default method. The values must be within the
    /// ranges of [`Specimen`] and [`Motion`].
    pub fn constant(wavelength_mm: f64, speed_mm_s: f64) -> Self {
        Self {
            name: format!("constant-{wavelength_mm}mm-{speed_mm_s}mm-s"),
            seed: 1,
            duration_s: 3.0,
            surface: Surface {
                specimens: vec![Specimen {
                    wavelength_mm,
                    length_mm: f64::INFINITY,
                }],
                start_mm: 0.0,
                profile: Profile::Trapezoid,
                irregularity: Irregularity::NONE,
            },
            motion: Motion::Constant { speed_mm_s },
            arm: ArmDrive::default(),
            contact: Contact::KINEMATIC,
            contact_reason: None,
            gauges: Gauges::Kinematic(Kinematic::default()),
            force: Force::default(),
            link: Link::default(),
            estimator: Estimator::default(),
            display: Display::default(),
            faults: Vec::new(),
            expect: Expect::default(),
            notes: Vec::new(),
        }
    }

    /// What the scene asks of the sensor board.
    pub fn sensor_configuration(&self) -> SensorConfiguration {
        let defaults = SensorConfiguration::DEFAULT;
        let estimator = &self.estimator;
        SensorConfiguration {
            method: estimator.method,
            window_ms: estimator.window_ms,
            counted_gauge: estimator.counted_gauge,
            gauges: (0..GAUGES).fold(0, |set, gauge| {
                set | u8::from(estimator.gauges[gauge]) << gauge
            }),
            waves: estimator.waves,
            valid_percent: estimator.valid_percent,
            force_channel: self.force.present,
            force_mn_per_v: (1_000.0 * self.force.n_per_v).round() as u16,
            stiffness_n_per_m: match estimator.stiffness {
                Stiffness::Configured => self.force.stiffness_n_per_m.round() as u16,
                Stiffness::Estimated => 0,
            },
            ..defaults
        }
    }

    /// What a display board holds that has taken what the scene asks of it.
    ///
    /// # Errors
    /// The first value out of its range: none, in a scene that was loaded.
    pub fn display_settings(&self) -> Result<Settings, Refusal> {
        Settings::new(self.display.configuration, &self.display.actuators)
    }

    /// What the scene asks of the display board.
    pub fn display_configuration(&self) -> DisplayConfiguration {
        self.display.configuration
    }
}

impl Default for ArmDrive {
    fn default() -> Self {
        Self {
            follows: Follows::Motion,
            lag_ms: 0.0,
            encoder_um: ENCODER_COUNT_UM,
        }
    }
}

impl Default for Force {
    fn default() -> Self {
        Self {
            present: false,
            n_per_v: 1.0,
            stiffness_n_per_m: 400.0,
        }
    }
}

impl Default for Estimator {
    fn default() -> Self {
        let defaults = SensorConfiguration::DEFAULT;
        Self {
            method: defaults.method,
            window_ms: defaults.window_ms,
            counted_gauge: defaults.counted_gauge,
            gauges: std::array::from_fn(|gauge| defaults.gauges >> gauge & 1 == 1),
            waves: defaults.waves,
            valid_percent: defaults.valid_percent,
            stiffness: Stiffness::Configured,
        }
    }
}
