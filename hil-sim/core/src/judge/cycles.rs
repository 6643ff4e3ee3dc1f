//! The whole cycles of a stimulus: from one upward crossing of its middle to the next.

use crate::judge::middle::Point;

/// Share of the usual amplitude from which on a cycle counts as at full amplitude.
const FULL: f64 = 0.95;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Crossing {
    t_s: f64,
    travelled_cycles: f64,
    /// Of the cycle that ends here, in V; none if none does.
    amplitude_v: Option<f64>,
}

/// The longest time in which cycles at full amplitude follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Cycles of the voltage.
    pub cycles: usize,
    /// Cycles travelled.
    pub travelled_cycles: f64,
    /// Its length, in s.
    pub length_s: f64,
}

/// The cycles of each stroke's voltage about its middle, half a cycle or more away from where the hand turned:
/// their crossings are kept.
#[derive(Clone, Debug, Default)]
pub struct Cycles {
    crossings: Vec<Crossing>,
    /// The last point, and its voltage about the middle; none where a stroke begins.
    before: Option<(f64, Point)>,
    open: Option<Open>,
}

#[derive(Clone, Debug)]
struct Open {
    begins_cycles: f64,
    /// The integral over travel of the squared voltage, in V²·cycles.
    square: f64,
    /// Where that has come to, in cycles, and the squared voltage there, in V².
    before: (f64, f64),
}

impl Open {
    fn add(&mut self, cycles: f64, volts: f64) {
        let now = (cycles, volts * volts);
        self.square += 0.5 * (self.before.1 + now.1) * (now.0 - self.before.0);
        self.before = now;
    }

    /// √2 of the root mean square over the cycle's travel, in V, however few its points and however uneven the
    /// speed; 0 without travel.
    fn amplitude_v(&self) -> f64 {
        let whole = self.before.0 - self.begins_cycles;
        if whole > 0.0 {
            (2.0 * self.square / whole).sqrt()
        } else {
            0.0
        }
    }
}

impl Cycles {
    /// Takes the next point of a stroke, with its voltage about the middle, in V; none where a stroke ends.
    pub fn add(&mut self, about: Option<(f64, &Point)>) {
        let Some((volts, point)) = about else {
            self.before = None;
            self.open = None;
            return;
        };
        let Some((before_v, before)) = self.before.replace((volts, *point)) else {
            return;
        };
        if before_v < 0.0 && volts >= 0.0 {
            let length_s = point.edge.t_s - before.edge.t_s;
            let t_s = before.edge.t_s + length_s * before_v / (before_v - volts);
            let cycles = travelled_cycles(&before, point, t_s);
            self.cross(t_s, cycles);
        }
        if let Some(open) = &mut self.open {
            open.add(point.travelled_cycles, volts);
        }
    }

    /// A cycle ends between two points, and the next one begins.
    fn cross(&mut self, t_s: f64, travelled_cycles: f64) {
        let amplitude_v = self.open.take().map(|mut open| {
            open.add(travelled_cycles, 0.0);
            open.amplitude_v()
        });
        self.crossings.push(Crossing {
            t_s,
            travelled_cycles,
            amplitude_v,
        });
        self.open = Some(Open {
            begins_cycles: travelled_cycles,
            square: 0.0,
            before: (travelled_cycles, 0.0),
        });
    }

    /// The amplitude from which on a cycle counts as full, in V.
    fn full_v(&self) -> f64 {
        let mut amplitudes: Vec<f64> = self
            .crossings
            .iter()
            .filter_map(|crossing| crossing.amplitude_v)
            .collect();
        let usual = amplitudes.len() * 3 / 4;
        if amplitudes.is_empty() {
            return 0.0;
        }
        // The upper quartile: neither fades nor a single odd cycle decide what is usual.
        let (_, usual_v, _) = amplitudes.select_nth_unstable_by(usual, f64::total_cmp);
        FULL * *usual_v
    }

    /// The longest run of full cycles that follow each other, as one, but for the first and the last of it:
    /// beside these the stimulus may have faded, which moves the middle of their outer crossings.
    pub fn longest_stretch(&self) -> Option<Stretch> {
        let full_v = self.full_v();
        let full = |crossing: &Crossing| crossing.amplitude_v.is_some_and(|volts| volts >= full_v);
        let runs = self.crossings.chunk_by(|_, next| full(next));
        runs.filter_map(|run| {
            let [_, from, .., to, _] = run else {
                return None;
            };
            Some(Stretch {
                cycles: run.len() - 3,
                travelled_cycles: to.travelled_cycles - from.travelled_cycles,
                length_s: to.t_s - from.t_s,
            })
        })
        .max_by(|one, other| one.length_s.total_cmp(&other.length_s))
    }

    /// How many crossings are held.
    pub fn held(&self) -> usize {
        self.crossings.len()
    }
}

/// The cycles travelled at an instant between two points: straight but for the tick before the second. Only where
/// a slow hand keeps one voltage for longer there were other ticks before.
fn travelled_cycles(before: &Point, point: &Point, t_s: f64) -> f64 {
    let mut from = (before.edge.t_s, before.travelled_cycles);
    let mut to = (point.edge.t_s, point.travelled_cycles);
    if from.0 < point.tick.0 && point.tick.0 < to.0 {
        if t_s < point.tick.0 {
            to = point.tick;
        } else {
            from = point.tick;
        }
    }
    let length_s = to.0 - from.0;
    if length_s > 0.0 {
        from.1 + (to.1 - from.1) * (t_s - from.0) / length_s
    } else {
        from.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::expectation::unmet;
    use crate::judge::synthetic::Run;
    use crate::judge::truth::Truth;
    use crate::judge::{Verdict, judge};
    use crate::run::recording::WORD_V;
    use crate::scene::Expect;

    /// What a display's balance works off with, in s.
    const TIME_CONSTANT_S: f64 = 0.256;
    /// What a reversal leaves in these tests, in V.
    const LEFT_V: f64 = 1.0;
    /// The amplitude in them, in V: both are within the range.
    const AMPLITUDE_V: f64 = 4.0;
    /// One count of the encoder, in cycles of 2 mm.
    const COUNT_CYCLES: f64 = 0.005 / 2.0;

    /// What stands under the sine after turns every `stroke_s`: of either sign in turn, and decaying.
    fn left(stroke_s: f64) -> Box<dyn Fn(f64) -> f64> {
        Box::new(move |t_s| {
            let stroke = (t_s / stroke_s).floor();
            let sign = if stroke % 2.0 == 0.0 { 1.0 } else { -1.0 };
            sign * LEFT_V * (-(t_s - stroke * stroke_s) / TIME_CONSTANT_S).exp()
        })
    }

    /// 50 mm/s to and fro over 2 mm, so 25 Hz either way, in strokes of 15 cycles.
    fn to_and_fro() -> Run {
        Run {
            amplitude_v: AMPLITUDE_V,
            standing_v: left(0.6),
            ..Run::to_and_fro(50.0, 0.6, 2.0)
        }
    }

    /// Fig. 7's hand over 2 mm: strokes of 13.4 cycles.
    fn swinging() -> Run {
        Run {
            amplitude_v: AMPLITUDE_V,
            standing_v: left(0.5 / 0.83),
            ..Run::swinging(70.0, 0.83, 2.0)
        }
    }

    /// The same, but that its frequency is off by this share.
    fn off(run: fn() -> Run, share: f64) -> Run {
        let position_mm = run().position_mm;
        Run {
            ahead_cycles: Box::new(move |t_s| share * position_mm(t_s) / 2.0),
            ..run()
        }
    }

    fn judged(run: &Run) -> Verdict {
        judge(&Truth::new("", "", &*run.surface_mm), &run.record())
    }

    /// How far the measured frequency may be off after reversals: between two crossings, `cycles` apart
    /// at least, a count of the encoder; and at either, of an offset that decays over a cycle of
    /// `period_s`, (T/τ)²/24, and half a step of the DAC, over the sine's slope.
    fn bound(cycles: f64, period_s: f64) -> f64 {
        let left_v = LEFT_V * (period_s / TIME_CONSTANT_S).powi(2) / 24.0;
        let crossing = (left_v + 0.5 * WORD_V) / (AMPLITUDE_V * std::f64::consts::TAU);
        (COUNT_CYCLES + 2.0 * crossing) / cycles
    }

    /// Of 15 cycles: the half ones beside the turning points, what is left beside a whole number of
    /// cycles, and the first and the last of these are not looked at.
    fn bound_to_and_fro() -> f64 {
        bound(11.0, 0.04)
    }

    /// Of 13.4 cycles in the same way. The first is measured from 1.5 cycles after the turning point on,
    /// where the hand is at √(2 · 2π · 0.83 Hz · 70 mm/s · 3 mm) = 47 mm/s.
    fn bound_swinging() -> f64 {
        bound(9.0, 2.0 / 46.0)
    }

    fn frequency_error(run: &Run) -> f64 {
        let actuators = judged(run).actuators;
        actuators.frequency_hz.unwrap() / actuators.truth_hz.unwrap() - 1.0
    }

    #[test]
    fn what_a_reversal_leaves_does_not_move_the_frequency() {
        let actuators = judged(&to_and_fro()).actuators;
        let (measured_hz, due_hz) = (actuators.frequency_hz.unwrap(), actuators.truth_hz.unwrap());
        assert!((due_hz - 25.0).abs() <= 25.0 * 1e-6, "{due_hz}");
        let error = measured_hz / 25.0 - 1.0;
        assert!(error.abs() <= bound_to_and_fro(), "{error}");
        let error = frequency_error(&swinging());
        assert!(error.abs() <= bound_swinging(), "{error}");
    }

    #[test]
    fn a_frequency_that_is_off_by_two_thousandths_is_measured_as_such() {
        for share in [-0.002, 0.002] {
            let error = frequency_error(&off(to_and_fro, share));
            assert!((error - share).abs() <= bound_to_and_fro(), "{error}");
            let error = frequency_error(&off(swinging, share));
            assert!((error - share).abs() <= bound_swinging(), "{error}");
        }
    }

    #[test]
    fn a_thousandth_is_met_after_reversals_and_two_are_not() {
        let expect = Expect {
            frequency_percent: Some(0.1),
            ..Expect::default()
        };
        for run in [to_and_fro as fn() -> Run, swinging] {
            assert_eq!(unmet(&expect, &judged(&run())), [] as [String; 0]);
            for share in [-0.002, 0.002] {
                let lines = unmet(&expect, &judged(&off(run, share)));
                assert!(
                    matches!(&lines[..], [line] if line.starts_with("frequency_percent")),
                    "{lines:?}"
                );
            }
        }
    }

    #[test]
    fn the_longest_stretch_is_without_what_may_border_on_a_fade() {
        // A run of crossings for each of these, with so many cycles, a second each.
        let stretch = |runs: &[usize]| {
            let mut cycles = Cycles::default();
            for (run, &count) in runs.iter().enumerate() {
                cycles.crossings.extend((0..=count).map(|number| Crossing {
                    t_s: (100 * run + number) as f64,
                    travelled_cycles: (200 * run + 2 * number) as f64,
                    amplitude_v: (number > 0).then_some(5.0),
                }));
            }
            cycles.longest_stretch()
        };
        let longest = Stretch {
            cycles: 3,
            travelled_cycles: 6.0,
            length_s: 3.0,
        };
        assert_eq!(stretch(&[3, 5, 2]), Some(longest));
        assert_eq!(stretch(&[2, 2]), None);
        assert_eq!(stretch(&[]), None);
    }

    #[test]
    fn the_longest_stretch_is_of_cycles_at_full_amplitude() {
        // A second each, of which the sixth is softer.
        let stretch = |sixth_v: f64| {
            let mut cycles = Cycles::default();
            cycles.crossings.extend((0..=12).map(|number| Crossing {
                t_s: f64::from(number),
                travelled_cycles: f64::from(number),
                amplitude_v: (number > 0).then_some(if number == 6 { sixth_v } else { 5.0 }),
            }));
            cycles.longest_stretch().map(|stretch| stretch.cycles)
        };
        assert_eq!(stretch(4.76), Some(10));
        assert_eq!(stretch(4.74), Some(4));
    }

    #[test]
    fn a_cycles_amplitude_is_the_waves_however_uneven_its_points() {
        let mut open = Open {
            begins_cycles: 3.0,
            square: 0.0,
            before: (3.0, 0.0),
        };
        assert_eq!(open.amplitude_v(), 0.0);
        for point in 1..=400 {
            let cycles = (f64::from(point) / 400.0).powi(2);
            open.add(3.0 + cycles, 2.5 * (std::f64::consts::TAU * cycles).sin());
        }
        assert!((open.amplitude_v() - 2.5).abs() < 1e-3);
    }
}
