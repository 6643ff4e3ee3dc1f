//! One run's stimuli, one after the other: the hand goes on at another speed over another λ.

use std::f64::consts::TAU;

use super::Hand;
use crate::display::through;
use hil_sim_boards::display_alone::{SensorMessage, Surface};
use hil_sim_core::plant::motion::MM_PER_COUNT;
use hil_sim_core::scene::Motion;

/// Before the first stretch: the board starts and is configured.
const BEGINNING_S: f64 = 0.1;
/// Points a second by which a stroke is drawn, in straight lines between them.
const POINTS_HZ: f64 = 4_000.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    pub hand: Hand,
    pub speed_mm_s: f64,
    pub wavelength_mm: f64,
    pub lasts_s: f64,
}

impl Stretch {
    pub fn peak_mm_s(&self) -> f64 {
        match self.hand {
            Hand::Stroke { peak_mm_s, .. } => peak_mm_s,
            Hand::Whole | Hand::Between => self.speed_mm_s,
        }
    }

    fn travel_mm(&self, t_s: f64) -> f64 {
        match self.hand {
            Hand::Whole | Hand::Between => self.speed_mm_s * t_s,
            Hand::Stroke {
                peak_mm_s,
                frequency_hz,
            } => {
                let turn = TAU * frequency_hz;
                peak_mm_s / turn * (1.0 - (turn * t_s).cos())
            }
        }
    }
}

/// Stretches in their order, each with its beginning in s.
pub struct StimulusSequence {
    pub stretches: Vec<(f64, Stretch)>,
    pub ends_s: f64,
}

impl StimulusSequence {
    pub fn new(stretches: Vec<Stretch>) -> Self {
        let mut ends_s = BEGINNING_S;
        let begin = |stretch: Stretch| {
            let from_s = ends_s;
            ends_s += stretch.lasts_s;
            (from_s, stretch)
        };
        let stretches = stretches.into_iter().map(begin).collect();
        Self { stretches, ends_s }
    }

    /// The hand: at rest, then through all stretches.
    pub fn hand(&self) -> Motion {
        // Off a count's edge, on which a steady hand would stand at every tick.
        let mut position_mm = 0.3 * MM_PER_COUNT;
        let (mut at, mut values) = (vec![0.0], vec![position_mm]);
        for (from_s, stretch) in &self.stretches {
            let points = match stretch.hand {
                Hand::Whole | Hand::Between => 1,
                Hand::Stroke { .. } => (stretch.lasts_s * POINTS_HZ).round() as u32,
            };
            let start_mm = position_mm;
            at.push(*from_s);
            values.push(start_mm);
            for point in 1..points {
                let t_s = stretch.lasts_s * f64::from(point) / f64::from(points);
                at.push(from_s + t_s);
                values.push(start_mm + stretch.travel_mm(t_s));
            }
            position_mm = start_mm + stretch.travel_mm(stretch.lasts_s);
        }
        at.push(self.ends_s);
        values.push(position_mm);
        through(at, values)
    }

    pub fn surface(&self) -> Surface {
        let stretches = self.stretches.clone();
        Box::new(move |t_s| {
            let next = stretches.partition_point(|&(from_s, _)| from_s <= t_s);
            SensorMessage::of(stretches[next.max(1) - 1].1.wavelength_mm)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_goes_through_the_stretches_without_a_jump() {
        let steady = Stretch {
            hand: Hand::Whole,
            speed_mm_s: 40.0,
            wavelength_mm: 1.5,
            lasts_s: 2.0,
        };
        let stroke = Stretch {
            hand: Hand::Stroke {
                peak_mm_s: 30.0,
                frequency_hz: 0.5,
            },
            speed_mm_s: 0.0,
            wavelength_mm: 2.0,
            lasts_s: 3.0,
        };
        let course = StimulusSequence::new(vec![steady, stroke, steady]);
        assert!((course.ends_s - 7.1).abs() < 1e-12);
        let hand = course.hand();
        assert_eq!(hand.velocity_mm_s(0.05), 0.0);
        assert!((hand.velocity_mm_s(1.0) - 40.0).abs() < 1e-9);
        // A quarter of the stroke's 2 s: the highest speed.
        assert!((hand.velocity_mm_s(2.6) - 30.0).abs() < 1e-3);
        let mut before_mm = hand.position_mm(0.0);
        for step in 1..7_100 {
            let position_mm = hand.position_mm(f64::from(step) * 1e-3);
            assert!((position_mm - before_mm).abs() < 0.0401, "at {step} ms");
            before_mm = position_mm;
        }
        let surface = course.surface();
        assert_eq!(
            [0.0, 1.0, 3.0, 6.0].map(|t_s| surface(t_s).wavelength_mm),
            [1.5, 1.5, 2.0, 1.5]
        );
    }
}
