//! What a scene has to export: its surface, and what the engine `native` makes of it.

use std::mem;

use firmware_sensor::SCAN_RATE_HZ;
use hil_sim_core::native;
use hil_sim_core::plant::gauges::PLACES_MM;
use hil_sim_core::plant::surface::{GRID_MM, Surface};
use hil_sim_core::run::observer::{RunEvent, RunObserver};
use hil_sim_core::run::recording::{ACTUATORS, ZERO_VOLT};
use hil_sim_core::scene::{Motion, Scene};
use protocol::GAUGES;

use super::texture::{Made, Trace};
use super::{Along, ExportError, Group, LONGEST_MM, Samples, Settings};

/// Points of a texture in a metre, and their spacing in µm: as the simulator stores a surface.
const PER_METRE: u32 = (1e3 / GRID_MM) as u32;
const SPACING_UM: u64 = (GRID_MM * 1e3) as u64;
const _: () = assert!(PER_METRE as u64 * SPACING_UM == 1_000_000);
/// Points beside the outermost gauges' ways, on either side.
const BESIDE: f64 = 2.0;
/// How often a hand's place is looked at, per s.
const LOOKS_HZ: f64 = 1_000.0;
const SCAN_NS: u64 = 1_000_000_000 / SCAN_RATE_HZ as u64;
/// Codes of the simulated ADC have 12 bits; a WAV file's samples have 16.
const TO_16_BITS: i32 = 16;
const MID_CODE: i32 = 2_048;
const MID_WORD: i32 = ZERO_VOLT as i32;
/// mm at full scale of samples of 32 bits in µm.
pub(super) const PLACE_KEYS: &str = "kind = \"recorded\"\nmm_per_unit = 2147483.648\n";
pub(super) const PLACE_SCALE: &str = "a step is 1 µm";
pub(super) const GAUGE_KEYS: &str = "kind = \"recorded\"\nvolts_per_unit = 1.65\n";
pub(super) const GAUGE_SCALE: &str = "full scale is ± 1.65 V about 1.65 V";

/// A texture over the way of the scene's gauges.
struct Felt {
    start_mm: f64,
    /// What a point feels, 1 being a fundamental's amplitude, [`GRID_MM`] apart.
    heights: Vec<f64>,
    /// The largest of them, without its sign.
    most: f64,
}

impl Felt {
    fn of(scene: &Scene) -> Result<Self, ExportError> {
        let surface = Surface::new(&scene.surface, 0.0);
        let (low_mm, high_mm) = way_mm(&scene.motion, scene.duration_s);
        let first = ((low_mm + PLACES_MM[0]) / GRID_MM).floor() - BESIDE;
        let last = ((high_mm + PLACES_MM[GAUGES - 1]) / GRID_MM).ceil() + BESIDE;
        let length_mm = (last - first) * GRID_MM;
        if length_mm > LONGEST_MM {
            return Err(ExportError::TooLong { length_mm });
        }
        let place_mm = |point: i64| point as f64 / f64::from(PER_METRE) * 1e3;
        let points = first as i64..=last as i64;
        let heights: Vec<f64> = points
            .map(|point| f64::from(surface.feel(place_mm(point), 0)))
            .collect();
        let most = heights
            .iter()
            .fold(0.0, |most: f64, felt| most.max(felt.abs()));
        Ok(Self {
            start_mm: place_mm(first as i64),
            heights,
            // A flat surface has no scale.
            most: if most > 0.0 { most } else { 1.0 },
        })
    }
}

/// From where to where the hand goes, in mm.
fn way_mm(motion: &Motion, duration_s: f64) -> (f64, f64) {
    let looks = 0..=(duration_s * LOOKS_HZ).ceil() as u64;
    looks
        .map(|look| motion.position_mm(look as f64 / LOOKS_HZ))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x_mm| {
            (low.min(x_mm), high.max(x_mm))
        })
}

/// The scene's surface, as a point feels it through the contact. Fails if it is too long.
pub fn texture(scene: &Scene, settings: &Settings) -> Result<Made, ExportError> {
    let felt = Felt::of(scene)?;
    let points = (0..).map(|point: u64| point * SPACING_UM);
    let amplitudes = felt.heights.iter().map(|height| height / felt.most);
    let trace = Trace {
        description: "surface".to_owned(),
        gain: felt.most,
        per_metre: Some(PER_METRE),
        points: points.zip(amplitudes).collect(),
    };
    let description = format!(
        "surface of the scene {:?} from {} mm on, 1 is the amplitude of its fundamental",
        scene.name, felt.start_mm
    );
    let keys = format!("felt_per_unit = 1.0\nshift_mm = {:?}\n", felt.start_mm);
    Ok(Made::new(&settings.date, description, vec![trace], keys))
}

/// What is written down of a run.
#[derive(Default)]
struct Tape {
    scans: u64,
    is_uneven: bool,
    gauges: Vec<i16>,
    force: Vec<i16>,
    arm_um: Vec<i32>,
    hand_um: Vec<i32>,
    words: Vec<i16>,
    last: Option<[u16; ACTUATORS]>,
}

impl RunObserver for Tape {
    fn see(&mut self, event: RunEvent<'_>) {
        match event {
            RunEvent::Scan(scan) => {
                self.is_uneven |= scan.at_ns != self.scans * SCAN_NS;
                self.scans += 1;
                let sample = |code: u16| ((i32::from(code) - MID_CODE) * TO_16_BITS) as i16;
                let [gauges @ .., force] = scan.codes;
                self.gauges.extend(gauges.map(sample));
                self.force.push(sample(force));
                self.arm_um.push(micrometres(scan.position_mm));
            }
            RunEvent::Tick(tick) => {
                self.hand_um.push(micrometres(tick.position_mm));
                let words = self.last.unwrap_or([ZERO_VOLT; ACTUATORS]);
                self.words.extend(words.map(sample_of));
            }
            // In the same instant as the tick, if there is something to send.
            RunEvent::Output(output) => {
                self.last = Some(output.words);
                let tick = self.words.len().saturating_sub(ACTUATORS);
                for (sample, word) in self.words[tick..].iter_mut().zip(output.words) {
                    *sample = sample_of(word);
                }
            }
            _ => {}
        }
    }
}

const fn sample_of(word: u16) -> i16 {
    (word as i32 - MID_WORD) as i16
}

/// Saturates 2 km away, where no scene goes: 600 s at 1000 mm/s.
fn micrometres(x_mm: f64) -> i32 {
    (x_mm * 1e3).round() as i32
}

/// The surface over place; gauges, force, arm, hand and actuators over time. Fails if the surface is too long, or
/// the scene can't be run by this engine.
pub fn groups(scene: &Scene) -> Result<Vec<Group>, ExportError> {
    let felt = Felt::of(scene)?;
    let mut tape = Tape::default();
    native::run_before(scene, &mut tape)?;
    if tape.is_uneven {
        return Err(ExportError::Uneven(scene.name.clone()));
    }
    let tick_hz = scene.display_configuration().update_rate.hz();
    // One more, so that the file lasts as long as the scene.
    let end_s = tape.hand_um.len() as f64 / f64::from(tick_hz);
    tape.hand_um
        .push(micrometres(scene.motion.position_mm(end_s)));
    let full = f64::from(i16::MAX);
    let surface = |height: &f64| (height / felt.most * full).round() as i16;
    // Readers take 32 768 for 1.
    let per_unit = felt.most * (full + 1.0) / full;
    let scans = Along::Time {
        rate_hz: SCAN_RATE_HZ,
    };
    let ticks = Along::Time { rate_hz: tick_hz };
    let mut groups = vec![
        Group {
            name: "surface",
            along: Along::Place {
                per_metre: PER_METRE,
                start_mm: felt.start_mm,
            },
            channels: 1,
            full_scale: format!(
                "full scale is ± {per_unit:.4} of the fundamental's amplitude, a second of it is 1 m"
            ),
            keys: Some((
                "surface",
                format!(
                    "profile = \"recorded\"\nmm_per_sample = {GRID_MM:?}\nfelt_per_unit = {per_unit:?}\nshift_mm = {:?}\n",
                    felt.start_mm
                ),
            )),
            samples: Samples::Bits16(felt.heights.iter().map(surface).collect()),
        },
        Group {
            name: "gauges",
            along: scans,
            channels: GAUGES as u16,
            full_scale: GAUGE_SCALE.to_owned(),
            keys: Some(("gauges", GAUGE_KEYS.to_owned())),
            samples: Samples::Bits16(mem::take(&mut tape.gauges)),
        },
    ];
    if scene.force.present {
        groups.push(Group {
            name: "force",
            along: scans,
            channels: 1,
            full_scale: GAUGE_SCALE.to_owned(),
            keys: None,
            samples: Samples::Bits16(mem::take(&mut tape.force)),
        });
    }
    let place = |name, along, samples, keys: Option<&'static str>| Group {
        name,
        along,
        channels: 1,
        full_scale: PLACE_SCALE.to_owned(),
        keys: keys.map(|keys| ("motion", keys.to_owned())),
        samples: Samples::Bits32(samples),
    };
    groups.push(place("arm", scans, tape.arm_um, None));
    groups.push(place("hand", ticks, tape.hand_um, Some(PLACE_KEYS)));
    groups.push(Group {
        name: "actuators",
        along: ticks,
        channels: ACTUATORS as u16,
        full_scale: "full scale is ± 5 V".to_owned(),
        keys: None,
        samples: Samples::Bits16(tape.words),
    });
    Ok(groups)
}
