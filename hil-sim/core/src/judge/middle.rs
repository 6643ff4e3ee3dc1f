//! A voltage about its own middle.
//!
//! What a reversal leaves of charge is worked off over the next stroke (firmware-display's `balance`), and
//! stands under the sine meanwhile. It moves the crossings of 0 V, and the wave not at all. So the middle at
//! an instant is the mean over the cycle of travel about it, half of it before and half of it after:
//!
//! - a sine's is 0 at whatever phase, and at its crossings it is 0 for any cycle's length: a wave of another
//!   frequency than is due crosses its middle at that frequency;
//! - a straight drift's is what it is at that instant;
//! - of an offset that decays with τ, a cycle of T leaves (T/τ)²/24.
//!
//! Where the hand turned within that cycle there is none, and nothing is said.
//!
//! So a point waits until the hand has gone on for half a cycle, and is kept for as long again.

use std::collections::VecDeque;

use crate::judge::voltage::Edge;

/// Half of the cycle about an instant.
const HALF: f64 = 0.5;
/// Points kept at most. A slow hand over a long wave has two for each of its counts, 8 000 a cycle of 20 mm; more
/// come only of outputs that change while the hand rests, which are given up as though it had turned.
const POINTS_KEPT: usize = 16_384;

/// A point of the outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// When, and the words.
    pub edge: Edge,
    /// The voltage looked at, in V.
    pub volts: f64,
    /// The cycles travelled by then: never falls.
    pub travelled_cycles: f64,
    /// The last tick by then, in s, and the cycles travelled by that.
    pub tick: (f64, f64),
}

/// The points whose middle is not known yet, and those that it takes.
#[derive(Clone, Debug, Default)]
pub struct AboutMiddle {
    points: VecDeque<Kept>,
    /// The first point that waits.
    next: usize,
    /// Cycles travelled where the hand turned last, or at the first point.
    begins_cycles: Option<f64>,
    /// The same of the point that was handed on last.
    handed_cycles: f64,
}

#[derive(Clone, Copy, Debug)]
struct Kept {
    point: Point,
    /// The integral over travel of the voltage before it, in V·cycles: straight from point to point.
    area: f64,
    /// Cycles travelled at the ends of the stroke that it is in; the end is infinite until it is known.
    begins_cycles: f64,
    ends_cycles: f64,
}

impl AboutMiddle {
    /// The hand has turned back at `cycles` travelled, after all points so far.
    pub fn turn(&mut self, cycles: f64) {
        let open = |kept: &&mut Kept| kept.ends_cycles.is_infinite();
        for kept in self.points.iter_mut().rev().take_while(open) {
            kept.ends_cycles = cycles;
        }
        if self.begins_cycles.is_some() {
            self.begins_cycles = Some(cycles);
        }
    }

    /// Takes the next point. Hands on, in order, each point whose middle is known now, with its voltage less
    /// that; none for one that is within half a cycle of a turning point or of the beginning, and none between
    /// two strokes.
    pub fn add(&mut self, point: Point, mut hand_on: impl FnMut(Option<(f64, &Point)>)) {
        if self.points.len() >= POINTS_KEPT {
            *self = Self::default();
            hand_on(None);
        }
        let begins_cycles = *self.begins_cycles.get_or_insert(point.travelled_cycles);
        let area = self.points.back().map_or(0.0, |before| {
            let way = point.travelled_cycles - before.point.travelled_cycles;
            before.area + HALF * (before.point.volts + point.volts) * way
        });
        self.points.push_back(Kept {
            point,
            area,
            begins_cycles,
            ends_cycles: f64::INFINITY,
        });
        let last_cycles = point.travelled_cycles - HALF;
        while let Some(kept) = self.points.get(self.next)
            && kept.point.travelled_cycles <= last_cycles
        {
            if kept.begins_cycles != self.handed_cycles {
                self.handed_cycles = kept.begins_cycles;
                hand_on(None);
            }
            let at = kept.point.travelled_cycles;
            let stroke = kept.begins_cycles + HALF..=kept.ends_cycles - HALF;
            hand_on(stroke.contains(&at).then(|| {
                let volts = kept.point.volts - self.area(at + HALF) + self.area(at - HALF);
                (volts, &kept.point)
            }));
            self.next += 1;
        }
        self.forget();
    }

    /// How many points are held.
    pub fn held(&self) -> usize {
        self.points.len()
    }

    /// Lets go of what no point that waits needs.
    fn forget(&mut self) {
        let first_cycles = self
            .points
            .get(self.next)
            .map_or(f64::INFINITY, |kept| kept.point.travelled_cycles - HALF);
        while self.next > 0
            && let Some(second) = self.points.get(1)
            && second.point.travelled_cycles < first_cycles
        {
            self.points.pop_front();
            self.next -= 1;
        }
    }

    /// From the first point to `cycles`, which is not beyond the ends, in V·cycles.
    fn area(&self, cycles: f64) -> f64 {
        let after = self
            .points
            .partition_point(|kept| kept.point.travelled_cycles < cycles);
        let before = after
            .checked_sub(1)
            .and_then(|before| self.points.get(before));
        match (before, self.points.get(after)) {
            (Some(from), Some(to)) => {
                let way = cycles - from.point.travelled_cycles;
                let share = way / (to.point.travelled_cycles - from.point.travelled_cycles);
                let rise_v = to.point.volts - from.point.volts;
                from.area + way * (from.point.volts + HALF * share * rise_v)
            }
            (Some(end), None) | (None, Some(end)) => end.area,
            (None, None) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::stimulus::{Stimulus, Told};
    use crate::judge::synthetic::Run;
    use crate::judge::truth::Truth;
    use crate::run::observer::{RunEvent, RunObserver, replay_to};
    use crate::run::recording::{ACTUATORS, WORD_V, volts};

    /// For each stroke, the instants in s and the voltage of actuator 0 about its middle.
    struct Strokes {
        stimulus: Stimulus,
        middle: AboutMiddle,
        found: Vec<Vec<(f64, f64)>>,
    }

    impl RunObserver for Strokes {
        fn see(&mut self, event: RunEvent<'_>) {
            self.stimulus.see(event);
            self.follow();
        }
    }

    impl Strokes {
        fn follow(&mut self) {
            while let Some(told) = self.stimulus.take() {
                let (edge, due) = match told {
                    Told::Turned(cycles) => {
                        self.middle.turn(cycles);
                        continue;
                    }
                    Told::Point(edge, due) => (edge, due),
                };
                let point = Point {
                    edge,
                    volts: volts(edge.words[0]),
                    travelled_cycles: due.travelled_cycles,
                    tick: due.tick,
                };
                self.middle.add(point, |about| match about {
                    Some((volts, point)) => {
                        if let Some(stroke) = self.found.last_mut() {
                            stroke.push((point.edge.t_s, volts));
                        }
                    }
                    None => self.found.push(Vec::new()),
                });
            }
        }
    }

    fn strokes(run: &Run) -> Vec<Vec<(f64, f64)>> {
        let mut strokes = Strokes {
            stimulus: Stimulus::new(&Truth::new("", "", &*run.surface_mm)),
            middle: AboutMiddle::default(),
            found: vec![Vec::new()],
        };
        replay_to(&run.record(), &mut strokes);
        strokes.stimulus.end();
        strokes.follow();
        strokes.found.retain(|stroke| !stroke.is_empty());
        strokes.found
    }

    #[test]
    fn an_offset_that_decays_is_taken_off_and_the_sine_is_left() {
        const TIME_CONSTANT_S: f64 = 0.26;
        // Within the range together.
        let run = |standing_v: fn(f64) -> f64| Run {
            amplitude_v: 4.0,
            standing_v: Box::new(standing_v),
            ..Run::steady(50.0, 2.0)
        };
        let [offset] = &strokes(&run(|t_s| (-t_s / TIME_CONSTANT_S).exp()))[..] else {
            panic!("the hand does not turn")
        };
        let [sine] = &strokes(&run(|_| 0.0))[..] else {
            panic!("the hand does not turn")
        };
        // The first word of a sine is 0 V, and no edge.
        assert_eq!(offset.len(), sine.len() + 1);
        for (offset, sine) in offset[1..].iter().zip(sine) {
            assert_eq!(offset.0, sine.0);
            // 25 Hz; a point and all of its cycle are rounded to steps of the DAC.
            let left_v =
                (-offset.0 / TIME_CONSTANT_S).exp() * (0.04 / TIME_CONSTANT_S).powi(2) / 24.0;
            // The next term of the series, (T/τ)⁴/1920, is a thousandth of it.
            let bound_v = 1.001 * left_v + 2.0 * WORD_V;
            let apart_v = (offset.1 - sine.1).abs();
            assert!(apart_v <= bound_v, "{apart_v} V at {} s", offset.0);
        }
    }

    #[test]
    fn the_half_cycles_beside_turning_points_and_ends_are_left_out() {
        // 15 cycles of 40 ms a stroke, of which the first begins at 12 ms: an estimate is followed then.
        let strokes = strokes(&Run::to_and_fro(50.0, 0.6, 2.0));
        let spans: Vec<(f64, f64)> = strokes
            .iter()
            .map(|stroke| (stroke[0].0, stroke[stroke.len() - 1].0))
            .collect();
        let due = [(0.032, 0.58), (0.62, 1.18), (1.22, 1.78), (1.82, 1.98)];
        assert_eq!(spans.len(), due.len());
        for (span, due) in spans.iter().zip(due) {
            // Ticks are 0.5 ms apart.
            assert!((span.0 - due.0).abs() <= 1e-3, "{span:?} {due:?}");
            assert!((span.1 - due.1).abs() <= 1e-3, "{span:?} {due:?}");
        }
    }

    #[test]
    fn a_stroke_of_less_than_a_cycle_has_no_middle() {
        assert_eq!(
            strokes(&Run::to_and_fro(50.0, 0.039, 2.0)),
            Vec::<Vec<_>>::new()
        );
    }

    #[test]
    fn outputs_that_change_while_the_hand_rests_are_given_up() {
        let mut middle = AboutMiddle::default();
        let mut handed_on = 0;
        for number in 0..3 * POINTS_KEPT {
            let edge = Edge {
                t_s: number as f64 * 500e-6,
                words: [0x9000; ACTUATORS],
            };
            let point = Point {
                edge,
                volts: 0.0,
                travelled_cycles: 7.25,
                tick: (edge.t_s, 7.25),
            };
            middle.add(point, |about| handed_on += usize::from(about.is_some()));
            assert!(middle.held() <= POINTS_KEPT);
        }
        assert_eq!(handed_on, 0);
    }
}
