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

use crate::analysis::phase::DuePhase;
use crate::analysis::track::Track;

/// Half of the cycle about an instant.
const HALF: f64 = 0.5;

/// For each stroke of the hand that is longer than a cycle, in order: a voltage (s, V) less its middle, but
/// for the half cycles beside the turning points, or beside the ends of the voltage.
pub fn about_middle(voltage: &[(f64, f64)], hand: &Track, due: &DuePhase) -> Vec<Vec<(f64, f64)>> {
    let area = Area::new(voltage, due);
    let strokes = hand.strokes().into_iter().map(|(from_s, to_s)| {
        let from = due.travelled_cycles(from_s).max(area.first_cycles()) + HALF;
        let to = due.travelled_cycles(to_s).min(area.last_cycles()) - HALF;
        let first = voltage.partition_point(|point| point.0 < from_s);
        let end = voltage.partition_point(|point| point.0 <= to_s);
        (first..end.max(first))
            .filter_map(|index| {
                let at = area.cycles[index];
                let (t_s, volts) = voltage[index];
                (from..=to)
                    .contains(&at)
                    .then(|| (t_s, volts - area.until(at + HALF) + area.until(at - HALF)))
            })
            .collect::<Vec<_>>()
    });
    strokes.filter(|stroke| !stroke.is_empty()).collect()
}

/// The integral over travel of a voltage that goes straight from point to point.
struct Area<'a> {
    voltage: &'a [(f64, f64)],
    /// How far each point is, in cycles travelled: never falls.
    cycles: Vec<f64>,
    /// Of all before each point, in V·cycles.
    areas: Vec<f64>,
}

impl<'a> Area<'a> {
    fn new(voltage: &'a [(f64, f64)], due: &DuePhase) -> Self {
        let cycles: Vec<f64> = voltage
            .iter()
            .map(|point| due.travelled_cycles(point.0))
            .collect();
        let mut area = 0.0;
        let mut areas = Vec::with_capacity(voltage.len());
        for index in 0..voltage.len() {
            if let Some(before) = index.checked_sub(1) {
                area += HALF
                    * (voltage[before].1 + voltage[index].1)
                    * (cycles[index] - cycles[before]);
            }
            areas.push(area);
        }
        Self {
            voltage,
            cycles,
            areas,
        }
    }

    fn first_cycles(&self) -> f64 {
        self.cycles.first().copied().unwrap_or(0.0)
    }

    fn last_cycles(&self) -> f64 {
        self.cycles.last().copied().unwrap_or(0.0)
    }

    /// From the first point to `cycles`, which is not beyond the ends, in V·cycles.
    fn until(&self, cycles: f64) -> f64 {
        let after = self.cycles.partition_point(|&before| before < cycles);
        let (Some(before), true) = (after.checked_sub(1), after < self.cycles.len()) else {
            return self.areas.get(after).copied().unwrap_or(0.0);
        };
        let (from_v, to_v) = (self.voltage[before].1, self.voltage[after].1);
        let way = cycles - self.cycles[before];
        let share = way / (self.cycles[after] - self.cycles[before]);
        self.areas[before] + way * (from_v + HALF * share * (to_v - from_v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::Run;
    use crate::analysis::voltage::voltage;
    use crate::recording::WORD_V;
    use crate::truth::Truth;

    fn strokes(run: &Run) -> Vec<Vec<(f64, f64)>> {
        let recording = run.record();
        let due = DuePhase::new(&Truth::new("", "", &*run.surface_mm), &recording);
        about_middle(&voltage(&recording, 0), &Track::of_hand(&recording), &due)
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
}
