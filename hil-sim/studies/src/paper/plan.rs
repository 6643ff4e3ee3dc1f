//! What is run, and where it is found afterwards.

use protocol::Method;

use crate::paper::published::{CELLS_MM, SPEEDS_MM_S};
use crate::psychophysics::{self, FREQUENCY_HZ, Job, PEAK_MM_S, Plan, SNR_DB};
use hil_sim_core::judge::JudgedEstimate;
use hil_sim_core::judge::estimates::judge;
use hil_sim_core::judge::truth::Truth;
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::{Estimator, Gauges, Kinematic, Motion, Scene, Specimen};

/// The paper's two seconds of estimates, and what filters and boards need before.
const CELL_S: f64 = 2.3;
/// What the two seconds leave out at the beginning.
const SETTLED_S: f64 = 0.3;
/// λ and v of the seven points that Fig. 6 has beside Table I's: the paper does not say which it took; these
/// fill the gaps between Table I's frequencies.
const FURTHER: [(f64, f64); 7] = [
    (1.0, 40.0),
    (1.0, 45.0),
    (1.0, 55.0),
    (1.0, 60.0),
    (1.0, 65.0),
    (2.0, 40.0),
    (2.0, 56.0),
];
/// The gauge that is counted.
pub const COUNTED_GAUGE: usize = 2;
/// Fig. 5: A, λ, the hand's peak α and its frequency fᵥ.
pub const FIG_5_WINDOW_MS: u16 = 200;
pub const FIG_5_MM: f64 = 2.0;
pub const FIG_5_PEAK_MM_S: f64 = 100.0;
pub const FIG_5_HAND_HZ: f64 = 1.0;
/// Fig. 7: λ. Its hand is that of the experiments with people.
pub const FIG_7_MM: f64 = 2.0;
/// Fig. 8: the specimens, and where they meet.
pub const FIG_8_MM: [f64; 2] = [1.0, 4.0];
pub const FIG_8_BOUNDARY_MM: f64 = 60.0;
/// Fig. 8: the speed, which the paper does not give: the highest of Table I's. (At 50 mm/s a window
/// holds exactly two crossings of 4 mm, and a count does not roam.)
pub const FIG_8_SPEED_MM_S: f64 = 70.0;

/// λ and v of Table I's cells and Fig. 6's further points.
fn cells() -> impl Iterator<Item = (f64, f64)> {
    let table_1 = SPEEDS_MM_S
        .into_iter()
        .flat_map(|speed| CELLS_MM.map(|mm| (mm, speed)));
    table_1.chain(FURTHER)
}

/// All jobs: those of the experiments with people, then the rest.
pub fn jobs(plan: &Plan) -> Vec<Job> {
    let seed = plan.seed;
    let mut jobs = psychophysics::jobs(plan);
    jobs.extend([fig_7(seed), fig_5(seed), fig_8(seed)].map(Job::pair));
    jobs.extend(cells().map(|(mm, speed_mm_s)| {
        Job::pair(Scene {
            seed,
            duration_s: CELL_S,
            ..Scene::constant(mm, speed_mm_s)
        })
    }));
    jobs
}

fn noisy() -> Gauges {
    Gauges::Kinematic(Kinematic {
        snr_db: Some(SNR_DB),
        ..Kinematic::default()
    })
}

fn fig_5(seed: u64) -> Scene {
    Scene {
        name: "paper-fig-5".into(),
        seed,
        duration_s: 2.5,
        motion: Motion::Sinusoid {
            amplitude_mm_s: FIG_5_PEAK_MM_S,
            frequency_hz: FIG_5_HAND_HZ,
        },
        estimator: Estimator {
            method: Method::Counting,
            window_ms: FIG_5_WINDOW_MS,
            ..Estimator::default()
        },
        ..Scene::constant(FIG_5_MM, FIG_5_PEAK_MM_S)
    }
}

fn fig_7(seed: u64) -> Scene {
    Scene {
        name: "paper-fig-7".into(),
        seed,
        duration_s: 3.0 / FREQUENCY_HZ,
        motion: Motion::Sinusoid {
            amplitude_mm_s: PEAK_MM_S,
            frequency_hz: FREQUENCY_HZ,
        },
        gauges: noisy(),
        ..Scene::constant(FIG_7_MM, PEAK_MM_S)
    }
}

fn fig_8(seed: u64) -> Scene {
    let mut scene = Scene {
        name: "paper-fig-8".into(),
        seed,
        duration_s: 1.7,
        gauges: noisy(),
        ..Scene::constant(FIG_8_MM[0], FIG_8_SPEED_MM_S)
    };
    let specimens = FIG_8_MM.into_iter().zip([FIG_8_BOUNDARY_MM, f64::INFINITY]);
    let specimen = |(wavelength_mm, length_mm)| Specimen {
        wavelength_mm,
        length_mm,
    };
    scene.surface.specimens = specimens.map(specimen).collect();
    scene
}

/// A constant speed over one specimen.
#[derive(Clone, Copy)]
pub struct Cell<'a> {
    pub wavelength_mm: f64,
    pub speed_mm_s: f64,
    pub recording: &'a Recording,
}

pub struct Runs<'a> {
    pub people: &'a [Recording],
    pub fig_7: &'a Recording,
    pub fig_5: &'a Recording,
    pub fig_8: &'a Recording,
    /// Table I's cells, speed by speed, then Fig. 6's further points.
    pub cells: Vec<Cell<'a>>,
}

impl<'a> Runs<'a> {
    /// Sorts what [`jobs`] left.
    pub fn new(plan: &Plan, recordings: &'a [Recording]) -> Self {
        let (people, rest) = recordings.split_at(psychophysics::jobs(plan).len());
        let [fig_7, fig_5, fig_8, rest @ ..] = rest else {
            panic!("a recording for each job");
        };
        let cells = cells()
            .zip(rest)
            .map(|((wavelength_mm, speed_mm_s), recording)| Cell {
                wavelength_mm,
                speed_mm_s,
                recording,
            });
        Self {
            people,
            fig_7,
            fig_5,
            fig_8,
            cells: cells.collect(),
        }
    }
}

impl Cell<'_> {
    pub fn frequency_hz(&self) -> f64 {
        self.speed_mm_s / self.wavelength_mm
    }

    /// The estimates of its last two seconds, beside the truth.
    pub fn estimates(&self) -> Vec<JudgedEstimate> {
        let wavelength_mm = self.wavelength_mm;
        let mut estimates = estimates(self.recording, &|_| wavelength_mm);
        estimates.retain(|estimate| estimate.t_s >= SETTLED_S);
        estimates
    }
}

/// λ̂, if the default estimator stands by it.
pub fn valid_mm(estimate: &JudgedEstimate) -> Option<f64> {
    estimate.wavelength_mm.filter(|_| estimate.valid)
}

/// A run's estimates beside the truth.
pub fn estimates(recording: &Recording, wavelength_mm: &dyn Fn(f64) -> f64) -> Vec<JudgedEstimate> {
    judge(&Truth::new("paper", "", wavelength_mm), recording).0
}
