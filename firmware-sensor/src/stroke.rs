//! How often the hand goes to and fro: the paper's fv, from the reversals of the arm.
//!
//! "It is not straightforward to estimate fv in real-time" (Okamoto et al. 2009, section III-C). A
//! reversal is an extreme of the position; half a stroke lies between two of them. What has not ended yet
//! is taken for as long as it has been, once it is longer than the last one.

use crate::SAMPLE_RATE_HZ;
use crate::travel::{PLACES_PER_UM, Place};

/// What the paper assigns to fv, in Hz: taken for the first half stroke after a rest.
const PAPERS_STROKES_HZ: f32 = 1.0;
/// An extreme is one once the arm has gone back this far: more than a tremor and than encoder counts.
const RETREAT: i32 = 250 * PLACES_PER_UM;
/// Without a new extreme for so long, the arm rests. At 0.1 Hz and 70 mm/s, the slowest strokes that
/// matter, the arm takes 0.11 s to retreat that far.
const REST_MS: u32 = 250;
/// Nothing is longer: [`SAMPLE_RATE_HZ`] / (2 · 0.01 Hz).
const LONGEST_MS: u32 = 50_000;

/// The arm's to and fro.
#[derive(Clone, Debug)]
pub struct Stroke {
    phase: Phase,
    /// The farthest place in the present direction; where the arm stands, at rest.
    extreme: Place,
    since_extreme_ms: u32,
    /// Since the last reversal, or since the arm set off.
    elapsed_ms: u32,
    half_stroke_ms: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// No place seen yet.
    New,
    Resting,
    Forward,
    Backward,
}

impl Default for Stroke {
    fn default() -> Self {
        Self {
            phase: Phase::New,
            extreme: 0,
            since_extreme_ms: 0,
            elapsed_ms: 0,
            half_stroke_ms: 0,
        }
    }
}

impl Stroke {
    /// Takes where the arm is, once per ms.
    pub fn push(&mut self, place: Place) {
        const FIRST_GUESS_MS: u32 = (SAMPLE_RATE_HZ as f32 / (2.0 * PAPERS_STROKES_HZ)) as u32;
        if self.phase == Phase::New {
            self.phase = Phase::Resting;
            self.extreme = place;
        }
        self.since_extreme_ms = (self.since_extreme_ms + 1).min(LONGEST_MS);
        self.elapsed_ms = (self.elapsed_ms + 1).min(LONGEST_MS);
        let ahead = place.wrapping_sub(self.extreme);
        let advance = match self.phase {
            Phase::New | Phase::Resting => {
                if ahead.abs() > RETREAT {
                    self.phase = direction(ahead);
                    self.extreme = place;
                    self.since_extreme_ms = 0;
                    self.elapsed_ms = 0;
                    self.half_stroke_ms = FIRST_GUESS_MS;
                }
                return;
            }
            Phase::Forward => ahead,
            Phase::Backward => ahead.wrapping_neg(),
        };
        if advance > 0 {
            self.extreme = place;
            self.since_extreme_ms = 0;
        } else if advance < -RETREAT {
            self.half_stroke_ms = self.elapsed_ms - self.since_extreme_ms;
            self.elapsed_ms = self.since_extreme_ms;
            self.phase = direction(ahead);
            self.extreme = place;
            self.since_extreme_ms = 0;
        } else if self.since_extreme_ms > REST_MS {
            self.phase = Phase::Resting;
            self.extreme = place;
        }
    }

    /// fv in Hz: 0.01 or above, and falling towards it while nothing reverses. 1 Hz in the first half
    /// stroke after a rest.
    pub fn strokes_hz(&self) -> f32 {
        let half_stroke_ms = self.half_stroke_ms.max(self.elapsed_ms).max(1);
        SAMPLE_RATE_HZ as f32 / (2 * half_stroke_ms) as f32
    }
}

fn direction(ahead: i32) -> Phase {
    if ahead > 0 {
        Phase::Forward
    } else {
        Phase::Backward
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    const PLACES_PER_MM: f64 = 4_000.0;

    fn place(position_mm: f64) -> Place {
        // In steps of 5 µm.
        (libm::floor(position_mm * 200.0) as i32) * 20
    }

    #[test]
    fn finds_the_hands_frequency_after_the_first_half_stroke_between_two_reversals() {
        for strokes_hz in [0.3, 0.83, 1.0, 2.0, 4.0] {
            let mut stroke = Stroke::default();
            for ms in 0..8_000 {
                let t_s = f64::from(ms) / 1_000.0;
                // Position and velocity are 0 at first: the half strokes are whole from the start.
                let position_mm =
                    70.0 / (2.0 * PI * strokes_hz) * (1.0 - libm::cos(2.0 * PI * strokes_hz * t_s));
                stroke.push(place(position_mm));
                if t_s > 1.2 / strokes_hz {
                    let got = f64::from(stroke.strokes_hz());
                    // The first reversal is seen 0.25 mm late: sqrt(2 · 0.25 mm / (2π fv · 70 mm/s)), and
                    // the open half stroke grows by as much beyond the last; counts flatten an extreme
                    // by sqrt(2 · 5 µm / (2π fv 70 mm/s)) on either side.
                    let acceleration = 2.0 * PI * strokes_hz * 70.0;
                    let late_s = libm::sqrt(2.0 * 0.25 / acceleration)
                        + 2.0 * libm::sqrt(2.0 * 0.005 / acceleration)
                        + 0.002;
                    let lowest = 1.0 / (1.0 / strokes_hz + 2.0 * late_s);
                    let highest = 1.0 / (1.0 / strokes_hz - 2.0 * late_s);
                    assert!(
                        (lowest..=highest).contains(&got),
                        "{got} for {strokes_hz} Hz at {t_s} s"
                    );
                }
            }
        }
    }

    #[test]
    fn falls_towards_0_while_the_arm_goes_on_and_on() {
        let mut stroke = Stroke::default();
        for ms in 0..10_000 {
            stroke.push(place(50.0 * f64::from(ms) / 1_000.0));
        }
        // Seen to set off after 0.25 mm, 5 ms or one more.
        assert!((stroke.strokes_hz() - 0.05).abs() < 0.000_1);
    }

    #[test]
    fn starts_from_the_papers_1_hz_after_a_rest() {
        let mut stroke = Stroke::default();
        for ms in 0..2_000 {
            stroke.push(place(
                3.0 * libm::sin(2.0 * PI * 3.0 * f64::from(ms) / 1_000.0),
            ));
        }
        assert!(stroke.strokes_hz() > 2.0);
        for _ in 0..1_000 {
            stroke.push(place(0.0));
        }
        for ms in 0..100 {
            stroke.push(place(50.0 * f64::from(ms) / 1_000.0));
        }
        assert_eq!(stroke.strokes_hz(), 1.0);
    }

    #[test]
    fn takes_no_tremor_for_a_stroke() {
        let mut stroke = Stroke::default();
        for ms in 0..5_000 {
            let t_s = f64::from(ms) / 1_000.0;
            let tremor_mm = 0.1 * libm::sin(2.0 * PI * 9.0 * t_s);
            stroke.push(place(5.0 * t_s + tremor_mm));
        }
        assert!(stroke.strokes_hz() < 0.11, "{}", stroke.strokes_hz());
    }

    #[test]
    fn goes_on_where_places_wrap() {
        let mut stroke = Stroke::default();
        let start = i32::MAX - 40_000;
        for ms in 0..4_000 {
            let t_s = f64::from(ms) / 1_000.0;
            let moved = PLACES_PER_MM * 10.0 * (1.0 - libm::cos(2.0 * PI * t_s));
            stroke.push(start.wrapping_add(moved as i32));
        }
        assert!((stroke.strokes_hz() - 1.0).abs() < 0.05);
    }
}
