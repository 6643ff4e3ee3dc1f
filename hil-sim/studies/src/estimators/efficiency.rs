//! How near the default estimator comes to the Cramér–Rao bound for the travel that it used: steady speeds,
//! 5–100 Hz, 20 dB, one gauge and five, a sine and a trapezoid.
//!
//! It fits so many waves, evenly weighted, a constant, a slope, a cosine and a sine to each gauge: the bound
//! is over that many, with the slope unknown. An estimate does not say how many it took, so the longest fit
//! that is configured counts: where a fit was shorter, the ratio is above what it should be.

pub mod picture;

use serde::Serialize;

use crate::study::{Fixed, Short, Study, Table, csv_text, number};
use hil_sim_core::scene::{Gauges, Kinematic, Motion, Profile, Scene, SceneError};

use super::benchmark;
use super::benchmark::Contestant;
use super::bound::{Tone, WAVES, window_mm};
use super::settings::{Knob, Setting};
use protocol::SensorConfiguration;

/// The frequencies v/λ, in Hz.
pub const FREQUENCIES_HZ: [f64; 10] = [5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0, 80.0, 100.0];
/// The wavelengths at each, in mm: on no grid of candidates.
const WAVELENGTHS_MM: [f64; 3] = [1.1, 1.6, 2.3];
/// Scenes that [`measure`] runs: both profiles, each frequency, each wavelength.
pub const SCENES: u64 = 2 * (FREQUENCIES_HZ.len() * WAVELENGTHS_MM.len()) as u64;
/// The goal, five gauges: mean over the cells of error over bound.
pub const MEAN_GOAL: f64 = 1.10;
/// The goal, five gauges: error over bound of the worst cell.
pub const WORST_GOAL: f64 = 1.25;
const SNR_DB: f64 = 20.0;
/// Windows in a scene, about as many errors independent of one another: a ratio is then known to
/// 1/√(2 · 300) = 4 %.
const WINDOWS: f64 = 300.0;
/// The shortest and the longest scene, in s.
const DURATION_S: (f64, f64) = (60.0, 600.0);
/// Before this, in s, nothing is judged: what looks for hum and health is still starting.
const START_S: f64 = 2.0;

/// Who is asked: one gauge, of gain 1, then all.
const ASKED: [(u8, &[usize]); 2] = [(0b00001, &[0]), (0b11111, &[0, 1, 2, 3, 4])];

/// A wavelength at a frequency: error beside bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// λ in mm.
    pub wavelength_mm: f64,
    /// How long it was rubbed, in s.
    pub duration_s: f64,
    /// The estimator's RMS error in %; none if it was never valid.
    pub rms_percent: Option<f64>,
    /// The part of it that stays, in %.
    pub bias_percent: Option<f64>,
    /// Share of valid estimates.
    pub valid_share: f64,
    /// The bound in %.
    pub bound_percent: f64,
}

impl Cell {
    /// Error over bound.
    pub fn ratio(&self) -> Option<f64> {
        Some(self.rms_percent? / self.bound_percent)
    }
}

/// A frequency's cells, one for each wavelength.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// "sine" or "trapezoid".
    pub profile: &'static str,
    /// Gauges asked.
    pub gauges: usize,
    /// v/λ.
    pub frequency_hz: f64,
    /// The cells, by rising λ.
    pub cells: Vec<Cell>,
}

impl Row {
    /// Mean of error over bound; none if a cell has none.
    pub fn mean_ratio(&self) -> Option<f64> {
        let ratios: Option<Vec<f64>> = self.cells.iter().map(Cell::ratio).collect();
        ratios.map(|ratios| ratios.iter().sum::<f64>() / ratios.len() as f64)
    }

    /// The largest of them; none if a cell has none.
    pub fn worst_ratio(&self) -> Option<f64> {
        let ratios: Option<Vec<f64>> = self.cells.iter().map(Cell::ratio).collect();
        ratios?.into_iter().reduce(f64::max)
    }

    /// RMS error in %, over the cells.
    pub fn rms_percent(&self) -> Option<f64> {
        let errors: Option<Vec<f64>> = self.cells.iter().map(|cell| cell.rms_percent).collect();
        errors.map(|errors| root_mean_square(&errors))
    }

    /// The bound in %, over the cells.
    pub fn bound_percent(&self) -> f64 {
        let bounds: Vec<f64> = self.cells.iter().map(|cell| cell.bound_percent).collect();
        root_mean_square(&bounds)
    }
}

/// Mean and largest ratio of the rows with so many gauges, as the goals count them; none if a cell has none.
pub fn standing(rows: &[Row], gauges: usize) -> Option<(f64, f64)> {
    let ratios: Option<Vec<f64>> = rows
        .iter()
        .filter(|row| row.gauges == gauges)
        .flat_map(|row| &row.cells)
        .map(Cell::ratio)
        .collect();
    let ratios = ratios?;
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    Some((mean, ratios.into_iter().reduce(f64::max)?))
}

/// Whether both goals are met.
pub fn meets_goals(rows: &[Row]) -> bool {
    standing(rows, 5).is_some_and(|(mean, worst)| mean <= MEAN_GOAL && worst <= WORST_GOAL)
}

/// Measures all rows, on all cores. `done` is told after each scene.
///
/// # Errors
/// If a scene can't be run.
pub fn measure(done: impl Fn() + Sync) -> Result<Vec<Row>, SceneError> {
    let profiles = [("sine", Profile::Sine), ("trapezoid", Profile::Trapezoid)];
    let scenes: Vec<Scene> = profiles
        .iter()
        .flat_map(|(_, profile)| {
            FREQUENCIES_HZ.iter().flat_map(move |&frequency_hz| {
                WAVELENGTHS_MM
                    .iter()
                    .map(move |&wavelength_mm| scene(profile, wavelength_mm, frequency_hz))
            })
        })
        .collect();
    let contestants: Vec<Contestant> = ASKED
        .iter()
        .map(|&(gauges, _)| {
            Contestant::Ours(Setting {
                method: SensorConfiguration::DEFAULT.method,
                knob: Knob::GaugeSet,
                value: u16::from(gauges),
            })
        })
        .collect();
    let scenes: Vec<&Scene> = scenes.iter().collect();
    let summaries = benchmark::run(&contestants, &scenes, from_s, done)?;
    let mut rows = Vec::new();
    for (asked, (_, gauges)) in ASKED.iter().enumerate() {
        let per_row = WAVELENGTHS_MM.len();
        let mut ran = scenes.chunks(per_row).zip(summaries.chunks(per_row));
        for (profile, _) in &profiles {
            for frequency_hz in FREQUENCIES_HZ {
                let (scenes, summaries) = ran.next().unwrap_or_default();
                let cells = scenes.iter().zip(summaries).zip(WAVELENGTHS_MM);
                rows.push(Row {
                    profile,
                    gauges: gauges.len(),
                    frequency_hz,
                    cells: cells
                        .map(|((scene, summaries), wavelength_mm)| Cell {
                            wavelength_mm,
                            duration_s: scene.duration_s,
                            rms_percent: summaries[asked].rms_percent,
                            bias_percent: summaries[asked].bias_percent,
                            valid_share: summaries[asked].valid_share.unwrap_or_default(),
                            bound_percent: bound(gauges, wavelength_mm, frequency_hz),
                        })
                        .collect(),
                });
            }
        }
    }
    Ok(rows)
}

fn scene(profile: &Profile, wavelength_mm: f64, frequency_hz: f64) -> Scene {
    let mut scene = Scene::constant(wavelength_mm, 1.0);
    scene.surface.profile = profile.clone();
    scene.motion = Motion::Constant {
        speed_mm_s: wavelength_mm * frequency_hz,
    };
    scene.gauges = Gauges::Kinematic(Kinematic {
        snr_db: Some(SNR_DB),
        ..Kinematic::default()
    });
    scene.duration_s = (WINDOWS * window_s(&scene)).clamp(DURATION_S.0, DURATION_S.1);
    // A seed of its own for each.
    scene.seed = (wavelength_mm * 10.0 + frequency_hz * 1_000.0) as u64;
    scene
}

/// How long a window of a steady scene takes, in s.
fn window_s(scene: &Scene) -> f64 {
    let wavelength_mm = scene.surface.specimens[0].wavelength_mm;
    window_mm(WAVES, wavelength_mm) / scene.motion.velocity_mm_s(0.0)
}

/// Before that the estimator had less travel behind it than the bound is of.
fn from_s(scene: &Scene) -> f64 {
    START_S.max(2.0 * window_s(scene))
}

fn bound(gauges: &[usize], wavelength_mm: f64, frequency_hz: f64) -> f64 {
    let speed_mm_s = wavelength_mm * frequency_hz;
    let tone = Tone {
        wavelength_mm,
        speed_mm_s,
        snr_db: SNR_DB,
        gauges,
        slope: true,
    };
    tone.relative_percent(window_mm(WAVES, wavelength_mm) / speed_mm_s)
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// A cell, with its row's mean and worst ratio.
#[derive(Serialize)]
struct Record {
    profile: &'static str,
    gauges: usize,
    frequency_hz: Short,
    wavelength_mm: Short,
    duration_s: Fixed<0>,
    rms_percent: Fixed<4>,
    bias_percent: Fixed<4>,
    valid_share: Fixed<4>,
    bound_percent: Fixed<4>,
    ratio: Fixed<4>,
    ratio_mean: Fixed<4>,
    ratio_worst: Fixed<4>,
}

impl Study for [Row] {
    const NAME: &'static str = "bound";

    fn table(&self) -> Option<Table> {
        let mut table = Table::new(&[
            "profile",
            "v/λ, Hz:",
            "five gauges: rms %:",
            "bound %:",
            "ratio, mean:",
            "worst:",
            "one gauge: ratio, mean:",
            "worst:",
        ]);
        let (one, five) = self.split_at(self.len() / 2);
        for (one, five) in one.iter().zip(five) {
            table.row([
                five.profile.to_owned(),
                five.frequency_hz.to_string(),
                number(five.rms_percent(), 3),
                number(five.bound_percent(), 3),
                number(five.mean_ratio(), 3),
                number(five.worst_ratio(), 3),
                number(one.mean_ratio(), 3),
                number(one.worst_ratio(), 3),
            ]);
        }
        let ((mean, worst), (one_mean, one_worst)) =
            (standing(self, 5).unzip(), standing(self, 1).unzip());
        let all = [mean, worst, one_mean, one_worst].map(|ratio| number(ratio, 3));
        let nothing = [String::new(), String::new(), String::new()];
        table.row(["all".to_owned()].into_iter().chain(nothing).chain(all));
        Some(table)
    }

    fn csvs(&self) -> Result<Vec<(&'static str, String)>, csv::Error> {
        let cells = self
            .iter()
            .flat_map(|row| row.cells.iter().map(move |cell| (row, cell)));
        let records = cells.map(|(row, cell)| Record {
            profile: row.profile,
            gauges: row.gauges,
            frequency_hz: Short(row.frequency_hz),
            wavelength_mm: Short(cell.wavelength_mm),
            duration_s: cell.duration_s.into(),
            rms_percent: cell.rms_percent.into(),
            bias_percent: cell.bias_percent.into(),
            valid_share: cell.valid_share.into(),
            bound_percent: cell.bound_percent.into(),
            ratio: cell.ratio().into(),
            ratio_mean: row.mean_ratio().into(),
            ratio_worst: row.worst_ratio().into(),
        });
        Ok(vec![("", csv_text(records)?)])
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        meets_goals(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(gauges: usize, errors: [Option<f64>; 2]) -> Row {
        Row {
            profile: "sine",
            gauges,
            frequency_hz: 5.0,
            cells: errors
                .map(|rms_percent| Cell {
                    wavelength_mm: 1.0,
                    duration_s: 60.0,
                    rms_percent,
                    bias_percent: None,
                    valid_share: 1.0,
                    bound_percent: 0.5,
                })
                .to_vec(),
        }
    }

    #[test]
    fn goals_are_of_the_mean_and_of_the_worst_cell_of_five_gauges() {
        // Ratios 1.0 and 1.2; one gauge may be as bad as it likes.
        let met = [row(5, [Some(0.5), Some(0.6)]), row(1, [Some(9.0), None])];
        let (mean, worst) = standing(&met, 5).unwrap();
        assert!((mean - 1.1).abs() < 1e-9 && (worst - 1.2).abs() < 1e-9);
        assert!(meets_goals(&[row(5, [Some(0.49), Some(0.6)])]));
        // Worst 1.26; mean 1.15; and a cell in which it never stood by anything.
        assert!(!meets_goals(&[row(5, [Some(0.45), Some(0.63)])]));
        assert!(!meets_goals(&[row(5, [Some(0.55), Some(0.6)])]));
        assert!(!meets_goals(&[row(5, [Some(0.5), None])]));
    }

    #[test]
    fn every_cell_is_rubbed_for_a_minute_and_three_hundred_windows_if_it_can() {
        for frequency_hz in FREQUENCIES_HZ {
            let scene = scene(&Profile::Sine, 1.6, frequency_hz);
            assert!(scene.duration_s >= 60.0);
            // 8 waves at 5 Hz take 1.6 s, 300 times that 480 s.
            assert!(scene.duration_s >= 300.0 * window_s(&scene) * 0.999);
        }
    }
}
