//! Channels over place as a texture of ISO/IEC 23090-31.

use std::path::Path;

use firmware_display::level::SILENT_FROM_HZ;
use hil_sim_core::hjif::{
    Avatar, Band, BandType, Channel, CurveType, Effect, EffectType, Experience, Keyframe, LEVEL,
    PROFILE, Perception, ReferenceDevice, TEXTURE, VERSION, Vector,
};

use super::name;
use crate::PROGRAM;

/// Places are in µm.
const UNIT_EXPONENT: i32 = -6;
/// Amplitudes are written to a hundred-thousandth: a third of the step of 16 bits.
const PER_UNIT: f64 = 1e5;
/// The highest frequency that the standard's bands have, per metre: a wave of 0.1 mm.
const MOST_FREQUENCY: f64 = 10_000.0;
/// Ticks in a second, the standard's default. A texture has none, but players want to be told.
const TIMESCALE: u32 = 1_000;
/// The display's full voltage, in V.
const FULL_V: f64 = 5.0;
/// Actuators to the right and up.
const GRID: Vector = Vector { x: 10, y: 5, z: 1 };
const DEVICE: u32 = 1;
const AVATAR: u32 = 1;

pub struct Trace {
    pub description: String,
    /// What an amplitude of 1 stands for.
    pub gain: f64,
    /// Samples in a metre; none if they are not evenly spaced.
    pub per_metre: Option<u32>,
    /// Places in µm, rising, and amplitudes of −1 to 1.
    pub points: Vec<(u64, f64)>,
}

/// A texture, ready to be written.
pub struct Made {
    pub experience: Experience,
    pub holds: String,
    /// The keys of `[surface]` that read it, but for the file's name.
    pub keys: String,
}

impl Made {
    /// A texture of some traces. `description` says what it is.
    pub fn new(date: &str, description: String, traces: Vec<Trace>, keys: String) -> Self {
        let keyframes: usize = traces.iter().map(|trace| trace.points.len()).sum();
        let count = traces.len();
        let channels = traces
            .into_iter()
            .zip(0..)
            .map(|(trace, id)| channel(id, trace));
        let perception = Perception {
            id: 0,
            perception_modality: TEXTURE.to_owned(),
            description: "What a fingertip feels over its way along the surface".to_owned(),
            avatar_id: AVATAR,
            effect_library: Vec::new(),
            reference_devices: vec![device()],
            channels: channels.collect(),
            unit_exponent: Some(UNIT_EXPONENT),
            perception_unit_exponent: Some(0),
        };
        let experience = Experience {
            version: VERSION.to_owned(),
            profile: PROFILE.to_owned(),
            level: LEVEL,
            date: date.to_owned(),
            description: format!("{description}; by {PROGRAM}"),
            timescale: Some(TIMESCALE),
            avatars: vec![Avatar {
                id: AVATAR,
                lod: 0,
                kind: "Vibration".to_owned(),
            }],
            perceptions: vec![perception],
            syncs: Vec::new(),
        };
        let channels = if count == 1 { "channel" } else { "channels" };
        Self {
            experience,
            holds: format!("a texture of {count} {channels}, {keyframes} keyframes; {description}"),
            keys,
        }
    }

    /// The lines of a scene that read its file.
    pub fn section(&self, path: &Path) -> String {
        format!(
            "[surface]\nprofile = \"recorded\"\n{}file = {}",
            self.keys,
            name(path)
        )
    }
}

/// What it is to be felt on: the display. The standard has no type for electroactive polymers.
fn device() -> ReferenceDevice {
    ReferenceDevice {
        id: DEVICE,
        name: "Ridgelink display: 50 ICPF actuators (ionic polymer, electroactive), 5 × 10"
            .to_owned(),
        minimum_frequency: Some(0.0),
        maximum_frequency: Some(f64::from(SILENT_FROM_HZ)),
        maximum_voltage: Some(FULL_V),
        kind: Some("Unknown".to_owned()),
    }
}

fn channel(id: u32, trace: Trace) -> Channel {
    let per_metre = trace.per_metre;
    let sample_count = u32::try_from(trace.points.len()).ok();
    let keyframe = |(at, amplitude): (u64, f64)| Keyframe {
        amplitude_modulation: Some((amplitude * PER_UNIT).round() / PER_UNIT),
        frequency_modulation: None,
        relative_position: Some(at),
    };
    let effect = Effect {
        id: None,
        effect_type: EffectType::Basis,
        position: Some(0),
        phase: None,
        base_signal: None,
        keyframes: trace.points.into_iter().map(keyframe).collect(),
    };
    Channel {
        id,
        description: trace.description,
        reference_device_id: Some(DEVICE),
        gain: trace.gain,
        mixing_coefficient: 1.0,
        actuator_resolution: Some(GRID),
        body_part_target: Some(vec!["Index".to_owned(), "Third Phalanx".to_owned()]),
        frequency_sampling: per_metre,
        sample_count: per_metre.and(sample_count),
        bands: vec![Band {
            band_type: BandType::Curve,
            curve_type: Some(CurveType::Linear),
            lower_frequency_limit: 0.0,
            upper_frequency_limit: MOST_FREQUENCY,
            effects: vec![effect],
        }],
    }
}
