//! How long a movement of the hand takes to reach the outputs.

use serde::Serialize;

use crate::analysis::finite;
use crate::recording::{Recording, volts};

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
/// edge after it: its times are spread uniformly from that tick's to a tick more. Movement below
/// one count, or while every output is at 0 V (no λ yet, faded out), asks for no edge and is left out.
pub fn reaction(recording: &Recording) -> Option<Reaction> {
    let mut spreads = Vec::new();
    let outputs = &recording.outputs;
    for pair in recording.ticks.windows(2) {
        let [before, tick] = [pair[0], pair[1]];
        if before.encoder == tick.encoder {
            continue;
        }
        let next = outputs.partition_point(|output| output.at_ns < tick.at_ns);
        let on = next
            .checked_sub(1)
            .and_then(|last| outputs.get(last))
            .is_some_and(|output| output.words.iter().any(|&word| volts(word) != 0.0));
        if let Some(edge) = outputs.get(next).filter(|_| on) {
            spreads.push(Spread {
                shortest_ns: edge.at_ns as f64 - tick.at_ns as f64,
                longest_ns: edge.at_ns as f64 - before.at_ns as f64,
            });
        }
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

/// The time that a share of all movement stays below, found by halving, to well below a ns.
fn quantile_ns(spreads: &[Spread], share: f64, longest_ns: f64) -> f64 {
    let whole: f64 = spreads.iter().map(|s| s.longest_ns - s.shortest_ns).sum();
    let (mut low, mut high) = (0.0, longest_ns);
    for _ in 0..60 {
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

    /// Bound in ms: instants are whole ns.
    const EXACT_MS: f64 = 1e-5;

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
        let reaction = reaction(&run.record()).unwrap();
        assert!(near(reaction.p50_ms, 0.35), "{reaction:?}");
        assert!(near(reaction.p99_ms, 0.595), "{reaction:?}");
        assert!(near(reaction.max_ms, 0.6), "{reaction:?}");
    }

    #[test]
    fn two_sorts_of_edges_mix_their_spreads() {
        // Half of the edges 0.1 ms, half 0.4 ms after their tick: 0.1 to 0.6 and 0.4 to 0.9 ms.
        let run = Run {
            edge_s: Box::new(|t_s| {
                if (t_s / 500e-6).round() as u32 % 2 == 0 {
                    0.1e-3
                } else {
                    0.4e-3
                }
            }),
            ..Run::steady(50.0, 2.0)
        };
        let reaction = reaction(&run.record()).unwrap();
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
        let reaction = reaction(&recording).unwrap();
        // Up to the tick before the missing edge, a whole tick more than the others.
        assert!(near(reaction.max_ms, 1.0), "{reaction:?}");
    }

    #[test]
    fn a_hand_at_rest_and_outputs_at_zero_have_no_reaction() {
        assert_eq!(reaction(&Run::steady(0.0, 2.0).record()), None);
        let run = Run {
            estimate: Box::new(|_| (2.0, false)),
            ..Run::steady(50.0, 2.0)
        };
        assert_eq!(reaction(&run.record()), None);
    }
}
