//! Haptic experiences in the interchange format of ISO/IEC 23090-31, `.hjif` (JSON): their structure, and their textures
//! as numbers over place.
//!
//! Names, types and ranges are those of MPEG's published JSON schemas of the edition that calls itself "2023"
//! (MPEGGroup/HapticJSONSchemas); what a band says at a place is as in MPEG's reference software
//! (MPEGGroup/HapticReferenceSoftware). Only what is written or evaluated here has a field; other fields of a file
//! are passed over.
//!
//! | of the standard | here |
//! | --- | --- |
//! | perceptions | the one "Vibrotactile Texture"; others are passed over |
//! | bands | curves, linear and cubic; waves, of every base signal. Wavelets, transients and other curves are refused |
//! | effects | basis effects and references to the library; composite ones are refused |

mod height;
mod piece;
mod tracer;

use serde::{Deserialize, Serialize};

pub use height::{MOST_SAMPLED_MM, SAMPLED_MM, Texture};

/// [`Experience::version`] of what is written here.
pub const VERSION: &str = "2023";
/// [`Experience::profile`] of what is written here: without restrictions.
pub const PROFILE: &str = "Main";
/// [`Experience::level`] of what is written here: at most 128 channels a perception and 7 bands a channel.
pub const LEVEL: u32 = 1;
/// The [`Perception::perception_modality`] of what is felt where a fingertip slides.
pub const TEXTURE: &str = "Vibrotactile Texture";
/// [`Perception::unit_exponent`] where a file gives none: mm and ms.
pub const UNIT_EXPONENT: i32 = -3;
/// The farthest place of any texture, in mm.
const FARTHEST_MM: f64 = 100_000.0;

/// A haptic experience: a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Experience {
    /// Edition of the standard, a year.
    pub version: String,
    /// Profile of the standard's Annex D: "Main" or "Simple Parametric".
    pub profile: String,
    /// Level of the profile: 1 or 2.
    pub level: u32,
    /// When it was made (RFC 3339).
    pub date: String,
    /// What it is, in words.
    pub description: String,
    /// Ticks in a second, for what is a function of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timescale: Option<u32>,
    /// Bodies that perceptions belong to.
    pub avatars: Vec<Avatar>,
    /// What is perceived, at least one.
    pub perceptions: Vec<Perception>,
    /// Instants of synchronisation.
    #[serde(default)]
    pub syncs: Vec<Sync>,
}

/// A body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Avatar {
    /// From 1 on.
    pub id: u32,
    /// Level of detail, from 0 on.
    pub lod: u32,
    /// "Vibration", "Pressure", "Temperature" or "Custom".
    #[serde(rename = "type")]
    pub kind: String,
}

/// An instant of synchronisation.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sync {
    /// In ticks.
    pub timestamp: u64,
}

/// Signals of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Perception {
    /// From 0 on, its own.
    pub id: u32,
    /// Which kind: [`TEXTURE`], or another one.
    pub perception_modality: String,
    /// What it is, in words.
    pub description: String,
    /// The [`Avatar::id`] of its body; 0 for none.
    pub avatar_id: u32,
    /// Effects that channels refer to.
    pub effect_library: Vec<Effect>,
    /// What it was made for.
    #[serde(default)]
    pub reference_devices: Vec<ReferenceDevice>,
    /// At least one.
    pub channels: Vec<Channel>,
    /// Places are in 10^this m; [`UNIT_EXPONENT`] if it is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit_exponent: Option<i32>,
    /// What is perceived is in 10^this of its own unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perception_unit_exponent: Option<i32>,
}

/// A device that a signal was made for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceDevice {
    /// From 1 on, its own.
    pub id: u32,
    /// Its name.
    pub name: String,
    /// In Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum_frequency: Option<f64>,
    /// In Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum_frequency: Option<f64>,
    /// In V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum_voltage: Option<f64>,
    /// "LRA", "VCA", "ERM", "Piezo" or "Unknown": the standard knows no others.
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
}

/// A signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// From 0 on, its own.
    pub id: u32,
    /// What it is, in words.
    pub description: String,
    /// The [`ReferenceDevice::id`] that it was made for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_device_id: Option<u32>,
    /// What the bands' sum is multiplied by, 0 or more.
    pub gain: f64,
    /// Its weight among others, 0 or more.
    pub mixing_coefficient: f64,
    /// Rows of actuators that it was made for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actuator_resolution: Option<Vector>,
    /// Where on the body, in the standard's words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_part_target: Option<Vec<String>>,
    /// Samples of the original in a second, of a texture in a metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frequency_sampling: Option<u32>,
    /// How many samples the original has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_count: Option<u32>,
    /// What it is the sum of.
    pub bands: Vec<Band>,
}

/// Three whole numbers of −127 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub struct Vector {
    /// To the right.
    pub x: i8,
    /// Up.
    pub y: i8,
    /// Forward.
    pub z: i8,
}

/// A part of a signal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// How its effects are meant.
    pub band_type: BandType,
    /// How a curve goes from keyframe to keyframe.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curve_type: Option<CurveType>,
    /// 0 to 10 000.
    pub lower_frequency_limit: f64,
    /// 0 to 10 000.
    pub upper_frequency_limit: f64,
    /// One after the other.
    pub effects: Vec<Effect>,
}

/// How a band's effects are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum BandType {
    /// As a stream of wavelets.
    WaveletWave,
    /// As waves with amplitude and frequency.
    VectorialWave,
    /// As a curve through its keyframes.
    Curve,
    /// As knocks.
    Transient,
}

/// How a curve goes from keyframe to keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CurveType {
    /// Straight.
    Linear,
    /// By a cubic that is level at each keyframe.
    Cubic,
    /// By Akima's splines.
    Akima,
    /// By Bézier's.
    Bezier,
    /// By B-splines.
    BSpline,
    /// As a player likes.
    Unknown,
}

/// A piece of a band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Its own in a library; of a reference, the library's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// What it is.
    pub effect_type: EffectType,
    /// Where it begins, in the perception's unit; 0 if it is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<u64>,
    /// Of a wave, in rad, 0 to 2π; 0 if it is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase: Option<f64>,
    /// Of a wave; a sine if it is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_signal: Option<BaseSignal>,
    /// Of a basis effect.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub keyframes: Vec<Keyframe>,
}

/// What an effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum EffectType {
    /// Keyframes of its own.
    Basis,
    /// Other effects.
    Composite,
    /// One of the library.
    Reference,
}

/// The shape of a wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum BaseSignal {
    /// A sine.
    Sine,
    /// 1 for half a cycle, −1 for the other.
    Square,
    /// Straight up and down.
    Triangle,
    /// Straight up, and down at once.
    SawToothUp,
    /// Straight down, and up at once.
    SawToothDown,
}

/// A point of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// −1 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplitude_modulation: Option<f64>,
    /// Of a wave, in Hz, of a texture in cycles per m: 0 to 10 000.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frequency_modulation: Option<f64>,
    /// From its effect's beginning, in the perception's unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_position: Option<u64>,
}

/// What is wrong with a file, where in it, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", if place.is_empty() { String::new() } else { format!("{place}: ") })]
pub struct HjifError {
    /// The line at fault, from 1 on, where the text is.
    pub line: Option<usize>,
    /// The field at fault with its path (`perceptions[0].channels[1].gain`); empty if it is the file.
    pub place: String,
    /// What is wrong and what to do.
    pub message: String,
}

impl HjifError {
    pub(crate) fn at(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            line: None,
            place: place.into(),
            message: message.into(),
        }
    }
}

impl Experience {
    /// Reads a file's text.
    ///
    /// # Errors
    /// If it is no JSON, or not of this structure.
    pub fn parse(text: &[u8]) -> Result<Self, HjifError> {
        let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
        let mut json = serde_json::Deserializer::from_slice(text);
        let refuse = |place: &str, error: &serde_json::Error| HjifError {
            line: (error.line() > 0).then_some(error.line()),
            // The whole file is ".", a field that is not there yet "?".
            place: place.trim_end_matches(['.', '?']).to_owned(),
            message: format!("{error}: give a whole .hjif file of ISO/IEC 23090-31"),
        };
        let experience = serde_path_to_error::deserialize(&mut json)
            .map_err(|error| refuse(&error.path().to_string(), error.inner()))?;
        json.end().map_err(|error| refuse("", &error))?;
        Ok(experience)
    }

    /// The text of a file, one line.
    ///
    /// # Errors
    /// None: every experience can be said in JSON. A number that is not finite becomes null, which no reader takes.
    pub fn text(&self) -> serde_json::Result<String> {
        serde_json::to_string(self)
    }
}
