//! A fingertip that feels whatever it is told to, on a sensor that goes on from one rub to the next.

use std::f64::consts::TAU;

use firmware_sensor::{
    MICROMETRES_PER_COUNT, MID_RAIL_CODE, SCAN_RATE_HZ, SCANS_PER_SAMPLE, Scan, Sensor,
};
use protocol::{Estimate, GAUGES, SensorConfiguration, Texture};

/// Gains and phases of the gauges and their places along the scan, those of the project's study.
pub const GAINS: [f64; GAUGES] = [1.0, 0.8, 1.1, 0.6, 0.9];
pub const PLACES_MM: [f64; GAUGES] = [-3.0, -1.5, 0.0, 1.5, 3.0];
pub const PHASES_RAD: [f64; GAUGES] = [0.0, 0.4, -0.7, 1.1, -0.3];
/// ADC steps of a fundamental at unit gain.
pub const CODES: f64 = 370.0;
/// Deviation of a scan's noise that makes 20 dB of it: half of it lies beyond 1 kHz.
pub const NOISE_20_DB: f64 = CODES * 0.1414;

pub struct Bench {
    pub sensor: Sensor,
    pub scans: u64,
    pub x_mm: f64,
    /// Deviation of a scan's white noise in ADC steps.
    pub noise_lsb: f64,
    /// All textures so far.
    pub textures: Vec<Texture>,
    /// The tangential force in mN, of x in mm and whether the arm goes on.
    pub force_mn: Option<Box<dyn Fn(f64, bool) -> f64>>,
    random: u64,
}

impl Bench {
    pub fn new(configuration: SensorConfiguration) -> Self {
        configuration.check().unwrap();
        Self {
            sensor: Sensor::new(configuration),
            scans: 0,
            x_mm: 0.0,
            noise_lsb: NOISE_20_DB,
            textures: vec![],
            force_mn: None,
            random: 1,
        }
    }

    pub fn t_s(&self) -> f64 {
        self.scans as f64 / f64::from(SCAN_RATE_HZ)
    }

    /// Rubs on for `ms`, at a velocity of s since now, over what the gauges say in ADC steps from mid-rail:
    /// of gauge, x in mm and s since the start.
    pub fn rub(
        &mut self,
        ms: u64,
        velocity_mm_s: impl Fn(f64) -> f64,
        signal: impl Fn(usize, f64, f64) -> f64,
    ) -> Vec<Estimate> {
        let began_s = self.t_s();
        let mut estimates = Vec::new();
        for _ in 0..ms {
            let scans = std::array::from_fn(|_| {
                let t_s = self.t_s();
                let speed_mm_s = velocity_mm_s(t_s - began_s);
                self.x_mm += speed_mm_s / f64::from(SCAN_RATE_HZ);
                self.scans += 1;
                let mut scan: Scan = [MID_RAIL_CODE; 6];
                for (gauge, code) in scan.iter_mut().enumerate().take(GAUGES) {
                    let level = signal(gauge, self.x_mm, t_s) + self.noise_lsb * self.normal();
                    *code = (f64::from(MID_RAIL_CODE) + level)
                        .round()
                        .clamp(0.0, 4_095.0) as u16;
                }
                if let Some(force_mn) = &self.force_mn {
                    let volts = force_mn(self.x_mm, speed_mm_s > 0.0)
                        / f64::from(self.sensor.configuration().force_mn_per_v);
                    let code = f64::from(MID_RAIL_CODE) + volts / 3.3 * 4_096.0;
                    scan[GAUGES] = code.round().clamp(0.0, 4_095.0) as u16;
                }
                scan
            });
            let counts = (1_000.0 * self.x_mm / f64::from(MICROMETRES_PER_COUNT)).floor() as i64;
            let instant_us = self.scans / SCANS_PER_SAMPLE as u64 * 1_000;
            let output = self.sensor.step(instant_us, &scans, counts as u16);
            estimates.extend(output.estimate);
            self.textures.extend(output.texture);
        }
        estimates
    }

    fn normal(&mut self) -> f64 {
        if self.noise_lsb == 0.0 {
            return 0.0;
        }
        let mut uniform = || {
            self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.random;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 + f64::EPSILON
        };
        (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos()
    }
}

/// A surface of `wavelength_mm` with a third harmonic, as each gauge meets it.
pub fn texture(wavelength_mm: f64) -> impl Fn(usize, f64, f64) -> f64 {
    move |gauge, x_mm, _| {
        let theta = TAU * (x_mm + PLACES_MM[gauge]) / wavelength_mm + PHASES_RAD[gauge];
        CODES * GAINS[gauge] * (theta.sin() + 0.2 * (3.0 * theta).sin())
    }
}

/// Share of valid estimates, and the largest error of λ among them.
pub fn valid_and_worst(estimates: &[Estimate], wavelength_mm: f64) -> (f64, f64) {
    let valid: Vec<f64> = estimates
        .iter()
        .filter(|estimate| estimate.valid)
        .map(|estimate| (f64::from(estimate.wavelength_mm.unwrap()) / wavelength_mm - 1.0).abs())
        .collect();
    (
        valid.len() as f64 / estimates.len() as f64,
        valid.into_iter().fold(0.0, f64::max),
    )
}
