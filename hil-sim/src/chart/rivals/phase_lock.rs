//! A phase-locked loop of second order on the band-passed signal of one gauge, with automatic gain, a lock
//! detector, and a sweep that looks for the tone while there is no lock: the textbook's.

use core::f32::consts::{FRAC_1_SQRT_2, PI};

use firmware_sensor::bandpass::{BAND, BandPass, Lane, ORDER};
use protocol::GAUGES;

use super::{HEARD, HIGHEST_HZ, LOWEST_HZ, Rival};

const DT_S: f32 = 1.0 / firmware_sensor::SAMPLE_RATE_HZ as f32;
const DAMPING: f32 = FRAC_1_SQRT_2;
/// Time constant of gain and lock detector, in s.
const WATCH_S: f32 = 0.1;
/// Share of a full lock's in-phase product above which the loop counts as locked.
const LOCKED: f32 = 0.6;
/// A mean of the band-pass' delay over its band, in half ms.
const BAND_PASS_DELAY_HALF_MS: usize = 8;

/// The loop.
#[derive(Clone, Debug)]
pub struct PhaseLock {
    band_pass: BandPass<ORDER>,
    lane: Lane<ORDER>,
    /// ω_n in rad/s.
    natural_rad_s: f32,
    /// In rad.
    phase: f32,
    /// The integrator, in rad/s.
    speed_rad_s: f32,
    /// Mean square of the signal.
    power: f32,
    /// Mean of signal times in-phase oscillator, over the amplitude: ½ in full lock.
    in_phase: f32,
}

impl PhaseLock {
    /// A loop of this natural frequency in Hz, 0.5 to 20: its bandwidth, about. It settles in about as
    /// many s as 1 over it.
    pub fn new(natural_hz: f32) -> Self {
        let band_pass = BandPass::new(BAND);
        let lane = band_pass.settled(0.0);
        Self {
            band_pass,
            lane,
            natural_rad_s: 2.0 * PI * natural_hz,
            phase: 0.0,
            speed_rad_s: 2.0 * PI * LOWEST_HZ,
            power: 0.0,
            in_phase: 0.0,
        }
    }

    fn is_locked(&self) -> bool {
        self.in_phase > 0.5 * LOCKED
    }
}

impl Rival for PhaseLock {
    fn push(&mut self, sample: &[f32; GAUGES]) {
        let x = self.band_pass.step(&mut self.lane, sample[HEARD]);
        self.power += (x * x - self.power) * (DT_S / WATCH_S);
        let amplitude = libm::sqrtf(2.0 * self.power).max(f32::MIN_POSITIVE);
        let (sine, cosine) = (libm::sinf(self.phase), libm::cosf(self.phase));
        // ½ sin of the phase error, and a ripple at twice the frequency that the loop averages.
        let error = 2.0 * x * cosine / amplitude;
        self.in_phase += (x * sine / amplitude - self.in_phase) * (DT_S / WATCH_S);
        let natural = self.natural_rad_s;
        self.speed_rad_s += natural * natural * error * DT_S;
        if !self.is_locked() {
            // A loop can be swept at ω_n²/2 and still catch.
            self.speed_rad_s += 0.5 * natural * natural * DT_S;
        }
        let (lowest, highest) = (2.0 * PI * LOWEST_HZ, 2.0 * PI * HIGHEST_HZ);
        if self.speed_rad_s > highest {
            self.speed_rad_s = lowest;
        }
        self.speed_rad_s = self.speed_rad_s.max(lowest);
        self.phase += (self.speed_rad_s + 2.0 * DAMPING * natural * error) * DT_S;
        if self.phase > PI {
            self.phase -= 2.0 * PI;
        }
    }

    fn frequency_hz(&mut self) -> Option<f32> {
        self.is_locked().then_some(self.speed_rad_s / (2.0 * PI))
    }

    /// The loop's integrator follows with a delay of 2ζ/ω_n.
    fn age_half_ms(&self) -> usize {
        let delay_half_ms = 2.0 * 2.0 * DAMPING / self.natural_rad_s / DT_S;
        (delay_half_ms as usize + BAND_PASS_DELAY_HALF_MS).min(400)
    }
}
