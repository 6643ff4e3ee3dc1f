//! The whole cycles of a stimulus: from one upward zero crossing to the next.

use crate::analysis::track::Track;
use crate::analysis::voltage::peak_v;

/// Share of the highest voltage that both half waves must reach for the stimulus to count as at
/// full amplitude: five samples a cycle can miss a crest by 1 − cos(π/5) = 0.19.
const FULL: f64 = 0.8;

/// A cycle at full amplitude, during which the hand did not turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Its first upward crossing, in s.
    pub from_s: f64,
    /// Its last, in s.
    pub to_s: f64,
}

/// The cycles of a voltage (s, V) at full amplitude, in order.
pub fn cycles(voltage: &[(f64, f64)], hand: &Track) -> Vec<Cycle> {
    let full_v = FULL * peak_v(voltage);
    let mut cycles = Vec::new();
    let mut start: Option<(f64, usize)> = None;
    for (index, pair) in voltage.windows(2).enumerate() {
        let [(from_s, from_v), (to_s, to_v)] = [pair[0], pair[1]];
        if from_v < 0.0 && to_v >= 0.0 {
            let crossing_s = from_s + (to_s - from_s) * from_v / (from_v - to_v);
            if let Some((start_s, first)) = start {
                let within = &voltage[first..=index];
                let full = within.iter().any(|point| point.1 >= full_v)
                    && within.iter().any(|point| point.1 <= -full_v);
                let cycle = Cycle {
                    from_s: start_s,
                    to_s: crossing_s,
                };
                if full && !turns(hand, cycle) {
                    cycles.push(cycle);
                }
            }
            start = Some((crossing_s, index + 1));
        }
    }
    cycles
}

/// The longest run of cycles that follow each other, as one: from the first crossing to the last.
/// Also how many they are.
pub fn longest_stretch(cycles: &[Cycle]) -> Option<(Cycle, usize)> {
    let mut longest: Option<(Cycle, usize)> = None;
    let mut run: Option<(Cycle, usize)> = None;
    for &cycle in cycles {
        let (stretch, count) = match run {
            Some((before, count)) if before.to_s == cycle.from_s => (
                Cycle {
                    from_s: before.from_s,
                    to_s: cycle.to_s,
                },
                count + 1,
            ),
            _ => (cycle, 1),
        };
        run = Some((stretch, count));
        let duration_s = |cycle: Cycle| cycle.to_s - cycle.from_s;
        if longest.is_none_or(|(before, _)| duration_s(stretch) > duration_s(before)) {
            longest = run;
        }
    }
    longest
}

/// Whether the hand moved both ways during a cycle.
fn turns(hand: &Track, cycle: Cycle) -> bool {
    let points = hand.points();
    let from = points.partition_point(|point| point.0 < cycle.from_s);
    let to = points.partition_point(|point| point.0 <= cycle.to_s);
    let steps = || {
        points[from..to]
            .windows(2)
            .map(|pair| pair[1].1 - pair[0].1)
    };
    steps().any(|step| step > 0.0) && steps().any(|step| step < 0.0)
}
