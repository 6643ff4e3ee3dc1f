//! Whether a line has been there all the time, while the arm moves at whatever speed.
//!
//! Hum stays where it is. A texture is at the mains' frequency for as long as the speed makes it so: one
//! that passes is in a fast follower for a moment, and hardly in a slow one.

use super::common::{Amplitude, Amplitudes, is_common, square, sum};
use crate::ESTIMATE_RATE_HZ;
use crate::float::{larger, smaller};

/// Memory of the two followers and of the fast one's power, in estimates. They hear 3 Hz and 0.6 Hz on
/// either side.
const FAST: f32 = 5.0;
const SLOW: f32 = 25.0;
const REMEMBERED: f32 = 30.0;
/// Power of the slow follower over the fast one's mean from which on a line is steady.
const STEADY: f32 = 0.6;
/// Estimates until the slow follower is slow enough to tell.
const TOLD: u16 = 20;
/// Estimates that hum must have been steady for, if it has been there from the start on; and later.
const AT_FIRST: u16 = 30;
const LATER: u16 = 60;
/// Estimates from the start on after which hum that is there would have been steady.
const DECIDED: u16 = 60;
/// Speeds are the same within this share and amount in mm/s, of the encoder's counts.
const SAME: f32 = 0.03;
const SAME_MM_S: f32 = 0.7;
/// Speeds that differ by this share take a texture at 50 Hz 10 Hz along, out of both followers' hearing.
const OTHER: f32 = 0.2;

/// What is known of a line's steadiness.
#[derive(Clone, Debug, Default)]
pub(super) struct Steady {
    heard: u16,
    /// The fast follower of the gauges' sum, and its mean power.
    fast: Amplitude,
    fast_power: f32,
    /// The slow one, of each gauge.
    slow: Amplitudes,
    /// Estimates in a row that the line has been steady for, and the speeds in that time.
    steady: u16,
    slowest_mm_s: f32,
    fastest_mm_s: f32,
    /// It was not there at first.
    decided: bool,
}

impl Steady {
    /// Takes what the gauges hold of the line now, and the arm's speed. What the `usable` ones have in
    /// common is nothing below `least_power`, in ADC steps²; it can't be hum if not `likely`. Says whether
    /// it must be.
    pub fn push(
        &mut self,
        now: &Amplitudes,
        usable: u8,
        least_power: f32,
        likely: bool,
        speed_mm_s: f32,
    ) -> bool {
        self.heard = self.heard.saturating_add(1);
        let heard = f32::from(self.heard);
        follow(&mut self.fast, sum(now, usable), smaller(heard, FAST));
        for (slow, now) in self.slow.iter_mut().zip(now) {
            follow(slow, *now, smaller(heard, SLOW));
        }
        // Not of what was there before the fast one had settled.
        let memory = (heard - FAST).clamp(1.0, REMEMBERED);
        self.fast_power += (square(self.fast) - self.fast_power) / memory;
        let steady = likely
            && self.heard >= TOLD
            && square(sum(&self.slow, usable)) > larger(STEADY * self.fast_power, least_power)
            && is_common(&self.slow, usable);
        if !steady {
            self.steady = 0;
            self.decided |= self.heard >= DECIDED;
            return false;
        }
        if self.steady == 0 {
            self.slowest_mm_s = speed_mm_s;
            self.fastest_mm_s = speed_mm_s;
        }
        self.steady = self.steady.saturating_add(1);
        self.slowest_mm_s = smaller(self.slowest_mm_s, speed_mm_s);
        self.fastest_mm_s = larger(self.fastest_mm_s, speed_mm_s);
        let differ_mm_s = self.fastest_mm_s - self.slowest_mm_s;
        let same = differ_mm_s < SAME * self.fastest_mm_s + SAME_MM_S;
        let other = differ_mm_s > OTHER * self.fastest_mm_s + SAME_MM_S;
        let hum = if self.decided {
            self.steady >= LATER && other
        } else {
            self.steady >= AT_FIRST && (same || other)
        };
        self.decided |= hum;
        hum
    }

    /// The arm rests, and no line is one of texture. `known`: what is there is known by that.
    pub fn rest(&mut self, known: bool) {
        self.steady = 0;
        self.decided |= known;
    }

    /// Whether what is there may yet turn out to be hum.
    pub fn is_open(&self) -> bool {
        !self.decided && (self.steady > 0 || self.heard < TOLD)
    }

    /// What the gauges have held of the line in the last quarter of a second.
    pub fn slow(&self) -> &Amplitudes {
        &self.slow
    }

    /// For how long that has been heard, in s.
    pub fn heard_s(&self) -> f32 {
        smaller(f32::from(self.heard), SLOW) / ESTIMATE_RATE_HZ as f32
    }
}

/// Lets a mean over `memory` estimates follow.
fn follow(mean: &mut Amplitude, now: Amplitude, memory: f32) {
    let share = 1.0 / memory;
    mean[0] += share * (now[0] - mean[0]);
    mean[1] += share * (now[1] - mean[1]);
}
