//! How long a movement of the hand takes to reach the outputs.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::Serialize;

use crate::analysis::finite;
use crate::analysis::phase::DuePhase;
use crate::analysis::track::COUNT_MM;
use crate::recording::{ACTUATORS, OutputRecord, Recording, WORD_V, volts};

/// Time from a movement of the hand to the LDAC edge that carries it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reaction {
    /// The median, in ms.
    pub p50_ms: f64,
    /// The time that 99 % of the movement stays below, in ms.
    pub p99_ms: f64,
    /// The longest, in ms.
    pub max_ms: f64,
}

/// Times that are uniformly spread between two bounds, in ns.
#[derive(Clone, Copy, Debug)]
struct Spread {
    shortest_ns: f64,
    longest_ns: f64,
}

/// Measures every instant of movement while the stimulus is on.
///
/// Movement between two ticks shows at the second one's encoder reading and is carried by the first
/// edge after it: its times are spread uniformly from that tick's to a tick more. Movement that asks
/// for no edge is left out: below one count, while every output is at 0 V (no λ yet, faded out), or
/// from one side of a crest to the other, where a tick may end at the voltage it began with.
pub fn reaction(recording: &Recording, due: &DuePhase) -> Option<Reaction> {
    let mut spreads = Vec::new();
    let outputs = &recording.outputs;
    let peaks = peaks(outputs);
    let mut next = 0;
    for pair in recording.ticks.windows(2) {
        let [before, tick] = [pair[0], pair[1]];
        if before.encoder == tick.encoder {
            continue;
        }
        while outputs
            .get(next)
            .is_some_and(|output| output.at_ns < tick.at_ns)
        {
            next += 1;
        }
        let held = next.checked_sub(1).and_then(|last| outputs.get(last));
        let (Some(held), Some(edge)) = (held, outputs.get(next)) else {
            continue;
        };
        let period_ns = tick.at_ns.saturating_sub(before.at_ns);
        let prompt = edge.at_ns < tick.at_ns + period_ns;
        let travel_mm = (tick.position_mm - before.position_mm).abs() + COUNT_MM;
        let travel_cycles = due
            .shortest_mm()
            .map_or(0.0, |shortest_mm| travel_mm / shortest_mm);
        if is_at_rest(held) || (!prompt && is_over_crests(held, &peaks, travel_cycles)) {
            continue;
        }
        spreads.push(Spread {
            shortest_ns: edge.at_ns as f64 - tick.at_ns as f64,
            longest_ns: edge.at_ns as f64 - before.at_ns as f64,
        });
    }
    let longest_ns = spreads
        .iter()
        .map(|spread| spread.longest_ns)
        .fold(f64::NAN, f64::max);
    Some(Reaction {
        p50_ms: quantile_ns(&spreads, 0.5, longest_ns) * 1e-6,
        p99_ms: quantile_ns(&spreads, 0.99, longest_ns) * 1e-6,
        max_ms: finite(longest_ns)? * 1e-6,
    })
}

/// The highest voltage of either sign that each actuator ever had.
fn peaks(outputs: &[OutputRecord]) -> [f64; ACTUATORS] {
    let mut peaks = [0.0; ACTUATORS];
    for output in outputs {
        for (peak, &word) in peaks.iter_mut().zip(&output.words) {
            *peak = f64::max(*peak, volts(word).abs());
        }
    }
    peaks
}

fn is_at_rest(output: &OutputRecord) -> bool {
    output.words.iter().all(|&word| volts(word) == 0.0)
}

/// Whether every actuator is so near a crest that `travel_cycles` may take it as far behind as it is
/// before it now, within the rounding of the words.
fn is_over_crests(held: &OutputRecord, peaks: &[f64; ACTUATORS], travel_cycles: f64) -> bool {
    let share = (PI * travel_cycles).min(FRAC_PI_2).cos();
    held.words
        .iter()
        .zip(peaks)
        .all(|(&word, peak)| volts(word).abs() >= share * peak - WORD_V)
}

/// How closely a quantile is found, in ns.
const CLOSE_NS: f64 = 1e-3;

/// The time that a share of all movement stays below, found by halving.
fn quantile_ns(spreads: &[Spread], share: f64, longest_ns: f64) -> f64 {
    let whole: f64 = spreads.iter().map(|s| s.longest_ns - s.shortest_ns).sum();
    let (mut low, mut high) = (0.0, longest_ns);
    while high - low > CLOSE_NS {
        let middle = 0.5 * (low + high);
        let below: f64 = spreads
            .iter()
            .map(|s| middle.clamp(s.shortest_ns, s.longest_ns) - s.shortest_ns)
            .sum();
        if below < share * whole {
            low = middle
        } else {
            high = middle
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::synthetic::Run;
    use crate::truth::Truth;

    /// Bound in ms: instants are whole ns.
    const EXACT_MS: f64 = 1e-5;

    fn measured(recording: &Recording) -> Option<Reaction> {
        let surface = |_| 2.0;
        reaction(
            recording,
            &DuePhase::new(&Truth::new("", "", &surface), recording),
        )
    }

    fn near(value: f64, expected: f64) -> bool {
        (value - expected).abs() < EXACT_MS
    }

    #[test]
    fn a_constant_edge_delay_is_spread_over_one_tick() {
        // 0.1 ms after each tick: movement took 0.1 to 0.6 ms, evenly.
        let run = Run {
            edge_s: Box::new(|_| 0.1e-3),
            ..Run::steady(50.0, 2.0)
        };
        let reaction = measured(&run.record()).unwrap();
        assert!(near(reaction.p50_ms, 0.35), "{reaction:?}");
        assert!(near(reaction.p99_ms, 0.595), "{reaction:?}");
        assert!(near(reaction.max_ms, 0.6), "{reaction:?}");
    }

    #[test]
    fn two_sorts_of_edges_mix_their_spreads() {
        // 47 mm/s, so that crests fall on even and odd ticks alike.
        // Half of the edges 0.1 ms, half 0.4 ms after their tick: 0.1 to 0.6 and 0.4 to 0.9 ms.
        let run = Run {
            edge_s: Box::new(|t_s| {
                if ((t_s / 500e-6).round() as u32).is_multiple_of(2) {
                    0.1e-3
                } else {
                    0.4e-3
                }
            }),
            ..Run::steady(47.0, 2.0)
        };
        let reaction = measured(&run.record()).unwrap();
        // Half of all lies below 0.5 ms by symmetry; the last 1 % is 2 % of the late sort's 0.5 ms.
        // One tick's sort more or less of some 4 000 moves a quantile by 0.0002 ms at most.
        assert!((reaction.p50_ms - 0.5).abs() < 2e-4, "{reaction:?}");
        assert!((reaction.p99_ms - 0.89).abs() < 2e-4, "{reaction:?}");
        assert!(near(reaction.max_ms, 0.9), "{reaction:?}");
    }

    #[test]
    fn a_missing_edge_makes_the_movement_wait_for_the_next_one() {
        let run = Run::steady(50.0, 2.0);
        let mut recording = run.record();
        recording.outputs.remove(1_000);
        let reaction = measured(&recording).unwrap();
        // Up to the tick before the missing edge, a whole tick more than the others.
        assert!(near(reaction.max_ms, 1.0), "{reaction:?}");
    }

    #[test]
    fn a_crest_passed_without_an_edge_is_no_delay() {
        // 80 ticks a cycle, phases at odd 160ths: the two ticks about each crest share their voltage.
        // In the middle of a count, so that each tick is five of them.
        let run = Run {
            position_mm: Box::new(|t_s| 50.0 * t_s + 0.0025),
            ahead_cycles: Box::new(|_| 0.5 / 80.0),
            ..Run::steady(50.0, 2.0)
        };
        let recording = run.record();
        assert!(recording.outputs.len() < recording.ticks.len() - 80);
        assert!(
            near(measured(&recording).unwrap().max_ms, 0.5),
            "{:?}",
            measured(&recording)
        );
    }

    #[test]
    fn a_hand_at_rest_and_outputs_at_zero_have_no_reaction() {
        assert_eq!(measured(&Run::steady(0.0, 2.0).record()), None);
        let run = Run {
            estimate: Box::new(|_| (2.0, false)),
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(measured(&run.record()), None);
    }
}
