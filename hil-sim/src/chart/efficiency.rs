//! How near the bank comes to the Cramér–Rao bound for the travel that it used: steady speeds, 5–100 Hz,
//! 20 dB, one gauge and five, a sine and a trapezoid.

pub mod picture;

use crate::scene::{Gauges, Kinematic, Motion, Profile, Scene, SceneError};

use super::bound::{Tone, bank_equivalent_mm, bank_travel_mm};
use super::contest::{self, Contestant};
use super::settings::{Knob, Setting};
use protocol::{Method, SensorConfiguration};

/// The frequencies v/λ, in Hz.
pub const FREQUENCIES_HZ: [f64; 10] = [5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0, 80.0, 100.0];
/// The wavelengths at each, in mm: not the bank's own.
const WAVELENGTHS_MM: [f64; 3] = [1.1, 1.6, 2.3];
/// Scenes that [`measure`] runs: both profiles, each frequency, each wavelength.
pub const SCENES: u64 = 2 * (FREQUENCIES_HZ.len() * WAVELENGTHS_MM.len()) as u64;
/// The goal: error over bound, one gauge.
pub const GOAL: f64 = 1.2;
const SNR_DB: f64 = 20.0;
/// Travels of the kernel in a scene, about as many errors independent of one another.
const KERNELS: f64 = 200.0;
/// The longest and the shortest scene, in s.
const DURATION_S: (f64, f64) = (20.0, 600.0);

/// Who is asked: one gauge, of gain 1, then all.
const ASKED: [(u8, &[usize]); 2] = [(0b00001, &[0]), (0b11111, &[0, 1, 2, 3, 4])];

/// A frequency's errors, over its wavelengths, beside the bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// "sine" or "trapezoid".
    pub profile: &'static str,
    /// Gauges asked.
    pub gauges: usize,
    /// v/λ.
    pub frequency_hz: f64,
    /// The bank's RMS error in %.
    pub rms_percent: Option<f64>,
    /// The part of it that stays, in %: the root of the mean square of the wavelengths' biases.
    pub bias_percent: Option<f64>,
    /// Mean share of valid estimates, the kernel's first travel counted as without.
    pub valid_share: f64,
    /// The bound in % for the travel that holds 99 % of the kernel's weight.
    pub kernel_bound_percent: f64,
    /// The bound in % for the even window with the kernel's error in white noise.
    pub equivalent_bound_percent: f64,
}

impl Row {
    /// Error over the bound that the goal is about.
    pub fn ratio(&self) -> Option<f64> {
        Some(self.rms_percent? / self.kernel_bound_percent)
    }

    /// Whether the goal is about this row, and it meets it.
    pub fn meets_goal(&self) -> Option<bool> {
        (self.gauges == 1).then(|| self.ratio().is_some_and(|ratio| ratio <= GOAL))
    }
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
                method: Method::Bank,
                knob: Knob::GaugeSet,
                value: u16::from(gauges),
            })
        })
        .collect();
    let scenes: Vec<&Scene> = scenes.iter().collect();
    let summaries = contest::run(&contestants, &scenes, kernel_s, done)?;
    let mut rows = Vec::new();
    for (asked, (_, gauges)) in ASKED.iter().enumerate() {
        let mut cells = summaries.chunks(WAVELENGTHS_MM.len());
        for (profile, _) in &profiles {
            for frequency_hz in FREQUENCIES_HZ {
                let cell: Vec<_> = cells
                    .next()
                    .unwrap_or_default()
                    .iter()
                    .map(|s| s[asked])
                    .collect();
                let errors: Option<Vec<f64>> = cell.iter().map(|s| s.rms_percent).collect();
                let biases: Option<Vec<f64>> = cell.iter().map(|s| s.bias_percent).collect();
                rows.push(Row {
                    profile,
                    gauges: gauges.len(),
                    frequency_hz,
                    rms_percent: errors.map(|errors| root_mean_square(&errors)),
                    bias_percent: biases.map(|biases| root_mean_square(&biases)),
                    valid_share: cell.iter().filter_map(|s| s.valid_share).sum::<f64>()
                        / WAVELENGTHS_MM.len() as f64,
                    kernel_bound_percent: bound(gauges, frequency_hz, bank_travel_mm),
                    equivalent_bound_percent: bound(gauges, frequency_hz, bank_equivalent_mm),
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
    scene.duration_s = (KERNELS * kernel_s(&scene)).clamp(DURATION_S.0, DURATION_S.1);
    // A seed of its own for each.
    scene.seed = (wavelength_mm * 10.0 + frequency_hz * 1_000.0) as u64;
    scene
}

/// How long the travel of the kernel takes in a steady scene, in s. Before that the bank has used less of
/// it than the bound is of.
fn kernel_s(scene: &Scene) -> f64 {
    let travel_percent = SensorConfiguration::DEFAULT.bank_travel_percent;
    let wavelength_mm = scene.surface.specimens[0].wavelength_mm;
    bank_travel_mm(travel_percent, wavelength_mm) / scene.motion.velocity_mm_s(0.0)
}

/// The bound over the wavelengths, for a travel of the default bank.
fn bound(gauges: &[usize], frequency_hz: f64, travel_mm: fn(u16, f64) -> f64) -> f64 {
    let travel_percent = SensorConfiguration::DEFAULT.bank_travel_percent;
    root_mean_square(&WAVELENGTHS_MM.map(|wavelength_mm| {
        let speed_mm_s = wavelength_mm * frequency_hz;
        let tone = Tone {
            wavelength_mm,
            speed_mm_s,
            snr_db: SNR_DB,
            gauges,
        };
        tone.relative_percent(travel_mm(travel_percent, wavelength_mm) / speed_mm_s)
    }))
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// The rows as CSV.
///
/// # Errors
/// None in practice: it is written to memory.
pub fn csv(rows: &[Row]) -> Result<String, csv::Error> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record([
        "profile",
        "gauges",
        "frequency_hz",
        "rms_percent",
        "bias_percent",
        "valid_share",
        "kernel_bound_percent",
        "ratio",
        "equivalent_bound_percent",
        "equivalent_ratio",
    ])?;
    let field = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
    for row in rows {
        let equivalent = row
            .rms_percent
            .map(|rms| rms / row.equivalent_bound_percent);
        table.write_record([
            row.profile.to_owned(),
            row.gauges.to_string(),
            row.frequency_hz.to_string(),
            field(row.rms_percent),
            field(row.bias_percent),
            field(Some(row.valid_share)),
            field(Some(row.kernel_bound_percent)),
            field(row.ratio()),
            field(Some(row.equivalent_bound_percent)),
            field(equivalent),
        ])?;
    }
    let bytes = table
        .into_inner()
        .map_err(|error| csv::Error::from(error.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
