//! The voltages of five computed gauges, as ADC codes.
//!
//! A gauge feels the texture under its own place on the fingertip ([`Texture`]), through the sensor's
//! resonance if there is one; hum, noise, drift and offset come in behind it. Its gain, place and phase are guesses
//! of the numerical study behind this project, not measurements; the phase advances the texture as a
//! whole, by that angle of its fundamental.

mod force;
mod gauge_fault;
mod pink;
mod recorded;
mod resonance;
mod stream;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use protocol::GAUGES;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::plant::surface::Surface;
use crate::scene::Kinematic;

pub use force::{ForceChannel, NOISE_N};
use gauge_fault::GaugeFault;
pub use gauge_fault::{BROKEN_HUM, BROKEN_NOISE, SATURATED_GAIN, STUCK_CODE};
use pink::{Pink, Poles};
pub use recorded::RecordedGauges;
use resonance::{Resonance, Ring};
use stream::Stream;

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
/// The band in which the signal-to-noise ratio counts the noise, in Hz.
pub const SNR_BAND_HZ: f64 = 500.0;
/// Frequency of the drift, in Hz: a guess.
pub const DRIFT_HZ: f64 = 0.11;
/// Each gauge's share of the static offset.
pub const OFFSET_SHARES: [f64; GAUGES] = [-1.0, -0.5, 0.0, 0.5, 1.0];

const VOLTS_FULL_SCALE: f64 = 3.3;
const CODES: f64 = 4096.0;
const CODES_PER_UNIT: f64 = VOLTS_PER_UNIT / VOLTS_FULL_SCALE * CODES;
const MID_RAIL_CODE: f32 = (MID_RAIL_VOLTS / VOLTS_FULL_SCALE * CODES) as f32;
const MAINS_HZ: [f64; 2] = [50.0, 60.0];

/// What gauges feel of a surface.
pub trait Texture {
    /// What `gauge`, 0 to 4, feels with the fingertip's middle at `fingertip_mm` of the surface; 1 is the
    /// fundamental's amplitude.
    fn felt_by(&self, gauge: usize, fingertip_mm: f64) -> f32;
}

/// A point at each gauge's place.
impl Texture for Surface {
    #[inline]
    fn felt_by(&self, gauge: usize, fingertip_mm: f64) -> f32 {
        self.feel(fingertip_mm + PLACES_MM[gauge], advance(gauge))
    }
}

/// By how much of its period the texture is ahead under `gauge`, in 2⁻³² cycles.
#[inline]
pub(crate) const fn advance(gauge: usize) -> u32 {
    const ADVANCES: [u32; GAUGES] = {
        let mut advances = [0; GAUGES];
        let mut gauge = 0;
        while gauge < GAUGES {
            advances[gauge] = (PHASES_RAD[gauge] / TAU * 4_294_967_296.0) as i64 as u32;
            gauge += 1;
        }
        advances
    };
    ADVANCES[gauge]
}

/// Five computed gauges, their noise and their troubles.
#[derive(Clone, Debug)]
pub struct KinematicGauges {
    sound: [Lane; GAUGES],
    broken: [Lane; GAUGES],
    trouble: GaugeFault,
    resonance: Option<(Resonance, [Option<Ring>; GAUGES])>,
    /// Amplitude at each of the mains' frequencies.
    hum_codes: [f64; 2],
    hum_off_hz: f64,
    noise_codes: Option<f32>,
    noise: Xoshiro256PlusPlus,
    slow: Option<Slow>,
}

#[derive(Clone, Copy, Debug)]
struct Lane {
    signal_codes: f32,
    /// Gain of what comes in behind the gauge: hum and noise.
    pickup: f32,
}

/// Drift, offset and 1/f noise.
#[derive(Clone, Debug)]
struct Slow {
    drift_codes: f64,
    /// Sine and cosine of each gauge's phase.
    drift_ahead: [(f64, f64); GAUGES],
    offset_codes: [f32; GAUGES],
    pink: Option<(Pink, [Poles; GAUGES], Xoshiro256PlusPlus)>,
}

impl KinematicGauges {
    /// The gauges of a scene. The noise depends on `seed` alone: a broken gauge changes no other's.
    pub fn new(kinematic: &Kinematic, seed: u64) -> Self {
        let trouble = GaugeFault::new(kinematic, stream::draws(seed, Stream::Broken));
        let slow = kinematic.pink > 0.0 || kinematic.drift > 0.0 || kinematic.offset > 0.0;
        Self {
            sound: std::array::from_fn(|gauge| Lane::new(gauge, 1.0)),
            broken: std::array::from_fn(|gauge| Lane::new(gauge, trouble.gain(gauge))),
            trouble,
            resonance: kinematic
                .resonance
                .map(|resonance| (Resonance::new(resonance), [None; GAUGES])),
            hum_codes: [kinematic.hum_50_hz, kinematic.hum_60_hz].map(|hum| hum * CODES_PER_UNIT),
            hum_off_hz: kinematic.hum_off_hz,
            noise_codes: kinematic
                .snr_db
                .map(|db| (noise_per_unit(db) * CODES_PER_UNIT) as f32),
            noise: stream::draws(seed, Stream::White),
            slow: slow.then(|| Slow::new(kinematic, seed)),
        }
    }

    /// One scan at `t_s`, the fingertip's middle at `fingertip_mm` of the surface.
    #[inline]
    pub fn scan(&mut self, texture: &impl Texture, t_s: f64, fingertip_mm: f64) -> [u16; GAUGES] {
        let off_hz = self.hum_off_hz;
        let mains = |nominal_hz: f64| libm::sin(TAU * ((nominal_hz + off_hz) * t_s).fract());
        let mut hum = 0.0;
        for (codes, nominal_hz) in self.hum_codes.into_iter().zip(MAINS_HZ) {
            if codes != 0.0 {
                hum += (codes * mains(nominal_hz)) as f32;
            }
        }
        let slow = self.slow.as_mut().map(|slow| slow.scan(t_s));
        let broken = self.trouble.is_on(t_s);
        let lanes = if broken { &self.broken } else { &self.sound };
        let mut codes = [0; GAUGES];
        for (gauge, (code_out, lane)) in codes.iter_mut().zip(lanes).enumerate() {
            let mut pickup = hum;
            if let Some(noise_codes) = self.noise_codes {
                let sample: f32 = StandardNormal.sample(&mut self.noise);
                pickup += noise_codes * sample;
            }
            if let Some(slow) = &slow {
                pickup += slow[gauge];
            }
            let mut signal = texture.felt_by(gauge, fingertip_mm);
            if let Some((resonance, rings)) = &mut self.resonance {
                signal = resonance.step(&mut rings[gauge], f64::from(signal)) as f32;
            }
            let mut level = MID_RAIL_CODE + signal * lane.signal_codes + pickup * lane.pickup;
            if broken {
                level = self.trouble.level(gauge, level, || mains(MAINS_HZ[0]));
            }
            *code_out = code(level);
        }
        codes
    }
}

impl Lane {
    fn new(gauge: usize, gain: f64) -> Self {
        Self {
            signal_codes: (gain * GAINS[gauge] * CODES_PER_UNIT) as f32,
            pickup: gain as f32,
        }
    }
}

impl Slow {
    fn new(kinematic: &Kinematic, seed: u64) -> Self {
        Self {
            drift_codes: kinematic.drift * CODES_PER_UNIT,
            drift_ahead: std::array::from_fn(|gauge| {
                libm::sincos(TAU * gauge as f64 / GAUGES as f64)
            }),
            offset_codes: OFFSET_SHARES
                .map(|share| (share * kinematic.offset * CODES_PER_UNIT) as f32),
            pink: (kinematic.pink > 0.0).then(|| {
                let pink = Pink::new(kinematic.pink * CODES_PER_UNIT);
                let mut noise = stream::draws(seed, Stream::Pink);
                let poles = std::array::from_fn(|_| pink.start(&mut noise));
                (pink, poles, noise)
            }),
        }
    }

    /// What is added to the next scan. The drift of each gauge is a fifth of a turn ahead of the one
    /// before.
    fn scan(&mut self, t_s: f64) -> [f32; GAUGES] {
        let mut codes = self.offset_codes;
        if self.drift_codes > 0.0 {
            let (sine, cosine) = libm::sincos(TAU * DRIFT_HZ * t_s);
            for (code, (ahead_sine, ahead_cosine)) in codes.iter_mut().zip(self.drift_ahead) {
                let drift = sine * ahead_cosine + cosine * ahead_sine;
                *code += (self.drift_codes * drift) as f32;
            }
        }
        if let Some((pink, poles, noise)) = &mut self.pink {
            for (code, poles) in codes.iter_mut().zip(poles) {
                *code += pink.step(poles, noise);
            }
        }
        codes
    }
}

/// Standard deviation of one scan's noise, 1 being the fundamental's amplitude: its power in 0 to
/// [`SNR_BAND_HZ`] stands `snr_db` below the fundamental's ½, and it is white up to half the scan rate.
fn noise_per_unit(snr_db: f64) -> f64 {
    let in_band = 0.5 * libm::pow(10.0, -snr_db / 10.0);
    (in_band * f64::from(SCAN_RATE_HZ) / 2.0 / SNR_BAND_HZ).sqrt()
}

/// floor, clipped to the converter's range.
#[inline]
fn code(codes: f32) -> u16 {
    codes.clamp(0.0, (CODES - 1.0) as f32) as u16
}
