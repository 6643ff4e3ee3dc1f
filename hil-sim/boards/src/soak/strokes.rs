//! Random strokes of a hand: speeds, reversals, rests.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use hil_sim_core::scene::{Motion, Series};

/// λ and length of the specimens, in mm, side by side from x = 0 on.
pub const SPECIMENS: [(f64, f64); 4] =
    [(2.0, 40.0), (1.0, 40.0), (4.0, 40.0), (3.0, f64::INFINITY)];
/// The hand stays within these, in mm.
const WITHIN_MM: (f64, f64) = (5.0, 155.0);
/// The hand rests up to here, in s: both boards start, greet and send a status.
const BEGINS_S: f64 = 2.2;
/// The longest stroke, in mm: less than half of that.
const LONGEST_MM: f64 = 70.0;
/// The slowest and the fastest stroke, in mm/s.
const SPEEDS_MM_S: (f64, f64) = (8.0, 120.0);
/// The shortest and the longest, in s.
const LASTS_S: (f64, f64) = (0.15, 1.5);
/// Share of strokes before which the hand rests, and for how long, in s.
const RESTS: f64 = 0.2;
const RESTS_S: (f64, f64) = (0.1, 1.2);
/// Time in which the hand changes its speed, in s, and the straight lines by which it is drawn.
const RAMPS_S: (f64, f64) = (0.03, 0.12);
const RAMP_LINES: u32 = 12;

/// A hand's way.
pub struct Strokes {
    at: Vec<f64>,
    positions_mm: Vec<f64>,
}

impl Strokes {
    /// Strokes up to `end_s`, then rest.
    pub fn new(seed: u64, end_s: f64) -> Self {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut strokes = Self {
            at: vec![0.0],
            positions_mm: vec![20.0],
        };
        strokes.go_on(BEGINS_S, 0.0);
        let mut speed_mm_s = 0.0;
        while strokes.ends_s() < end_s - RESTS_S.1 - LASTS_S.1 - 3.0 * RAMPS_S.1 {
            if draws.random_bool(RESTS) {
                strokes.ramp(draws.random_range(RAMPS_S.0..RAMPS_S.1), speed_mm_s, 0.0);
                speed_mm_s = 0.0;
                strokes.go_on(draws.random_range(RESTS_S.0..RESTS_S.1), 0.0);
            }
            let mut next_mm_s: f64 = draws.random_range(SPEEDS_MM_S.0..SPEEDS_MM_S.1);
            // Short enough for one way or the other from wherever the hand is.
            let longest_s = LONGEST_MM / next_mm_s - RAMPS_S.1;
            let lasts_s = draws.random_range(LASTS_S.0..LASTS_S.1).min(longest_s);
            // Mostly back, as a rubbing hand does; always away from an end that is near.
            let forwards = if draws.random_bool(0.8) {
                speed_mm_s < 0.0
            } else {
                speed_mm_s >= 0.0
            };
            let reach_mm = next_mm_s * (lasts_s + RAMPS_S.1);
            let position_mm = strokes.position_mm();
            let room_above = position_mm + reach_mm < WITHIN_MM.1;
            let room_below = position_mm - reach_mm > WITHIN_MM.0;
            let forwards = if room_above && room_below {
                forwards
            } else {
                room_above
            };
            if !forwards {
                next_mm_s = -next_mm_s;
            }
            strokes.ramp(
                draws.random_range(RAMPS_S.0..RAMPS_S.1),
                speed_mm_s,
                next_mm_s,
            );
            strokes.go_on(lasts_s, next_mm_s);
            speed_mm_s = next_mm_s;
        }
        strokes.ramp(RAMPS_S.1, speed_mm_s, 0.0);
        strokes.go_on(end_s + 1e3, 0.0);
        strokes
    }

    /// Boundaries between specimens that the hand goes over.
    pub fn crossed(&self) -> u64 {
        let specimen = |x_mm: f64| (x_mm / SPECIMENS[0].1).floor().clamp(0.0, 3.0) as i64;
        self.positions_mm
            .windows(2)
            .map(|pair| specimen(pair[1]).abs_diff(specimen(pair[0])))
            .sum()
    }

    /// The hand.
    pub fn hand(self) -> Motion {
        Motion::Recorded(Arc::new(Series {
            at: self.at,
            values: self.positions_mm,
            width: 1,
        }))
    }

    fn ends_s(&self) -> f64 {
        self.at[self.at.len() - 1]
    }

    fn position_mm(&self) -> f64 {
        self.positions_mm[self.positions_mm.len() - 1]
    }

    fn go_on(&mut self, lasts_s: f64, speed_mm_s: f64) {
        let position_mm = self.position_mm() + speed_mm_s * lasts_s;
        self.at.push(self.ends_s() + lasts_s);
        self.positions_mm.push(position_mm);
    }

    fn ramp(&mut self, lasts_s: f64, from_mm_s: f64, to_mm_s: f64) {
        for line in 0..RAMP_LINES {
            let way = (f64::from(line) + 0.5) / f64::from(RAMP_LINES);
            let speed_mm_s = from_mm_s + (to_mm_s - from_mm_s) * way;
            self.go_on(lasts_s / f64::from(RAMP_LINES), speed_mm_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_rests_at_both_ends_and_stays_on_the_specimens_between() {
        let strokes = Strokes::new(7, 120.0);
        // A minute of strokes of some 30 mm crosses more than a few of three boundaries.
        assert!(strokes.crossed() > 20, "{}", strokes.crossed());
        let hand = strokes.hand();
        assert_eq!(hand.velocity_mm_s(1.0), 0.0);
        assert_eq!(hand.velocity_mm_s(119.9), 0.0);
        let (mut rests, mut turns, mut before) = (0, 0, 1.0);
        for step in 220..11_500 {
            let t_s = f64::from(step) * 0.01;
            let position_mm = hand.position_mm(t_s);
            // A stroke against the last's direction goes on for one ramp more.
            assert!(
                (-5.0..165.0).contains(&position_mm),
                "{position_mm} at {t_s}"
            );
            let velocity_mm_s = hand.velocity_mm_s(t_s);
            assert!(velocity_mm_s.abs() <= SPEEDS_MM_S.1);
            rests += u32::from(velocity_mm_s == 0.0);
            if velocity_mm_s != 0.0 {
                turns += u32::from(velocity_mm_s.signum() != before);
                before = velocity_mm_s.signum();
            }
        }
        assert!(rests > 300 && turns > 30, "{rests} rests, {turns} turns");
    }

    #[test]
    fn another_seed_is_another_hand() {
        let at = |seed: u64| Strokes::new(seed, 60.0).hand().position_mm(30.0);
        assert_eq!(at(1), at(1));
        assert_ne!(at(1), at(2));
    }
}
