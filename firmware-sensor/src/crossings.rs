//! Crossings timed between samples, their spacing taken in position.
//!
//! The crossings are those of a signal that every step has left where it was along the surface. The
//! paper's band-pass can't give it: its delay depends on frequency, and so on speed, by milliseconds,
//! its lower edge lets the signal sink to 0 as the arm turns, and it rings on afterwards. Instead:
//!
//! - noise is smoothed with a symmetric kernel, whose delay is the same 2 ms at every frequency;
//! - the mean that is to be crossed is taken over *travel*: at rest it stands still, and the same
//!   texture has the same mean at every speed;
//! - so is the power, which sets the hysteresis;
//! - places, interpolated between samples, are kept as [`Landmarks`], which go back and forth with the
//!   arm.
//!
//! λ is twice the mean spacing of a gauge's last four half waves, and the mean of those gauges that agree
//! with their median. What is left of the noise is what one crossing in it is worth: of σ beside a
//! slope of 2πa/λ, λσ/(2πa).

use core::f32::consts::PI;

use protocol::{GAUGES, SensorConfiguration};

use crate::estimator::{Estimator, Finding, MIN_AMPLITUDE_LSB, Touch};
use crate::float::sqrt;
use crate::hum::Pickup;
use crate::landmarks::{LONGEST, Landmarks, MARKS};
use crate::travel::Travel;
use crate::travel::{MIN_SPEED_MM_S, PLACES_PER_MM, Place};
use crate::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ};

/// Travel over which the mean is taken that the signal is to cross, in places: a few of the longest
/// waves. It follows their ups and downs a little, which moves all crossings by the same amount.
const MEAN_TRAVEL: f32 = 8.0 * PLACES_PER_MM as f32;
/// Travel over which the power is taken.
const POWER_TRAVEL: f32 = 4.0 * PLACES_PER_MM as f32;
/// Travel before crossings are taken: there is no mean to cross yet.
const FIRST_TRAVEL: f32 = 1.0 * PLACES_PER_MM as f32;
/// Crossings of a gauge before it has a say: one wave more than a set of marks, during which the mean
/// comes to rest.
const FIRST_CROSSINGS: u8 = MARKS as u8 + 2;
/// A crossing counts once the signal has gone this share of its RMS beyond, half of a sine's amplitude:
/// rarely by noise, even as strong as the signal.
const HYSTERESIS: f32 = 0.7;
/// Samples by which smoothing delays.
const SMOOTHING_SAMPLES: usize = 2;
/// Gauges whose λ is within this share of the median agree with it.
const AGREEMENT: f32 = 0.08;
/// So many have to agree; or all that may be used, if these are fewer.
const QUORUM: usize = 3;
/// How long an estimate is stood by at rest, in calls of `find`: 150 ms. A hand that turns is slower than
/// [`MIN_SPEED_MM_S`] for 11 ms at 70 mm/s and 0.83 Hz, and never for so long at a natural stroke.
const HELD: u32 = 15 * ESTIMATE_RATE_HZ / 100;

/// The estimator.
#[derive(Clone, Debug)]
pub struct Crossings {
    lanes: [Lane; GAUGES],
    /// Where the last samples were taken, newest first.
    places: [Place; SMOOTHING_SAMPLES + 1],
    /// Up to [`MEAN_TRAVEL`].
    travelled: f32,
    /// π over the last half wave found, in rad a place; 0 before there is one.
    wavenumber: f32,
    started: bool,
    usable: u8,
    pickup: Pickup,
    /// Calls of `find` at rest, up to [`HELD`].
    resting: u32,
}

/// One gauge's.
#[derive(Clone, Copy, Debug, Default)]
struct Lane {
    /// The last two samples, and the last two sums of three of them, newest first.
    samples: [f32; 2],
    sums: [f32; 2],
    mean: f32,
    power: f32,
    /// The last smoothed sample, from the mean.
    before: f32,
    /// The side on which the signal was last beyond its hysteresis.
    above: bool,
    /// Whether it has changed sides since then, and where for the first and for the last time.
    changed: bool,
    first: Place,
    last: Place,
    landmarks: Landmarks,
    /// Up to 255.
    crossings: u8,
}

/// What a millisecond is for all gauges.
struct Step {
    /// Where the smoothed sample was taken.
    place: Place,
    /// And how far that is from the one before.
    moved: i32,
    /// Weights of this sample in the mean and in the power.
    mean_share: f32,
    power_share: f32,
    /// What smoothing has taken of the power.
    restored: f32,
    crossings_count: bool,
}

impl Crossings {
    /// Before the first touch.
    pub fn new(_configuration: &SensorConfiguration) -> Self {
        Self {
            lanes: [Lane::default(); GAUGES],
            places: [0; SMOOTHING_SAMPLES + 1],
            travelled: 0.0,
            wavenumber: 0.0,
            started: false,
            usable: 0,
            pickup: Pickup::default(),
            resting: HELD,
        }
    }

    /// As if the arm had been standing at `touch` for ever.
    fn start(&mut self, touch: &Touch) {
        self.started = true;
        self.places = [touch.place; SMOOTHING_SAMPLES + 1];
        for (lane, &x) in self.lanes.iter_mut().zip(&touch.gauges) {
            lane.samples = [x; 2];
            lane.sums = [3.0 * x; 2];
            lane.mean = x;
        }
    }

    fn step(&mut self, newest: Place) -> Step {
        let [newer, place, before] = self.places;
        self.places = [newest, newer, place];
        let moved = place.wrapping_sub(before);
        let distance = moved.unsigned_abs() as f32;
        self.travelled = (self.travelled + distance).min(MEAN_TRAVEL);
        // Of all travel so far, until there has been enough of it.
        let share = |over: f32| distance / over.min(self.travelled).max(1.0);
        let gain = smoothing_gain(self.wavenumber * distance);
        Step {
            place,
            moved,
            mean_share: share(MEAN_TRAVEL),
            power_share: share(POWER_TRAVEL),
            restored: 1.0 / (gain * gain),
            crossings_count: self.travelled >= FIRST_TRAVEL,
        }
    }
}

impl Estimator for Crossings {
    fn push(&mut self, touch: &Touch) {
        if !self.started {
            self.start(touch);
        }
        let step = self.step(touch.place);
        for (lane, &x) in self.lanes.iter_mut().zip(&touch.gauges) {
            lane.push(x, &step);
        }
        self.usable = touch.usable;
        self.pickup = touch.pickup;
    }

    /// Valid: most of the gauges that have something to say agree, no less than [`QUORUM`] or all usable
    /// ones, and the arm moves or has just been moving. The confidence is the share of the usable gauges
    /// that agree.
    ///
    /// The amplitude is √2 times the RMS from the mean, smoothing made up for: with a trapezoid's harmonics,
    /// up to 5 % more than the fundamental's, and the noise's.
    fn find(&mut self, travel: &Travel) -> Finding {
        if travel.velocity_mm_s(0).abs() >= MIN_SPEED_MM_S {
            self.resting = 0;
        } else {
            self.resting = (self.resting + 1).min(HELD);
        }
        let mut said = [(0.0, 0); GAUGES];
        let mut count = 0;
        for (gauge, lane) in self.lanes.iter().enumerate() {
            if self.usable & 1 << gauge != 0
                && let Some(half_wave) = lane.half_wave(self.places[0])
            {
                said[count] = (half_wave, gauge);
                count += 1;
            }
        }
        if count == 0 {
            return Finding::default();
        }
        let said = &mut said[..count];
        said.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let median = (said[(count - 1) / 2].0 + said[count / 2].0) / 2.0;
        let (mut agreeing, mut sum, mut powers, mut gauges_used) = (0, 0.0, 0.0, 0);
        let mut even = true;
        for &(half_wave, gauge) in said.iter() {
            if (half_wave - median).abs() <= AGREEMENT * median {
                agreeing += 1;
                sum += half_wave;
                powers += self.lanes[gauge].power;
                even &= self.lanes[gauge].landmarks.is_even();
                gauges_used |= 1 << gauge;
            }
        }
        if agreeing == 0 {
            // Two that differ.
            return Finding {
                wavelength_mm: Some(2.0 * median / PLACES_PER_MM as f32),
                ..Finding::default()
            };
        }
        let amplitude_lsb = sqrt(2.0 * powers / agreeing as f32);
        let half_wave = sum / agreeing as f32;
        let frequency_hz = travel.velocity_mm_s(0).abs() * PLACES_PER_MM as f32 / (2.0 * half_wave);
        self.wavenumber = PI / half_wave;
        let usable = self.usable.count_ones() as usize;
        let valid = self.resting < HELD
            && agreeing >= QUORUM.min(usable)
            && 2 * agreeing > count
            // Few witnesses have at least to agree with themselves.
            && (agreeing >= QUORUM || even)
            && !self.pickup.hides(amplitude_lsb, frequency_hz);
        Finding {
            wavelength_mm: Some(2.0 * half_wave / PLACES_PER_MM as f32),
            valid,
            confidence: if valid {
                agreeing as f32 / usable as f32
            } else {
                0.0
            },
            amplitude_lsb,
            gauges_used,
            ..Finding::default()
        }
    }
}

/// What smoothing leaves of `omega` rad a sample, (1 + 2 cos ω)²/9, by the cosine's series: within 0.3 %
/// up to ω = 1, 160 Hz, and no less than there.
fn smoothing_gain(omega: f32) -> f32 {
    const _: () = assert!(SAMPLE_RATE_HZ == 1_000);
    let squared = (omega * omega).min(1.0);
    let root = 1.0 - squared * (1.0 / 3.0 - squared * (1.0 / 36.0));
    root * root
}

impl Lane {
    fn push(&mut self, x: f32, step: &Step) {
        // Three of three: 1 2 3 2 1.
        let sum = x + self.samples[0] + self.samples[1];
        let smooth = (sum + self.sums[0] + self.sums[1]) * (1.0 / 9.0);
        self.samples = [x, self.samples[0]];
        self.sums = [sum, self.sums[0]];

        let y = smooth - self.mean;
        self.mean += step.mean_share * y;
        let squared = y * y * step.restored;
        self.power += step.power_share * (squared - self.power);

        let before = core::mem::replace(&mut self.before, y);
        let above = y >= 0.0;
        if above != (before >= 0.0) {
            let since = y / (y - before);
            self.last = step
                .place
                .wrapping_sub((since * step.moved as f32) as Place);
            if !self.changed {
                self.first = self.last;
                self.changed = true;
            }
        }
        if step.crossings_count && squared > HYSTERESIS * HYSTERESIS * self.power {
            if above != self.above {
                self.above = above;
                self.cross(step.place);
            }
            self.changed = false;
        }
    }

    /// The signal has got from one side to the other, at `place`. Noise may have taken it to and fro
    /// in between: the middle of that is the crossing.
    fn cross(&mut self, place: Place) {
        let crossing = self
            .first
            .wrapping_add(self.last.wrapping_sub(self.first) / 2);
        let since = place.wrapping_sub(crossing);
        // At rest it was noise or drift.
        if self.changed && since != 0 {
            self.landmarks.cross(crossing, since > 0);
            self.crossings = self.crossings.saturating_add(1);
        }
    }

    /// What this gauge takes for half of λ, in places, with the arm at `place`: none before it has all
    /// marks, nor without a signal, nor where the next crossing is overdue.
    fn half_wave(&self, place: Place) -> Option<f32> {
        let half_wave = self.landmarks.half_wave()?;
        (self.landmarks.count() == MARKS
            && self.crossings >= FIRST_CROSSINGS
            && self.power >= 0.5 * MIN_AMPLITUDE_LSB * MIN_AMPLITUDE_LSB
            && (self.landmarks.beyond(place) as f32) < LONGEST * half_wave)
            .then_some(half_wave)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_takes_what_its_kernel_takes() {
        for step in 0..=100 {
            let omega = f64::from(step) / 100.0;
            // 1 2 3 2 1 about its middle.
            let kernel = (3.0 + 4.0 * libm::cos(omega) + 2.0 * libm::cos(2.0 * omega)) / 9.0;
            let got = f64::from(smoothing_gain(omega as f32));
            // The series' next term, 2ω⁶/(3 · 720), twice, relative to 0.69.
            let bound = kernel * (2.7e-3 * omega.powi(6) + 1e-6);
            assert!((got - kernel).abs() <= bound, "{got} is not {kernel}");
        }
        assert_eq!(smoothing_gain(5.0), smoothing_gain(1.0));
    }

    #[test]
    fn a_signal_that_rests_crosses_nothing() {
        let mut crossings = Crossings::new(&SensorConfiguration::DEFAULT);
        for ms in 0..1_000 {
            crossings.push(&Touch {
                gauges: [if ms % 7 < 3 { 100.0 } else { -100.0 }; GAUGES],
                usable: 0b11111,
                ..Touch::default()
            });
        }
        for lane in &crossings.lanes {
            assert_eq!(lane.crossings, 0);
        }
        assert_eq!(crossings.find(&Travel::new(0)), Finding::default());
    }
}
