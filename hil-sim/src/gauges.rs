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
