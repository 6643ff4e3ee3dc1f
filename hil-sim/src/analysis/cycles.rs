//! The whole cycles of a stimulus: from one upward zero crossing to the next.

use crate::analysis::phase::DuePhase;
use crate::analysis::track::Track;

/// Share of the usual amplitude from which on a cycle counts as at full amplitude.
const FULL: f64 = 0.95;

/// A cycle at full amplitude, during which the hand did not turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Its first upward crossing, in s.
    pub from_s: f64,
    /// Its last, in s.
    pub to_s: f64,
}

/// The cycles of a voltage (s, V) at full amplitude, in order.
pub fn cycles(voltage: &[(f64, f64)], hand: &Track, due: &DuePhase) -> Vec<Cycle> {
    let mut cycles = Vec::new();
    let mut start: Option<(f64, usize)> = None;
    for (index, pair) in voltage.windows(2).enumerate() {
        let [(from_s, from_v), (to_s, to_v)] = [pair[0], pair[1]];
        if from_v < 0.0 && to_v >= 0.0 {
            let crossing_s = from_s + (to_s - from_s) * from_v / (from_v - to_v);
            if let Some((start_s, first)) = start {
                let cycle = Cycle {
                    from_s: start_s,
                    to_s: crossing_s,
                };
                cycles.push((cycle, amplitude_v(cycle, &voltage[first..=index], due)));
            }
            start = Some((crossing_s, index + 1));
        }
    }
    cycles.retain(|(cycle, _)| !turns(hand, *cycle));
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
