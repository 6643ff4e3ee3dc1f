//! The whole cycles of a stimulus: from one upward crossing of its middle to the next.

use crate::analysis::phase::DuePhase;

/// Share of the usual amplitude from which on a cycle counts as at full amplitude.
const FULL: f64 = 0.95;

/// A cycle at full amplitude, half a cycle or more away from where the hand turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Its first upward crossing, in s.
    pub from_s: f64,
    /// Its last, in s.
    pub to_s: f64,
}

/// The cycles at full amplitude of each stroke's voltage about its middle (s, V), in order.
pub fn cycles(strokes: &[Vec<(f64, f64)>], due: &DuePhase) -> Vec<Cycle> {
    let mut cycles: Vec<(Cycle, f64)> = strokes
        .iter()
        .flat_map(|stroke| of_stroke(stroke, due))
        .collect();
    let mut amplitudes: Vec<f64> = cycles.iter().map(|cycle| cycle.1).collect();
    amplitudes.sort_by(f64::total_cmp);
    // The upper quartile: neither fades nor a single odd cycle decide what is usual.
    let usual_v = amplitudes
        .get(amplitudes.len() * 3 / 4)
        .copied()
        .unwrap_or(0.0);
    cycles.retain(|cycle| cycle.1 >= FULL * usual_v);
    cycles.into_iter().map(|cycle| cycle.0).collect()
}

/// The cycles of a stroke, each with its amplitude in V.
fn of_stroke(stroke: &[(f64, f64)], due: &DuePhase) -> Vec<(Cycle, f64)> {
    let mut cycles = Vec::new();
    let mut start: Option<(f64, usize)> = None;
    for (index, pair) in stroke.windows(2).enumerate() {
        let [(from_s, from_v), (to_s, to_v)] = [pair[0], pair[1]];
        if from_v < 0.0 && to_v >= 0.0 {
            let crossing_s = from_s + (to_s - from_s) * from_v / (from_v - to_v);
            if let Some((start_s, first)) = start {
                let cycle = Cycle {
                    from_s: start_s,
                    to_s: crossing_s,
                };
                cycles.push((cycle, amplitude_v(cycle, &stroke[first..=index], due)));
            }
            start = Some((crossing_s, index + 1));
        }
    }
    cycles
}

/// √2 of the root mean square over a cycle of travel, however few its points and however uneven the
/// speed; 0 without travel.
fn amplitude_v(cycle: Cycle, within: &[(f64, f64)], due: &DuePhase) -> f64 {
    let mut before = (due.travelled_cycles(cycle.from_s), 0.0);
    let (mut sum, start) = (0.0, before.0);
    for &(t_s, v) in within.iter().chain(&[(cycle.to_s, 0.0)]) {
        let now = (due.travelled_cycles(t_s), v * v);
        sum += 0.5 * (before.1 + now.1) * (now.0 - before.0);
        before = now;
    }
    let whole = before.0 - start;
    if whole > 0.0 {
        (2.0 * sum / whole).sqrt()
    } else {
        0.0
    }
}

/// The cycles that follow another one at full amplitude. The first after a fade may still have grown
/// by a few percent, which gives it a mean of its own.
pub fn continued(cycles: &[Cycle]) -> Vec<Cycle> {
    let pairs = cycles
        .windows(2)
        .filter(|pair| pair[0].to_s == pair[1].from_s);
    pairs.map(|pair| pair[1]).collect()
}

/// The longest run of cycles that follow each other, as one, but for the first and the last of it: beside
/// these the stimulus may have faded, which moves the middle of their outer crossings. Also how many it has.
pub fn longest_stretch(cycles: &[Cycle]) -> Option<(Cycle, usize)> {
    let runs = cycles.chunk_by(|one, next| one.to_s == next.from_s);
    runs.filter_map(|run| {
        let [_, inner @ .., _] = run else { return None };
        let stretch = Cycle {
            from_s: inner.first()?.from_s,
            to_s: inner.last()?.to_s,
        };
        Some((stretch, inner.len()))
    })
    .max_by(|(one, _), (other, _)| {
        let duration_s = |cycle: &Cycle| cycle.to_s - cycle.from_s;
        duration_s(one).total_cmp(&duration_s(other))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::Run;
    use crate::analysis::{Verdict, judge};
    use crate::expectation::unmet;
    use crate::recording::WORD_V;
    use crate::scene::Expect;
    use crate::truth::Truth;

    /// What a display's balance works off with, in s.
    const TIME_CONSTANT_S: f64 = firmware_display::balance::TIME_CONSTANT_S;
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
        let cycle = |from: u32| Cycle {
            from_s: f64::from(from),
            to_s: f64::from(from + 1),
        };
        let stretch = |cycles: &[u32]| {
            let cycles: Vec<Cycle> = cycles.iter().copied().map(cycle).collect();
            longest_stretch(&cycles).map(|(stretch, count)| (stretch.from_s, stretch.to_s, count))
        };
        assert_eq!(stretch(&[0, 1, 2, 5, 6, 7, 8, 9]), Some((6.0, 9.0, 3)));
        assert_eq!(stretch(&[0, 1, 5, 6]), None);
        assert_eq!(stretch(&[]), None);
    }
}
