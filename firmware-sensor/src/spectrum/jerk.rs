//! How jerky the gauges are: the power of their second difference, which high frequencies dominate.

use protocol::GAUGES;

use crate::SAMPLE_RATE_HZ;
use crate::estimator::Touch;
use crate::float::{larger, smaller, sqrt};
use crate::phasor::phasor;
use crate::travel::PLACES_PER_UM;

/// Gain in power of the first and of the second difference for white noise behind the anti-aliasing filter.
const FIRST_DIFFERENCE_NOISE_GAIN: f32 = 1.83;
/// See [`FIRST_DIFFERENCE_NOISE_GAIN`].
const SECOND_DIFFERENCE_NOISE_GAIN: f32 = 4.85;
/// What of the noise's variance is not known: a tenth of what it makes of the second difference.
const NOISE_DOUBT: f32 = 0.5;
/// What a contact dulls a texture by: a Gaussian of this σ in mm, 0.24 mm wide at half height.
const CONTACT_SIGMA_MM: f32 = 0.1;
/// Power at high frequencies, relative to the wave's, that is never held against a surface.
const LEAST_JERK: f32 = 0.005;
/// What is faster than this is noise: a fingertip on its spring slips for some ms. White noise is at 303 Hz.
const SLIPS_BELOW_HZ: f32 = 350.0;
/// How much more than from its quiet moments steady power may be, which is known to a fifth or so.
const STEADY_DOUBT: f32 = 1.05;
/// Speed from which on a millisecond counts, in places a millisecond: 5 mm/s.
const MOVED_PLACES: f32 = 5.0 * PLACES_PER_UM as f32;
/// Time constant of the speed, in samples.
const SPEED_SAMPLES: f32 = 16.0;
/// Share of the samples that are the quiet ones, the step that their bound is followed in, and its least,
/// relative to the mean.
const QUIET_SHARE: f32 = 0.1;
/// See [`QUIET_SHARE`].
const QUIET_STEP: f32 = 0.02;
/// See [`QUIET_SHARE`].
const QUIET_LEAST: f32 = 1e-3;
/// The tenth percentile of χ² over its mean, with one to five degrees of freedom: white noise's quiet
/// bound, by the number of gauges.
const QUIET_OF_MEAN: [f32; GAUGES] = [0.0158, 0.1054, 0.1948, 0.2659, 0.3221];
/// Time constant of the high-frequency power, in samples.
const JERK_SAMPLES: f32 = 300.0;

/// The power of the second difference in time, which high frequencies dominate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Jerk {
    before: [[f32; GAUGES]; 2],
    /// Speed lately, in places a millisecond.
    speed: f32,
    /// Means over the milliseconds that moved: the second difference's power, and that by speed.
    power: f32,
    by_speed: f32,
    /// The same of the first difference's power, and of the speed in places a millisecond.
    first: f32,
    mean_speed: f32,
    /// The power by speed that a tenth of them are below: roughness passes as fast as the arm is.
    quiet: f32,
    samples: u32,
}

impl Jerk {
    /// Takes a millisecond's touch and its travel in places.
    pub(super) fn push(&mut self, touch: &Touch, travel: i32) {
        let [before, older] = self.before;
        let (mut first, mut power) = (0.0, 0.0);
        for gauge in 0..GAUGES {
            if touch.usable >> gauge & 1 == 1 {
                let step = touch.gauges[gauge] - before[gauge];
                let second = step - (before[gauge] - older[gauge]);
                first += step * step;
                power += second * second;
            }
        }
        self.before = [touch.gauges, before];
        self.speed += (travel.abs() as f32 - self.speed) * (1.0 / SPEED_SAMPLES);
        if self.speed < MOVED_PLACES {
            return;
        }
        self.samples = self.samples.saturating_add(1);
        // The first two differences are with nothing.
        let Some(samples) = self.samples.checked_sub(2).filter(|&samples| samples > 0) else {
            return;
        };
        let samples = samples as f32;
        let share = 1.0 / smaller(samples, JERK_SAMPLES);
        let by_speed = power / self.speed;
        self.power += (power - self.power) * share;
        self.by_speed += (by_speed - self.by_speed) * share;
        self.first += (first - self.first) * share;
        self.mean_speed += (self.speed - self.mean_speed) * share;
        if self.quiet == 0.0 {
            self.quiet = by_speed;
        }
        // A quantile in steps of its own size: so many up as down once a share of the powers is below.
        let step = larger(1.0 / samples, QUIET_STEP);
        self.quiet *= if by_speed > self.quiet {
            1.0 + step * QUIET_SHARE
        } else {
            1.0 - step * (1.0 - QUIET_SHARE)
        };
        self.quiet = larger(self.quiet, self.by_speed * QUIET_LEAST);
    }

    /// Begins anew, on another surface or with other gauges: it is as quiet as before in between.
    pub(super) fn restart(&mut self) {
        *self = Self {
            samples: self.samples.min(2),
            power: 0.0,
            by_speed: 0.0,
            first: 0.0,
            mean_speed: 0.0,
            ..*self
        };
    }

    /// Whether the fingertip seems to stick and slip, on a wave of that power in as many gauges, passing at
    /// `hz` for the arm: there is power at high frequencies that neither `noise` nor the surface makes. A
    /// fingertip that slips is fast for some ms, whatever the arm does: at the arm's speed that would be waves
    /// finer than a contact lets through.
    pub(super) fn is_slip(
        &self,
        wavelength_mm: f32,
        hz: f32,
        explained: f32,
        noise: f32,
        gauges: u32,
    ) -> bool {
        let quiet = self
            .steady(gauges)
            .max(SECOND_DIFFERENCE_NOISE_GAIN * noise);
        let left = self.power - quiet - NOISE_DOUBT * noise;
        if left <= LEAST_JERK * explained {
            return false;
        }
        // What a wave with sharp edges makes, as far as the contact leaves them sharp.
        let wave = |number: f32, share: f32| {
            share * second_difference_gain(number * hz) * let_through(number / wavelength_mm)
        };
        let edges = wave(1.0, 1.0) + wave(2.0, 0.1) + wave(3.0, 1.0 / 9.0) + wave(5.0, 0.04);
        let left = left - explained * edges / let_through(1.0 / wavelength_mm);
        let second = (self.power - SECOND_DIFFERENCE_NOISE_GAIN * noise).max(0.0);
        let first = self.first - FIRST_DIFFERENCE_NOISE_GAIN * noise;
        // Of a single frequency the differences' powers are (2 sin(πf/fs))² apart.
        let sine = if second < 4.0 * first {
            0.5 * sqrt(second / first)
        } else {
            1.0
        };
        let slip_hz = SAMPLE_RATE_HZ as f32 / core::f32::consts::PI * libm::asinf(sine);
        let per_mm = slip_hz * PLACES_PER_UM as f32 / self.mean_speed.max(f32::MIN_POSITIVE);
        slip_hz < SLIPS_BELOW_HZ && left > explained * let_through(per_mm).max(LEAST_JERK)
    }

    /// What the mean power may be if it is always as in the quiet moments, speed for speed, with `gauges`
    /// gauges: a fingertip that sticks and slips is quiet in between, noise and a rough surface are not.
    fn steady(&self, gauges: u32) -> f32 {
        let gauges = (gauges as usize).clamp(1, GAUGES);
        let share = self.quiet / (QUIET_OF_MEAN[gauges - 1] * self.by_speed.max(f32::MIN_POSITIVE));
        (STEADY_DOUBT * share * self.power).min(STEADY_DOUBT * self.power)
    }
}

/// Share of a wave's power that a contact lets through, by its wavenumber in cycles per mm.
fn let_through(per_mm: f32) -> f32 {
    let radians = 2.0 * core::f32::consts::PI * CONTACT_SIGMA_MM * per_mm;
    libm::expf(-(radians * radians).min(40.0))
}

/// Power gain of the second difference at 1 kHz, (2 sin(πf/fs))⁴, up to half the sample rate.
fn second_difference_gain(frequency_hz: f32) -> f32 {
    let half_turns = (frequency_hz / SAMPLE_RATE_HZ as f32).min(0.5);
    let [_, sin] = phasor((half_turns * 2_147_483_648.0) as u32);
    let square = 4.0 * sin * sin;
    square * square
}
