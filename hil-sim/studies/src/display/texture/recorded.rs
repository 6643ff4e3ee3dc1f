//! Recorded surfaces: what is played of them, against what gauges felt at the same places.
//!
//! A recording has no heights. Its surface is what each of its gauges felt, as a function of place: skin, sensor and noise
//! included. The hand moves with the arm, or over the same ground from its beginning, faster. Coherence and distance are
//! means over the gauges. What has no period is left out: nothing is played of it.

use std::ops::Range;

use hil_sim_core::run::recording::Engine;
use hil_sim_core::scene::{Gauges, Motion, Scene, SceneError, Series, Waveform};
use protocol::{GAUGES, Rendering};

use super::likeness::{TICKS_HZ, coherence, distance_db, segments, thirds_db};
use super::{Measured, Row, SHIFTS, families, is_carried, played, said};
use crate::jury::folder::Entry;
use crate::study::{Progress, Study, Table};

/// By then the sensor stands by λ, in s.
const FROM_S: f64 = 1.0;
/// From there on the stimulus is looked at: it has faded in.
const FADED_IN_S: f64 = 0.1;
/// Looked at for so long, in s, and no less.
const LOOKED_S: Range<f64> = 1.0..10.0;
/// A hand's speed over the arm's that is not the arm's.
const FASTER: f64 = 1.5;
/// Between two looks at where the arm is, in s.
const STEP_S: f64 = 1e-3;

/// Why a recording cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum RecordedError {
    /// It is computed, and has heights.
    #[error(
        "{0}: its gauges and its motion must be recorded (kind = \"recorded\" under [gauges] and [motion])"
    )]
    NotRecorded(String),
    /// A place has more than one voltage.
    #[error(
        "{name}: the arm turns back at {at_s:.3} s, and a place is to be met once: cut the recording into strokes"
    )]
    Turns {
        /// The scene.
        name: String,
        /// When.
        at_s: f64,
    },
    /// There is nothing to look at.
    #[error(
        "{name}: lasts {lasts_s:.1} s and moves over {ground_mm:.1} mm: too little, {least_s:.1} s of movement are needed",
        least_s = FROM_S + FADED_IN_S + LOOKED_S.start
    )]
    TooShort {
        /// The scene.
        name: String,
        /// Its duration in s.
        lasts_s: f64,
        /// Its ground in mm.
        ground_mm: f64,
    },
    /// Nothing is played of any of them.
    #[error(
        "no recording has a period, and nothing is played of what has none: give the truth of one in mm, above 0"
    )]
    NoPeriod,
    /// It cannot be run.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// What is measured of a folder's recordings.
#[derive(Clone, Debug)]
pub struct Recorded(Measured);

/// Measures the scenes of a folder's list.
pub fn measure(
    scenes: &[(Entry, Scene)],
    progress: &impl Progress,
) -> Result<Recorded, RecordedError> {
    let takes = scenes.iter().map(|(entry, scene)| Take::new(entry, scene));
    let takes: Vec<Take> = takes.collect::<Result<_, _>>()?;
    if takes.iter().all(|take| take.wavelength_mm == 0.0) {
        return Err(RecordedError::NoPeriod);
    }
    progress.begin(takes.len());
    let rows = progress.each(&takes, Take::rows)?;
    Ok(Recorded(Measured {
        rows: rows.into_iter().flatten().collect(),
        pairs: Vec::new(),
    }))
}

/// A recording: one stroke one way.
struct Take<'a> {
    entry: &'a Entry,
    scene: &'a Scene,
    gauges: &'a Waveform,
    /// When the arm was where: s over mm.
    instants: Series,
    wavelength_mm: f64,
}

impl<'a> Take<'a> {
    fn new(entry: &'a Entry, scene: &'a Scene) -> Result<Self, RecordedError> {
        let name = || entry.name.clone();
        let (Gauges::Recorded(gauges), Motion::Recorded(_)) = (&scene.gauges, &scene.motion) else {
            return Err(RecordedError::NotRecorded(name()));
        };
        let instants =
            instants(scene).map_err(|at_s| RecordedError::Turns { name: name(), at_s })?;
        let take = Self {
            entry,
            scene,
            gauges,
            instants,
            wavelength_mm: entry.truth.at(scene.duration_s),
        };
        if take.ground_mm() == 0.0 || take.hands().iter().any(|hand| hand.looked_at.is_empty()) {
            return Err(RecordedError::TooShort {
                name: name(),
                lasts_s: scene.duration_s,
                ground_mm: take.ground_mm(),
            });
        }
        Ok(take)
    }

    fn rows(&self) -> Result<Vec<Row>, SceneError> {
        if self.wavelength_mm == 0.0 {
            return Ok(Vec::new());
        }
        let said = said(self.scene)?;
        let mut rows = Vec::new();
        for hand in self.hands() {
            let place_mm = |t_s: f64| self.place_mm(&hand, t_s);
            let played = Rendering::ALL
                .map(|rendering| played(&said, place_mm, &hand.looked_at, rendering, 0.0));
            let likeness = Rendering::ALL
                .into_iter()
                .zip(self.likeness(&hand, &played));
            rows.extend(likeness.map(|(rendering, (coherence, distance_db))| Row {
                surface: self.entry.name.clone(),
                family: self.entry.family.clone(),
                unseen: true,
                engine: Engine::Native,
                speeds_mm_s: (to_a_tenth(self.speed_mm_s()), to_a_tenth(hand.speed_mm_s)),
                delay_ms: 0.0,
                rendering,
                coherence,
                distance_db,
            }));
        }
        Ok(rows)
    }

    /// Coherence and distance of each rendering, at each gauge's best shift of place, means over the gauges.
    fn likeness(&self, hand: &Hand, played: &[Vec<f64>; 3]) -> [(f64, f64); 3] {
        let spectra = played.each_ref().map(|played| segments(played));
        let mut best = [[0.0_f64; GAUGES]; 3];
        for shift in 0..SHIFTS {
            let felt = self.felt(hand, self.wavelength_mm * shift as f64 / SHIFTS as f64);
            for (gauge, felt) in felt.iter().enumerate() {
                let felt = segments(felt);
                for (best, spectrum) in best.iter_mut().zip(&spectra) {
                    best[gauge] = best[gauge].max(coherence(&felt, spectrum));
                }
            }
        }
        let felt = self.felt(hand, 0.0).map(|felt| thirds_db(&felt));
        let mean = |of: &dyn Fn(usize) -> f64| (0..GAUGES).map(of).sum::<f64>() / GAUGES as f64;
        [0, 1, 2].map(|at| {
            let thirds = thirds_db(&played[at]);
            (
                mean(&|gauge| best[at][gauge]),
                mean(&|gauge| distance_db(&thirds, &felt[gauge])),
            )
        })
    }

    /// What each gauge felt where the hand is, so far ahead of it, at each tick that is looked at.
    fn felt(&self, hand: &Hand, shift_mm: f64) -> [Vec<f64>; GAUGES] {
        let mut felt = [(); GAUGES].map(|()| Vec::new());
        let (mut row, mut sample) = (0, 0);
        let ahead_mm = shift_mm.copysign(self.speed_mm_s());
        for tick in hand.looked_at.clone() {
            let x_mm = self.place_mm(hand, tick as f64 / TICKS_HZ) + ahead_mm;
            row = self.instants.row(x_mm, row);
            let at_s = self.instants.value(row, 0, x_mm);
            let mut volts = [0.0; GAUGES];
            self.gauges.read(at_s, &mut sample, &mut volts);
            for (felt, volts) in felt.iter_mut().zip(volts) {
                felt.push(volts);
            }
        }
        felt
    }

    /// With the arm, and over its ground from the beginning, faster.
    fn hands(&self) -> [Hand; 2] {
        let until_s = self.scene.duration_s;
        let faster_mm_s = FASTER * self.speed_mm_s();
        let passed_s = FROM_S + (self.ground_mm() / faster_mm_s).abs();
        [
            Hand::new(None, self.speed_mm_s(), until_s),
            Hand::new(Some(self.begins_mm()), faster_mm_s, until_s.min(passed_s)),
        ]
    }

    fn place_mm(&self, hand: &Hand, t_s: f64) -> f64 {
        match hand.from_mm {
            None => self.scene.motion.position_mm(t_s),
            Some(from_mm) => from_mm + hand.speed_mm_s * (t_s - FROM_S).max(0.0),
        }
    }

    fn begins_mm(&self) -> f64 {
        self.scene.motion.position_mm(0.0)
    }

    /// From the first place to the last, in mm; below 0 if the arm goes back.
    fn ground_mm(&self) -> f64 {
        self.scene.motion.position_mm(self.scene.duration_s) - self.begins_mm()
    }

    /// The arm's mean speed while it moves, in mm/s; below 0 if it goes back.
    fn speed_mm_s(&self) -> f64 {
        self.ground_mm() / (self.instants.at.len() as f64 * STEP_S)
    }
}

struct Hand {
    /// Where it begins, at [`FROM_S`]; None: it moves with the arm.
    from_mm: Option<f64>,
    speed_mm_s: f64,
    looked_at: Range<u64>,
}

impl Hand {
    /// None is looked at if there is too little of it.
    fn new(from_mm: Option<f64>, speed_mm_s: f64, until_s: f64) -> Self {
        let from_s = FROM_S + FADED_IN_S;
        let until_s = until_s.min(from_s + LOOKED_S.end);
        let ticks = |t_s: f64| (t_s * TICKS_HZ) as u64;
        let looked_at = if until_s - from_s >= LOOKED_S.start {
            ticks(from_s)..ticks(until_s)
        } else {
            0..0
        };
        Self {
            from_mm,
            speed_mm_s,
            looked_at,
        }
    }
}

fn to_a_tenth(speed_mm_s: f64) -> f64 {
    (10.0 * speed_mm_s).round() / 10.0
}

/// When the arm was where, in rising order of places; Err: when it turned back.
fn instants(scene: &Scene) -> Result<Series, f64> {
    let mut passed: Vec<(f64, f64)> = Vec::new();
    let mut way = 0.0;
    for step in 0..=(scene.duration_s / STEP_S) as u32 {
        let at_s = f64::from(step) * STEP_S;
        let x_mm = scene.motion.position_mm(at_s);
        if let Some(&(before_mm, _)) = passed.last() {
            if x_mm == before_mm {
                continue;
            }
            let goes = (x_mm - before_mm).signum();
            if way == -goes {
                return Err(at_s);
            }
            way = goes;
        }
        passed.push((x_mm, at_s));
    }
    if way < 0.0 {
        passed.reverse();
    }
    let (at, values) = passed.into_iter().unzip();
    Ok(Series {
        at,
        values,
        width: 1,
    })
}

impl Study for Recorded {
    const NAME: &'static str = "texture-recorded";

    fn table(&self) -> Option<Table> {
        self.0.table()
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let mut csvs = self.0.csvs();
        csvs.truncate(1);
        csvs
    }

    fn picture(&self) -> String {
        self.0.picture()
    }

    fn is_met(&self) -> bool {
        let rows = &self.0.rows;
        let mut families = families(rows).into_iter();
        families.all(|family| is_carried(rows, Engine::Native, family, true))
    }
}
