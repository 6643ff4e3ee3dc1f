//! Crossings timed between samples, their spacing taken in position.

use protocol::{GAUGES, SensorConfiguration};

use crate::estimator::{
    Estimator, Finding, MIN_AMPLITUDE_LSB, MIN_SPEED_MM_S, PLACES_PER_MM, Place, Touch,
};
use crate::landmarks::{Landmarks, MARKS};
use crate::travel::Travel;

/// Travel over which the mean is taken that the signal is to cross.
const MEAN_TRAVEL: f32 = 8.0 * PLACES_PER_MM as f32;
/// Travel over which the power is taken.
const POWER_TRAVEL: f32 = 4.0 * PLACES_PER_MM as f32;
/// A crossing counts once the signal has gone this share of its RMS beyond.
const HYSTERESIS: f32 = 0.7;
/// Samples by which smoothing delays.
const SMOOTHING_MS: usize = 2;
/// Travel before crossings are taken.
const FIRST_TRAVEL: f32 = 1.0 * PLACES_PER_MM as f32;
const PRIMED: u8 = MARKS as u8 + 2;
/// How long an estimate is stood by at rest, in calls of `find`.
const HELD: u32 = 15;
/// Gauges within this of the median agree with it.
const AGREEMENT: f32 = 0.06;

/// The estimator.
#[derive(Clone, Debug)]
pub struct Crossings {
    lanes: [Lane; GAUGES],
    /// Places of the last samples, newest first: how far smoothing lags behind.
    places: [Place; SMOOTHING_MS + 1],
    travelled: f32,
    /// 2π/λ of the last finding, in rad a place; 0 before there is one.
    wavenumber: f32,
    started: bool,
    usable: u8,
    resting: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Lane {
    samples: [f32; 2],
    sums: [f32; 2],
    mean: f32,
    power: f32,
    before: f32,
    above: bool,
    /// Sign changes since the signal was last beyond its hysteresis.
    changed: bool,
    first: Place,
    last: Place,
    landmarks: Landmarks,
    crossings: u8,
}

impl Crossings {
    /// Before the first touch.
    pub fn new(_configuration: &SensorConfiguration) -> Self {
        Self {
            lanes: [Lane::default(); GAUGES],
            places: [0; SMOOTHING_MS + 1],
            travelled: 0.0,
            wavenumber: 0.0,
            started: false,
            usable: 0,
            resting: HELD,
        }
    }
}

impl Estimator for Crossings {
    fn push(&mut self, touch: &Touch) {
        if !self.started {
            self.places = [touch.place; SMOOTHING_MS + 1];
            for (lane, x) in self.lanes.iter_mut().zip(touch.gauges) {
                lane.samples = [x; 2];
                lane.sums = [3.0 * x; 2];
                lane.mean = x;
            }
            self.started = true;
        }
        let [newer, place, before] = self.places;
        self.places = [touch.place, newer, place];
        let (place, before) = (self.places[2], before);
        let moved = place.wrapping_sub(before);
        let distance = moved.unsigned_abs() as f32;
        self.travelled = (self.travelled + distance).min(MEAN_TRAVEL);
        let share = |over: f32| distance / over.min(self.travelled).max(1.0);
        let gain = smoothing_gain(self.wavenumber * distance);
        let step = Step {
            place,
            moved,
            mean_share: share(MEAN_TRAVEL),
            power_share: share(POWER_TRAVEL),
            inverse_gain: 1.0 / (gain * gain),
            begun: self.travelled >= FIRST_TRAVEL,
        };
        for (lane, x) in self.lanes.iter_mut().zip(&touch.gauges) {
            lane.push(*x, &step);
        }
        self.usable = touch.usable;
    }

    fn find(&mut self, travel: &Travel) -> Finding {
        if travel.velocity_mm_s(0).abs() >= MIN_SPEED_MM_S {
            self.resting = 0;
        } else {
            self.resting = (self.resting + 1).min(HELD);
        }
        let place = self.places[2];
        let mut found = [(0.0, 0_u8); GAUGES];
        let mut count = 0;
        let mut powers = 0.0;
        let mut usable = 0;
        for (gauge, lane) in self.lanes.iter().enumerate() {
            if self.usable & 1 << gauge == 0 {
                continue;
            }
            usable += 1;
            if let Some(half_wave) = lane.half_wave(place) {
                found[count] = (half_wave, gauge as u8);
                powers += lane.power;
                count += 1;
            }
        }
        let found = &mut found[..count];
        if count == 0 {
            return Finding::default();
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let median = (found[(count - 1) / 2].0 + found[count / 2].0) / 2.0;
        let agreeing = found
            .iter()
            .filter(|(half_wave, _)| (half_wave - median).abs() <= AGREEMENT * median);
        let agree = agreeing.clone().count();
        let mean = agreeing
            .clone()
            .map(|(half_wave, _)| half_wave)
            .sum::<f32>()
            / agree.max(1) as f32;
        let half_wave = if agree == 0 { median } else { mean };
        let valid = self.resting < HELD && agree >= usable.min(3) && 2 * agree > count;
        self.wavenumber = core::f32::consts::PI / half_wave;
        Finding {
            wavelength_mm: Some(2.0 * half_wave / PLACES_PER_MM as f32),
            valid,
            confidence: if valid {
                agree as f32 / usable as f32
            } else {
                0.0
            },
            amplitude_lsb: libm::sqrtf(2.0 * powers / count as f32),
            gauges_used: agreeing.fold(0, |used, (_, gauge)| used | 1 << gauge),
        }
    }
}

/// The gain of smoothing at `omega` rad a sample, (1 + 2 cos ω)²/9, by the cosine's series: within 0.2 %
/// up to ω = 1, 160 Hz, and no less than there.
fn smoothing_gain(omega: f32) -> f32 {
    let squared = (omega * omega).min(1.0);
    let root = 1.0 - squared * (1.0 / 3.0 - squared * (1.0 / 36.0));
    root * root
}

struct Step {
    place: Place,
    moved: i32,
    mean_share: f32,
    power_share: f32,
    inverse_gain: f32,
    begun: bool,
}

impl Lane {
    fn push(&mut self, x: f32, step: &Step) {
        let &Step {
            place,
            moved,
            mean_share,
            power_share,
            inverse_gain,
            ..
        } = step;
        let sum = x + self.samples[0] + self.samples[1];
        let smooth = (sum + self.sums[0] + self.sums[1]) * (1.0 / 9.0);
        self.samples = [x, self.samples[0]];
        self.sums = [sum, self.sums[0]];
        let y = smooth - self.mean;
        self.mean += mean_share * y;
        let squared = y * y * inverse_gain;
        self.power += power_share * (squared - self.power);
        let before = core::mem::replace(&mut self.before, y);
        if (y >= 0.0) != (before >= 0.0) {
            let left = y / (y - before);
            self.last = place.wrapping_sub((left * moved as f32) as i32);
            if !self.changed {
                self.first = self.last;
                self.changed = true;
            }
        }
        if step.begun && squared > HYSTERESIS * HYSTERESIS * self.power {
            if (y >= 0.0) != self.above {
                self.above = y >= 0.0;
                let at = self.first.wrapping_add(self.last.wrapping_sub(self.first) / 2);
                let ahead = place.wrapping_sub(at);
                if self.changed && ahead != 0 {
                    self.landmarks.cross(at, ahead > 0);
                    self.crossings = self.crossings.saturating_add(1);
                }
            }
            self.changed = false;
        }
    }

    fn half_wave(&self, place: Place) -> Option<f32> {
        let half_wave = self.landmarks.half_wave()?;
        (self.landmarks.count() == MARKS
            && self.crossings >= PRIMED
            && half_wave > 0.0
            && self.power > 0.5 * MIN_AMPLITUDE_LSB * MIN_AMPLITUDE_LSB
            && (self.landmarks.beyond(place) as f32) < 1.7 * half_wave)
            .then_some(half_wave)
    }
}
