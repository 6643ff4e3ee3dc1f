//! Synthetic rubs: five gauges with gains, places and phases of their own on a trapezoidal grating, white
//! noise, a moving arm, and how good the estimates are that come of it.
//!
//! The grating, the gauges and the noise are those of the numerical study behind this project, which
//! `hil-sim` has too: guesses, not measurements. This one knows nothing of links, boards and scenes.

use std::f64::consts::{PI, TAU};

use firmware_sensor::{
    MICROMETRES_PER_COUNT, MID_RAIL_CODE, SCAN_RATE_HZ, SCANS_PER_SAMPLE, Scan, Sensor,
};
use protocol::{Estimate, GAUGES, Method, SensorConfiguration};

pub const GAINS: [f64; GAUGES] = [1.0, 0.8, 1.1, 0.6, 0.9];
const PLACES_MM: [f64; GAUGES] = [-3.0, -1.5, 0.0, 1.5, 3.0];
const PHASES_RAD: [f64; GAUGES] = [0.0, 0.4, -0.7, 1.1, -0.3];
/// ADC steps of a fundamental of amplitude 1 at unit gain.
pub const CODES_PER_UNIT: f64 = 0.3 / 3.3 * 4_096.0;
const BLUR_MM: f64 = 0.12;
const RAMP: f64 = 0.1;

/// How the arm moves.
#[derive(Clone, Copy, Debug)]
pub enum Motion {
    /// At a speed in mm/s.
    Constant(f64),
    /// v = peak · sin(2π f t), in mm/s and Hz.
    Sinusoid(f64, f64),
}

impl Motion {
    pub fn position_mm(self, t_s: f64) -> f64 {
        match self {
            Self::Constant(speed_mm_s) => speed_mm_s * t_s,
            Self::Sinusoid(peak_mm_s, hz) => {
                peak_mm_s / (TAU * hz) * (1.0 - (TAU * hz * t_s).cos())
            }
        }
    }

    pub fn velocity_mm_s(self, t_s: f64) -> f64 {
        match self {
            Self::Constant(speed_mm_s) => speed_mm_s,
            Self::Sinusoid(peak_mm_s, hz) => peak_mm_s * (TAU * hz * t_s).sin(),
        }
    }
}

/// A rub over a surface.
#[derive(Clone, Debug)]
pub struct Rub {
    pub motion: Motion,
    /// λ in mm, and from which place in mm on.
    pub specimens: Vec<(f64, f64)>,
    pub duration_s: f64,
    pub snr_db: Option<f64>,
    pub second_harmonic: f64,
    pub dead: Vec<usize>,
    pub saturated: Vec<usize>,
    /// Drift of all gauges relative to the signal, at 0.11 Hz.
    pub drift: f64,
    pub seed: u64,
}

impl Rub {
    pub fn new(motion: Motion, wavelength_mm: f64) -> Self {
        Self {
            motion,
            specimens: vec![(wavelength_mm, f64::NEG_INFINITY)],
            duration_s: 3.0,
            snr_db: Some(20.0),
            second_harmonic: 0.0,
            dead: vec![],
            saturated: vec![],
            drift: 0.0,
            seed: 1,
        }
    }

    fn specimen(&self, x_mm: f64) -> (f64, f64) {
        *self
            .specimens
            .iter()
            .rev()
            .find(|(_, from)| *from <= x_mm)
            .unwrap()
    }

    /// All estimates.
    pub fn estimates(&self, configuration: SensorConfiguration) -> Vec<Estimate> {
        self.feel(&mut Sensor::new(configuration))
    }

    /// All estimates of `sensor`.
    pub fn feel(&self, sensor: &mut Sensor) -> Vec<Estimate> {
        let mut noise = Noise::new(self.seed);
        let noise_codes = self.snr_db.map_or(0.0, |db| {
            CODES_PER_UNIT
                * (0.5 * 10f64.powf(-db / 10.0) * f64::from(SCAN_RATE_HZ) / 1_000.0).sqrt()
        });
        let waves: Vec<[f64; 4]> = self.specimens.iter().map(|(w, _)| harmonics(*w)).collect();
        let mut scan = |number: u64| -> Scan {
            let t_s = number as f64 / f64::from(SCAN_RATE_HZ);
            let arm_mm = self.motion.position_mm(t_s);
            let mut scan = [MID_RAIL_CODE; 6];
            for gauge in 0..GAUGES {
                let x_mm = arm_mm + PLACES_MM[gauge];
                let (wavelength_mm, from) = self.specimen(x_mm);
                let which = self.specimens.iter().position(|s| s.1 == from).unwrap();
                let start = if from.is_finite() { from } else { 0.0 };
                let theta = TAU * (x_mm - start) / wavelength_mm + PHASES_RAD[gauge];
                let mut signal = self.second_harmonic * (2.0 * theta).sin();
                for (harmonic, amplitude) in waves[which].iter().enumerate() {
                    signal += amplitude * ((2 * harmonic + 1) as f64 * theta).sin();
                }
                let drift = self.drift * (TAU * 0.11 * t_s).sin();
                let gain = match (self.dead.contains(&gauge), self.saturated.contains(&gauge)) {
                    (true, _) => 0.0,
                    (_, true) => 20.0,
                    _ => 1.0,
                };
                let codes = gain
                    * (CODES_PER_UNIT * (GAINS[gauge] * signal + drift)
                        + noise_codes * noise.normal());
                scan[gauge] = (f64::from(MID_RAIL_CODE) + codes).clamp(0.0, 4_095.0) as u16;
            }
            scan
        };
        (0..(self.duration_s * 1_000.0) as u64)
            .filter_map(|ms| {
                let first = ms * SCANS_PER_SAMPLE as u64;
                let scans = std::array::from_fn(|i| scan(first + i as u64));
                let last_s = (first + 3) as f64 / f64::from(SCAN_RATE_HZ);
                let position_um = 1_000.0 * self.motion.position_mm(last_s);
                let counts =
                    ((position_um + 1e-6) / f64::from(MICROMETRES_PER_COUNT)).floor() as i64;
                sensor
                    .step((ms + 1) * 1_000, &scans, counts as u16)
                    .estimate
            })
            .collect()
    }

    /// How good a method is.
    pub fn judge(&self, configuration: SensorConfiguration) -> Judgement {
        let mut judgement = Judgement::default();
        let (mut squares, mut valid, mut wrong, mut moving, mut valid_moving) = (0.0, 0, 0, 0, 0);
        let mut all = 0;
        for estimate in self.estimates(configuration) {
            let t_s = estimate.instant_us as f64 / 1e6;
            let truth = self.specimen(self.motion.position_mm(t_s)).0;
            all += 1;
            let in_motion = self.motion.velocity_mm_s(t_s).abs() > 5.0 && t_s > 0.5;
            moving += u32::from(in_motion);
            if !estimate.valid {
                continue;
            }
            valid_moving += u32::from(in_motion);
            valid += 1;
            let error = f64::from(estimate.wavelength_mm.unwrap()) / truth - 1.0;
            squares += error * error;
            judgement.worst_percent = judgement.worst_percent.max(100.0 * error.abs());
            wrong += u32::from(error.abs() > 0.1);
            judgement.amplitude_lsb += f64::from(estimate.amplitude_lsb);
        }
        judgement.rms_percent = 100.0 * (squares / f64::from(valid)).sqrt();
        judgement.valid_share = f64::from(valid_moving) / f64::from(moving);
        judgement.wrong_share = f64::from(wrong) / f64::from(all);
        judgement.amplitude_lsb /= f64::from(valid);
        judgement
    }
}

/// What came of a rub.
#[derive(Clone, Copy, Debug, Default)]
pub struct Judgement {
    pub rms_percent: f64,
    pub worst_percent: f64,
    /// Of the time in motion, from 0.5 s on.
    pub valid_share: f64,
    /// Valid and more than 10 % off, of all estimates.
    pub wrong_share: f64,
    /// Mean over the valid ones.
    pub amplitude_lsb: f64,
}

/// A configuration that asks for a method.
pub const fn with(method: Method) -> SensorConfiguration {
    SensorConfiguration {
        method,
        ..SensorConfiguration::DEFAULT
    }
}

/// Amplitudes of the harmonics 1, 3, 5 and 7, the first one 1.
fn harmonics(wavelength_mm: f64) -> [f64; 4] {
    let amplitude = |n: f64| {
        let ramp = (PI * n * RAMP).sin() / (PI * n * RAMP);
        let blur = (-0.5 * (TAU * n * BLUR_MM / wavelength_mm).powi(2)).exp();
        ramp * blur / n
    };
    [1.0, 3.0, 5.0, 7.0].map(|n| amplitude(n) / amplitude(1.0))
}

/// Splitmix64 and the Box–Muller transform.
pub struct Noise {
    state: u64,
    spare: Option<f64>,
}

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self {
            state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15),
            spare: None,
        }
    }

    /// In (0, 1].
    fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 + f64::EPSILON
    }

    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let (sine, cosine) = (TAU * self.uniform()).sin_cos();
        self.spare = Some(radius * sine);
        radius * cosine
    }
}
