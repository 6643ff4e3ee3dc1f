//! How near the default estimator comes to the Cramér–Rao bound for the travel that it used: steady speeds,
//! 5–100 Hz, 20 dB, one gauge and five, a sine and a trapezoid.
//!
//! It fits so many waves, evenly weighted, a constant, a slope, a cosine and a sine to each gauge: the bound
//! is over that many, with the slope unknown. An estimate does not say how many it took, so the longest fit
//! that is configured counts: where a fit was shorter, the ratio is above what it should be.

mod picture;

use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};
use hil_sim_core::scene::{Gauges, Kinematic, Motion, Profile, Scene, SceneError};

use super::benchmark::{self, Contestant};
use super::bound::{Tone, WAVES, window_mm};
use super::settings::{Knob, Setting};
use protocol::SensorConfiguration;

/// The frequencies v/λ.
const FREQUENCIES_HZ: [f64; 10] = [5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0, 80.0, 100.0];
/// The wavelengths at each: on no grid of candidates.
const WAVELENGTHS_MM: [f64; 3] = [1.1, 1.6, 2.3];
const PROFILES: [(&str, Profile); 2] = [("sine", Profile::Sine), ("trapezoid", Profile::Trapezoid)];
/// The goals, five gauges: error over bound, mean over the cells, and of the worst cell.
const MEAN_GOAL: f64 = 1.10;
const WORST_GOAL: f64 = 1.25;
const SNR_DB: f64 = 20.0;
/// Windows in a scene, about as many errors independent of one another: a ratio is then known to
/// 1/√(2 · 300) = 4 %.
const WINDOWS: f64 = 300.0;
/// The shortest and the longest scene.
const DURATION_S: (f64, f64) = (60.0, 600.0);
/// Before this nothing is judged: what looks for hum and health is still starting.
const START_S: f64 = 2.0;

/// Who is asked: one gauge, of gain 1, then all.
const ASKED: [(u8, &[usize]); 2] = [(0b00001, &[0]), (0b11111, &[0, 1, 2, 3, 4])];

/// A wavelength at a frequency: error beside bound.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    wavelength_mm: f64,
    duration_s: f64,
    /// The estimator's error; none if it was never valid.
    rms_percent: Option<f64>,
    bias_percent: Option<f64>,
    valid_share: f64,
    bound_percent: f64,
}

impl Cell {
    fn ratio(&self) -> Option<f64> {
        Some(self.rms_percent? / self.bound_percent)
    }
}

/// A frequency's cells, one for each wavelength, by rising λ.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    profile: &'static str,
    gauges: usize,
    frequency_hz: f64,
    cells: Vec<Cell>,
}

impl Row {
    fn rms_percent(&self) -> Option<f64> {
        let errors: Option<Vec<f64>> = self.cells.iter().map(|cell| cell.rms_percent).collect();
        errors.map(|errors| root_mean_square(&errors))
    }

    fn bound_percent(&self) -> f64 {
        let bounds: Vec<f64> = self.cells.iter().map(|cell| cell.bound_percent).collect();
        root_mean_square(&bounds)
    }

    /// Mean and largest ratio of its cells; none if one has none.
    fn ratios(&self) -> Option<(f64, f64)> {
        ratios(self.cells.iter())
    }
}

fn ratios<'a>(cells: impl Iterator<Item = &'a Cell>) -> Option<(f64, f64)> {
    let ratios: Vec<f64> = cells.map(Cell::ratio).collect::<Option<_>>()?;
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    Some((mean, ratios.into_iter().reduce(f64::max)?))
}

/// Mean and largest ratio of the rows with so many gauges, as the goals count them; none if a cell has none.
fn standing(rows: &[Row], gauges: usize) -> Option<(f64, f64)> {
    let of_gauges = rows.iter().filter(|row| row.gauges == gauges);
    ratios(of_gauges.flat_map(|row| &row.cells))
}

/// Measures all rows.
pub fn measure(progress: &impl Progress) -> Result<Vec<Row>, SceneError> {
    let of_profile = |(_, profile): &_| {
        let of_frequency = |hz| WAVELENGTHS_MM.map(|mm| scene(profile, mm, hz));
        FREQUENCIES_HZ.map(of_frequency)
    };
    let scenes = PROFILES.each_ref().map(of_profile);
    let scenes: Vec<&Scene> = scenes.as_flattened().as_flattened().iter().collect();
    // What they cost is not asked here.
    let contestants = ASKED.map(|(gauges, _)| {
        let setting = Setting {
            method: SensorConfiguration::DEFAULT.method,
            knob: Knob::GaugeSet,
            value: u16::from(gauges),
        };
        Contestant::ours(setting, 0)
    });
    let summaries = benchmark::run(&contestants, &scenes, from_s, progress)?;
    let mut rows = Vec::new();
    for (asked, (_, gauges)) in ASKED.iter().enumerate() {
        let mut ran = scenes.iter().zip(&summaries);
        for (profile, _) in PROFILES {
            for frequency_hz in FREQUENCIES_HZ {
                let cells = WAVELENGTHS_MM.into_iter().zip(ran.by_ref());
                let cells = cells.map(|(wavelength_mm, (scene, summaries))| Cell {
                    wavelength_mm,
                    duration_s: scene.duration_s,
                    rms_percent: summaries[asked].rms_percent,
                    bias_percent: summaries[asked].bias_percent,
                    valid_share: summaries[asked].valid_share.unwrap_or_default(),
                    bound_percent: bound(gauges, wavelength_mm, frequency_hz),
                });
                rows.push(Row {
                    profile,
                    gauges: gauges.len(),
                    frequency_hz,
                    cells: cells.collect(),
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
    // A seed of its own for each place of the map; the two forms of wave there meet the same noise.
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

impl Study for Vec<Row> {
    const NAME: &'static str = "bound";

    fn table(&self) -> Option<Table> {
        const HEADS: [&str; 8] = [
            "profile",
            "v/λ, Hz:",
            "five gauges: rms %:",
            "bound %:",
            "ratio, mean:",
            "worst:",
            "one gauge: ratio, mean:",
            "worst:",
        ];
        let row = |[profile, hz, rms, bound]: [String; 4], five: Option<_>, one: Option<_>| {
            let ((mean, worst), (one_mean, one_worst)) = (five.unzip(), one.unzip());
            let ratios = [mean, worst, one_mean, one_worst].map(|ratio| number(ratio, 3));
            let cells = [profile, hz, rms, bound].into_iter();
            Record::of(&HEADS, cells.chain(ratios))
        };
        let (one, five) = self.split_at(self.len() / 2);
        let rows = one.iter().zip(five).map(|(one, five)| {
            let errors = [five.rms_percent(), Some(five.bound_percent())];
            let [rms, bound] = errors.map(|percent| number(percent, 3));
            let (profile, hz) = (five.profile.to_owned(), five.frequency_hz.to_string());
            row([profile, hz, rms, bound], five.ratios(), one.ratios())
        });
        let all = ["all", "", "", ""].map(str::to_owned);
        let all = row(all, standing(self, 5), standing(self, 1));
        Some(rows.chain([all]).collect())
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let cells = self
            .iter()
            .flat_map(|row| row.cells.iter().map(move |cell| (row, cell)));
        let rows = cells.map(|(row, cell)| {
            let (mean, worst) = row.ratios().unzip();
            Record::default()
                .with("profile", row.profile)
                .with("gauges", short(row.gauges))
                .with("frequency_hz", short(row.frequency_hz))
                .with("wavelength_mm", short(cell.wavelength_mm))
                .with("duration_s", fixed(cell.duration_s, 0))
                .with("rms_percent", fixed(cell.rms_percent, 4))
                .with("bias_percent", fixed(cell.bias_percent, 4))
                .with("valid_share", fixed(cell.valid_share, 4))
                .with("bound_percent", fixed(cell.bound_percent, 4))
                .with("ratio", fixed(cell.ratio(), 4))
                .with("ratio_mean", fixed(mean, 4))
                .with("ratio_worst", fixed(worst, 4))
        });
        vec![("", csv(rows))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }

    fn is_met(&self) -> bool {
        standing(self, 5).is_some_and(|(mean, worst)| mean <= MEAN_GOAL && worst <= WORST_GOAL)
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
        assert!(vec![row(5, [Some(0.49), Some(0.6)])].is_met());
        // Worst 1.26; mean 1.15; and a cell in which it never stood by anything.
        assert!(!vec![row(5, [Some(0.45), Some(0.63)])].is_met());
        assert!(!vec![row(5, [Some(0.55), Some(0.6)])].is_met());
        assert!(!vec![row(5, [Some(0.5), None])].is_met());
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
