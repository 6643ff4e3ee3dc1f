//! The voltages of five kinematic gauges, as ADC codes.
//!
//! A gauge feels the texture under its own place and nothing else: no slip, no stick, no resonance. Its
//! gain, place and phase are guesses of the numerical study behind this project, not measurements; the
//! phase advances the texture as a whole, by that angle of its fundamental.

use std::f64::consts::TAU;

use protocol::{CHANNELS, GAUGES};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::scene::{Kinematic, Series};
use crate::surface::Surface;

/// Scans of all channels per second.
pub const SCAN_RATE_HZ: u32 = 4_000;
/// Relative gain of each gauge: a guess.
pub const GAINS: [f64; GAUGES] = [1.0, 0.8, 1.1, 0.6, 0.9];
/// Place of each gauge along the scan, in mm from the fingertip's middle, in rising order: a guess.
pub const PLACES_MM: [f64; GAUGES] = [-3.0, -1.5, 0.0, 1.5, 3.0];
/// Phase of each gauge, in rad of the fundamental: a guess.
pub const PHASES_RAD: [f64; GAUGES] = [0.0, 0.4, -0.7, 1.1, -0.3];
/// Volts at the ADC pin for a fundamental of amplitude 1 at unit gain.
pub const VOLTS_PER_UNIT: f64 = 0.3;
/// Where a gauge rests, in V.
pub const MID_RAIL_VOLTS: f64 = 1.65;
/// A saturated gauge's amplifier has this gain too much: the ADC clips at ± 1.65 / (20 · 0.3), about a
/// quarter of the signal's amplitude.
pub const SATURATED_GAIN: f64 = 20.0;
/// The band in which the signal-to-noise ratio counts the noise, in Hz.
pub const SNR_BAND_HZ: f64 = 500.0;

const VOLTS_FULL_SCALE: f64 = 3.3;
const CODES: f64 = 4096.0;
const CODES_PER_UNIT: f64 = VOLTS_PER_UNIT / VOLTS_FULL_SCALE * CODES;
const MID_RAIL_CODE: f32 = (MID_RAIL_VOLTS / VOLTS_FULL_SCALE * CODES) as f32;
const HUM_HZ: f64 = 50.0;

/// Five kinematic gauges and their noise.
#[derive(Clone, Debug)]
pub struct KinematicGauges {
    lanes: [Lane; GAUGES],
    hum_codes: f64,
    noise_codes: Option<f32>,
    noise: Xoshiro256PlusPlus,
}

#[derive(Clone, Copy, Debug)]
struct Lane {
    place_mm: f64,
    advance: u32,
    signal_codes: f32,
    /// Gain of what comes in behind the gauge: hum and noise. 0 if dead.
    pickup: f32,
}

impl KinematicGauges {
    /// The gauges of a scene. The noise depends on `seed` alone: a dead gauge changes no other's.
    pub fn new(kinematic: &Kinematic, seed: u64) -> Self {
        let lanes = std::array::from_fn(|gauge| {
            let gain = match (kinematic.dead[gauge], kinematic.saturated[gauge]) {
                (true, _) => 0.0,
                (false, true) => SATURATED_GAIN,
                (false, false) => 1.0,
            };
            Lane {
                place_mm: PLACES_MM[gauge],
                advance: (PHASES_RAD[gauge] / TAU * 4_294_967_296.0) as i64 as u32,
                signal_codes: (gain * GAINS[gauge] * CODES_PER_UNIT) as f32,
                pickup: gain as f32,
            }
        });
        Self {
            lanes,
            hum_codes: kinematic.hum_50_hz * CODES_PER_UNIT,
            noise_codes: kinematic
                .snr_db
                .map(|db| (noise_per_unit(db) * CODES_PER_UNIT) as f32),
            noise: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// One scan with the arm at `arm_mm`, at `t_s`. The sixth channel rests: kinematic contact knows no
    /// force.
    #[inline]
    pub fn scan(&mut self, surface: &Surface, t_s: f64, arm_mm: f64) -> [u16; CHANNELS] {
        let hum = if self.hum_codes == 0.0 {
            0.0
        } else {
            (self.hum_codes * (TAU * (HUM_HZ * t_s).fract()).sin()) as f32
        };
        let mut codes = [code(MID_RAIL_CODE); CHANNELS];
        for (code_out, lane) in codes.iter_mut().zip(&self.lanes) {
            let mut pickup = hum;
            if let Some(noise_codes) = self.noise_codes {
                let sample: f32 = StandardNormal.sample(&mut self.noise);
                pickup += noise_codes * sample;
            }
            let signal = surface.feel(arm_mm + lane.place_mm, lane.advance);
            *code_out = code(MID_RAIL_CODE + signal * lane.signal_codes + pickup * lane.pickup);
        }
        codes
    }
}

/// Standard deviation of one scan's noise, 1 being the fundamental's amplitude: its power in 0 to
/// [`SNR_BAND_HZ`] stands `snr_db` below the fundamental's ½, and it is white up to half the scan rate.
fn noise_per_unit(snr_db: f64) -> f64 {
    let in_band = 0.5 * 10f64.powf(-snr_db / 10.0);
    (in_band * f64::from(SCAN_RATE_HZ) / 2.0 / SNR_BAND_HZ).sqrt()
}

/// floor, clipped to the converter's range.
#[inline]
fn code(codes: f32) -> u16 {
    codes.clamp(0.0, (CODES - 1.0) as f32) as u16
}

/// Recorded voltages, played back.
#[derive(Clone, Debug)]
pub struct RecordedGauges {
    volts: std::sync::Arc<Series>,
    row: usize,
}

impl RecordedGauges {
    /// Plays `volts`: five columns, or six with the tangential force.
    pub fn new(volts: std::sync::Arc<Series>) -> Self {
        Self { volts, row: 0 }
    }

    /// One scan at `t_s`, on the straight line between the rows around it.
    pub fn scan(&mut self, t_s: f64) -> [u16; CHANNELS] {
        self.row = self.volts.row(t_s, self.row);
        std::array::from_fn(|channel| {
            if channel < self.volts.width {
                let volts = self.volts.value(self.row, channel, t_s);
                code((volts / VOLTS_FULL_SCALE * CODES) as f32)
            } else {
                code(MID_RAIL_CODE)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, Specimen};

    const SCANS: usize = 40_000;

    fn surface() -> Surface {
        Surface::new(&Scene::constant(2.0, 50.0).surface, 0.0)
    }

    /// Ten seconds at 50 mm/s.
    fn scans(kinematic: Kinematic, seed: u64) -> Vec<[u16; CHANNELS]> {
        let surface = surface();
        let mut gauges = KinematicGauges::new(&kinematic, seed);
        (0..SCANS)
            .map(|scan| {
                let t_s = scan as f64 / f64::from(SCAN_RATE_HZ);
                gauges.scan(&surface, t_s, 50.0 * t_s)
            })
            .collect()
    }

    fn lane(scans: &[[u16; CHANNELS]], channel: usize) -> Vec<f64> {
        scans
            .iter()
            .map(|codes| f64::from(codes[channel]))
            .collect()
    }

    /// Amplitude of the tone at `hz`, in codes, and its phase against a sine that starts with the scans.
    fn tone(lane: &[f64], hz: f64) -> (f64, f64) {
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (scan, code) in lane.iter().enumerate() {
            let angle = TAU * hz * scan as f64 / f64::from(SCAN_RATE_HZ);
            sine += code * angle.sin();
            cosine += code * angle.cos();
        }
        (
            2.0 * sine.hypot(cosine) / lane.len() as f64,
            cosine.atan2(sine),
        )
    }

    #[test]
    fn each_gauge_has_its_gain_place_and_phase() {
        let scans = scans(Kinematic::default(), 1);
        for gauge in 0..GAUGES {
            let lane = lane(&scans, gauge);
            let (amplitude, phase) = tone(&lane, 25.0);
            let expected = GAINS[gauge] * 0.3 / 3.3 * 4096.0;
            // Rounding down to codes adds less than a code's noise: 1/√12 · √(2/40 000) ≪ 0.1.
            assert!(
                (amplitude - expected).abs() < 0.1,
                "{gauge}: {amplitude} for {expected}"
            );
            let expected = TAU * PLACES_MM[gauge] / 2.0 + PHASES_RAD[gauge];
            let difference = ((phase - expected) / TAU + 0.5).rem_euclid(1.0) - 0.5;
            assert!(difference.abs() < 1e-3, "{gauge}: {phase} for {expected}");
            let mean = lane.iter().sum::<f64>() / SCANS as f64;
            // floor takes half a code off.
            assert!((mean - 2047.5).abs() < 0.1, "{gauge}: mean {mean}");
        }
        assert!(scans.iter().all(|codes| codes[5] == 2048));
    }

    #[test]
    fn the_noise_has_the_power_that_the_ratio_asks_for_and_is_white() {
        let noisy = Kinematic {
            snr_db: Some(10.0),
            ..Kinematic::default()
        };
        let (clean, noisy) = (scans(Kinematic::default(), 1), scans(noisy, 1));
        for gauge in 0..GAUGES {
            let noise: Vec<f64> = lane(&noisy, gauge)
                .iter()
                .zip(lane(&clean, gauge))
                .map(|(noisy, clean)| noisy - clean)
                .collect();
            let power = noise.iter().map(|n| n * n).sum::<f64>() / SCANS as f64;
            // A quarter of it lies in 0–500 of 2000 Hz.
            let signal = 0.5 * CODES_PER_UNIT * CODES_PER_UNIT;
            let ratio_db = 10.0 * (signal / (power / 4.0)).log10();
            // χ² with 40 000 degrees of freedom: σ of the power 0.7 %, 0.03 dB; 5 σ.
            assert!((ratio_db - 10.0).abs() < 0.15, "{gauge}: {ratio_db} dB");
            let next: f64 =
                noise.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / SCANS as f64 / power;
            // σ = 1/√40 000 = 0.005; 5 σ.
            assert!(next.abs() < 0.025, "{gauge}: {next}");
        }
    }

    #[test]
    fn hum_is_common_to_all_gauges_and_relative_to_the_signal() {
        let scans = scans(
            Kinematic {
                hum_50_hz: 0.5,
                ..Kinematic::default()
            },
            1,
        );
        for gauge in 0..GAUGES {
            let (amplitude, phase) = tone(&lane(&scans, gauge), 50.0);
            assert!(
                (amplitude - 0.5 * CODES_PER_UNIT).abs() < 0.1,
                "{gauge}: {amplitude}"
            );
            assert!(phase.abs() < 1e-3);
        }
    }

    #[test]
    fn a_dead_gauge_rests_a_saturated_one_clips_and_the_others_stay_as_they_were() {
        let mut broken = Kinematic {
            snr_db: Some(20.0),
            hum_50_hz: 0.1,
            ..Kinematic::default()
        };
        let whole = scans(broken, 5);
        broken.dead[1] = true;
        broken.saturated[3] = true;
        let broken = scans(broken, 5);
        assert!(broken.iter().all(|codes| codes[1] == 2048));
        let clipped = broken
            .iter()
            .filter(|codes| codes[3] == 0 || codes[3] == 4095)
            .count();
        // A sine of amplitude a is beyond c for 1 − 2/π · asin(c/a) of the time: 70 % with
        // c/a = 1.65 / (20 · 0.3 · 0.6) = 0.46; the harmonics and the noise move it little.
        assert!(
            (0.6..0.9).contains(&(clipped as f64 / SCANS as f64)),
            "{clipped}"
        );
        for gauge in [0, 2, 4] {
            assert_eq!(lane(&broken, gauge), lane(&whole, gauge));
        }
    }

    #[test]
    fn noise_is_the_seed_s() {
        let noisy = Kinematic {
            snr_db: Some(20.0),
            ..Kinematic::default()
        };
        assert_eq!(scans(noisy, 3), scans(noisy, 3));
        assert_ne!(scans(noisy, 3), scans(noisy, 4));
    }

    #[test]
    fn at_a_boundary_each_gauge_feels_what_lies_under_its_own_place() {
        let mut scene = Scene::constant(2.0, 50.0).surface;
        scene.specimens = vec![
            Specimen {
                wavelength_mm: 1.0,
                length_mm: 60.0,
            },
            Specimen {
                wavelength_mm: 4.0,
                length_mm: f64::INFINITY,
            },
        ];
        let both = Surface::new(&scene, 0.0);
        scene.specimens.truncate(1);
        let first = Surface::new(&scene, 0.0);
        let feel =
            |surface| KinematicGauges::new(&Kinematic::default(), 1).scan(surface, 0.0, 60.2);
        let (both, first) = (feel(&both), feel(&first));
        // Places −3 and −1.5 mm are still before 60 mm.
        assert_eq!(both[..2], first[..2]);
        assert!((2..5).all(|gauge| both[gauge] != first[gauge]));
    }
}
