//! A hand that is moved while a scene runs.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use hil_sim_core::scene::{LiveHand, Motion};

/// A hand that is told how fast to go keeps to it for so long, in s, before it heeds another word.
const STRETCH_S: f64 = 5e-3;
/// Stretches that can still be asked about: more than two boards in step are ever apart.
const KEPT: usize = 64;
/// How fast a hand changes its speed, in mm/s².
const ACCELERATION_MM_S2: f64 = 400.0;

/// A hand that swings rests at the end of a stroke after so long, in s, as a person's does: one that never does is
/// played nothing after the display's `full_drive_s`.
const REST_EVERY_S: f64 = 300.0;
/// For so long, in s: a display takes a quarter of a second for a rest.
const REST_S: f64 = 0.5;

/// A hand that goes on for as long as it is asked where it is. It makes its scene's motion, a recorded one
/// to and fro, a swinging one with a rest now and then, until it is told a speed; from then on it keeps to that. Whoever asks about one instant gets
/// one answer, whenever they ask.
#[derive(Debug)]
pub struct DrivenHand {
    motion: Motion,
    /// First and last instant of what is played to and fro, in s.
    recorded_s: Option<(f64, f64)>,
    told: Mutex<Told>,
}

#[derive(Debug, Default)]
struct Told {
    /// The last instant that was asked about, in s.
    asked_s: f64,
    speed_mm_s: Option<f64>,
    /// Number of its first stretch, counted from the scene's start.
    began: u64,
    /// The same of the first that is kept, and the stretches.
    first: u64,
    stretches: VecDeque<Stretch>,
}

/// A stretch of even acceleration.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    position_mm: f64,
    velocity_mm_s: f64,
    acceleration_mm_s2: f64,
}

impl Stretch {
    fn position_mm(&self, t_s: f64) -> f64 {
        self.position_mm + t_s * (self.velocity_mm_s + 0.5 * self.acceleration_mm_s2 * t_s)
    }

    fn velocity_mm_s(&self, t_s: f64) -> f64 {
        self.velocity_mm_s + self.acceleration_mm_s2 * t_s
    }
}

impl LiveHand for DrivenHand {
    fn position_mm(&self, t_s: f64) -> f64 {
        match self.stretch(t_s) {
            Some((stretch, since_s)) => stretch.position_mm(since_s),
            None => self.motion.position_mm(self.played_s(t_s)),
        }
    }

    fn velocity_mm_s(&self, t_s: f64) -> f64 {
        match self.stretch(t_s) {
            Some((stretch, since_s)) => stretch.velocity_mm_s(since_s),
            None => self.untold_velocity_mm_s(t_s),
        }
    }

    fn played_s(&self, t_s: f64) -> f64 {
        self.played(t_s).0
    }
}

impl DrivenHand {
    /// A hand that makes `motion`; from the first to the last instant of `recorded_s` to and fro, if
    /// given, in s.
    pub fn new(motion: Motion, recorded_s: Option<(f64, f64)>) -> Self {
        Self {
            motion,
            recorded_s,
            told: Mutex::default(),
        }
    }

    /// From now on it goes at `speed_mm_s`, as soon as it can.
    pub fn go(&self, speed_mm_s: f64) {
        self.told().speed_mm_s = Some(speed_mm_s);
    }

    /// Where in what is recorded an instant is, in s, and whether it is played backwards there.
    fn played(&self, t_s: f64) -> (f64, bool) {
        if let Motion::Sinusoid { frequency_hz, .. } = self.motion {
            let strokes_s = (REST_EVERY_S * frequency_hz).ceil() / frequency_hz;
            let round_s = strokes_s + REST_S;
            let rounds = (t_s / round_s).floor();
            return (
                rounds * strokes_s + t_s.rem_euclid(round_s).min(strokes_s),
                false,
            );
        }
        let Some((first_s, last_s)) = self.recorded_s else {
            return (t_s, false);
        };
        let length_s = last_s - first_s;
        let way_s = t_s.rem_euclid(2.0 * length_s);
        if way_s < length_s {
            (first_s + way_s, false)
        } else {
            (last_s - (way_s - length_s), true)
        }
    }

    fn untold_velocity_mm_s(&self, t_s: f64) -> f64 {
        let (played_s, backwards) = self.played(t_s);
        let velocity_mm_s = self.motion.velocity_mm_s(played_s);
        if backwards {
            -velocity_mm_s
        } else {
            velocity_mm_s
        }
    }

    fn told(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The stretch of `t_s` and the time since it began; none before a speed was told.
    fn stretch(&self, t_s: f64) -> Option<(Stretch, f64)> {
        let mut told = self.told();
        let nth = (t_s.max(0.0) / STRETCH_S) as u64;
        if let (Some(speed_mm_s), true) = (told.speed_mm_s, told.stretches.is_empty()) {
            // What has been answered stands.
            told.first = (told.asked_s / STRETCH_S) as u64 + 1;
            told.began = told.first;
            let begins_s = told.first as f64 * STRETCH_S;
            let first = towards(
                speed_mm_s,
                self.motion.position_mm(self.played_s(begins_s)),
                self.untold_velocity_mm_s(begins_s),
            );
            told.stretches.push_back(first);
        }
        told.asked_s = told.asked_s.max(t_s);
        if told.stretches.is_empty() || nth < told.began {
            return None;
        }
        while told.first + (told.stretches.len() as u64) <= nth {
            let last = *told.stretches.back()?;
            let next = towards(
                told.speed_mm_s?,
                last.position_mm(STRETCH_S),
                last.velocity_mm_s(STRETCH_S),
            );
            told.stretches.push_back(next);
            if told.stretches.len() > KEPT {
                told.stretches.pop_front();
                told.first += 1;
            }
        }
        let kept = nth.max(told.first);
        let stretch = told.stretches[(kept - told.first) as usize];
        Some((stretch, t_s - kept as f64 * STRETCH_S))
    }
}

/// The stretch from here on, towards a speed.
fn towards(speed_mm_s: f64, position_mm: f64, velocity_mm_s: f64) -> Stretch {
    let wanted = (speed_mm_s - velocity_mm_s) / STRETCH_S;
    Stretch {
        position_mm,
        velocity_mm_s,
        acceleration_mm_s2: wanted.clamp(-ACCELERATION_MM_S2, ACCELERATION_MM_S2),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use hil_sim_core::scene::Series;

    #[test]
    fn a_hand_that_swings_rests_before_the_display_asks_it_to() {
        let motion = Motion::Sinusoid {
            amplitude_mm_s: 70.0,
            frequency_hz: 0.83,
        };
        let hand = DrivenHand::new(motion.clone(), None);
        let (mut rested_s, mut busy_s, mut busiest_s) = (0.0, 0.0_f64, 0.0_f64);
        let mut before_mm = 0.0;
        for millisecond in 1..2_000_000 {
            let t_s = f64::from(millisecond) * 1e-3;
            let at_mm = hand.position_mm(t_s);
            assert!(
                (at_mm - before_mm).abs() < 0.071,
                "{t_s} s: {before_mm} {at_mm}"
            );
            if t_s < REST_EVERY_S {
                assert_eq!(at_mm, motion.position_mm(t_s));
            }
            // Slower than any display hears.
            if hand.velocity_mm_s(t_s).abs() < 0.1 {
                rested_s += 1e-3;
            } else {
                rested_s = 0.0;
            }
            busy_s = if rested_s > 0.25 { 0.0 } else { busy_s + 1e-3 };
            busiest_s = busiest_s.max(busy_s);
            before_mm = at_mm;
        }
        assert!(busiest_s < 310.0, "{busiest_s} s without a rest");
    }

    #[test]
    fn it_makes_its_motion_until_it_is_told_a_speed_and_comes_to_that_smoothly() {
        let hand = DrivenHand::new(Motion::Constant { speed_mm_s: 20.0 }, None);
        assert_eq!(hand.position_mm(1.0), 20.0);
        hand.go(-40.0);
        // What was answered stands; a second board may still ask about it.
        assert_eq!(hand.position_mm(0.99), 0.99 * 20.0);
        let (mut x_mm, mut v_mm_s) = (20.0, 20.0);
        for step in 1..=1_000 {
            let t_s = 1.0 + 1e-3 * f64::from(step);
            let (x, v) = (hand.position_mm(t_s), hand.velocity_mm_s(t_s));
            assert!((v - v_mm_s).abs() <= 0.4 + 1e-9, "{v_mm_s} to {v}");
            assert!((x - x_mm - 0.5e-3 * (v + v_mm_s)).abs() < 1e-3);
            (x_mm, v_mm_s) = (x, v);
        }
        assert!((v_mm_s + 40.0).abs() < 1e-9);
        // At 400 mm/s² it takes 60 mm/s in 150 ms, from the end of the stretch on.
        let turned_mm = 20.0 + 0.005 * 20.0 + 0.15 * -10.0;
        assert!((x_mm - (turned_mm - 0.845 * 40.0)).abs() < 0.5, "{x_mm}");
    }

    #[test]
    fn both_boards_get_one_answer_whoever_asks_first() {
        let hand = DrivenHand::new(Motion::Constant { speed_mm_s: 0.0 }, None);
        hand.go(30.0);
        let mut ahead = Vec::new();
        for step in 0..2_000 {
            let t_s = 1e-3 * f64::from(step);
            ahead.push(hand.position_mm(t_s));
            if step == 700 {
                hand.go(-10.0);
            }
            if let Some(behind) = ahead.len().checked_sub(4) {
                let t_s = 1e-3 * behind as f64;
                assert_eq!(hand.position_mm(t_s), ahead[behind]);
            }
        }
        assert!(hand.told().stretches.len() <= KEPT);
    }

    #[test]
    fn a_recording_is_played_to_and_fro() {
        let recorded = Motion::Recorded(Arc::new(Series {
            at: vec![0.0, 2.0],
            values: vec![3.0, 13.0],
            width: 1,
        }));
        let hand = DrivenHand::new(recorded, Some((0.0, 2.0)));
        for (t_s, x_mm, v_mm_s) in [
            (0.5, 5.5, 5.0),
            (2.5, 10.5, -5.0),
            (3.5, 5.5, -5.0),
            (4.5, 5.5, 5.0),
            (4_000.5, 5.5, 5.0),
        ] {
            assert!((hand.position_mm(t_s) - x_mm).abs() < 1e-9, "{t_s}");
            assert_eq!(hand.velocity_mm_s(t_s), v_mm_s, "{t_s}");
        }
        assert!((hand.played_s(3.5) - 0.5).abs() < 1e-9);
    }
}
