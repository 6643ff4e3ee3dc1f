//! How long a movement of the hand takes to reach the outputs.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use serde::Serialize;

use crate::plant::motion::MM_PER_COUNT;
use crate::run::recording::{ACTUATORS, OutputRecord, TickRecord, WORD_V, ZERO_VOLT};

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

/// How far each actuator has been from 0 V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peaks([u16; ACTUATORS]);

impl Peaks {
    /// Before the first output.
    pub const NONE: Self = Self([0; ACTUATORS]);
    const FARTHEST: Self = Self([ZERO_VOLT; ACTUATORS]);

    /// Takes the next words.
    pub fn add(&mut self, words: &[u16; ACTUATORS]) {
        for (peak, word) in self.0.iter_mut().zip(words) {
            *peak = (*peak).max(word.abs_diff(ZERO_VOLT));
        }
    }

    /// The highest voltage of either sign that an actuator had, in V.
    pub fn volts(&self, actuator: usize) -> f64 {
        f64::from(self.0[actuator]) * WORD_V
    }
}

/// Times that are uniformly spread between two bounds, in ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Spread {
    shortest_ns: u64,
    longest_ns: u64,
}

/// Movement between two ticks that no edge has carried so far.
#[derive(Clone, Copy, Debug)]
struct Moved {
    from_ns: u64,
    to_ns: u64,
    travel_mm: f64,
}

/// Movement without an edge at its tick: whether it asked for one is known at the end.
#[derive(Clone, Debug)]
struct Late {
    spread: Spread,
    travel_mm: f64,
    held: Box<[u16; ACTUATORS]>,
}

/// Measures every instant of movement while the stimulus is on.
///
/// Movement between two ticks shows at the second one's encoder reading and is carried by the first
/// edge after it: its times are spread uniformly from that tick's to a tick more. Movement that asks
/// for no edge is left out: below one count, while every output is at 0 V (no λ yet, faded out), or
/// from one side of a crest to the other, where a tick may end at the voltage it began with. Where crests
/// are, the highest voltages and the shortest λ̂ of the whole run tell.
///
/// Kept is how much movement took which times, and what may have been over a crest: two ticks a cycle at most,
/// while outputs change at all.
#[derive(Clone, Debug, Default)]
pub struct Reactions {
    tick: Option<TickRecord>,
    /// What the outputs hold, if they are not all at 0 V.
    held: Option<[u16; ACTUATORS]>,
    moved: Vec<Moved>,
    /// From `native` there are few different ones.
    spreads: BTreeMap<Spread, u64>,
    late: Vec<Late>,
}

impl Reactions {
    /// A tick of the display's.
    pub fn tick(&mut self, tick: &TickRecord) {
        if let Some(before) = self.tick.replace(*tick)
            && before.encoder != tick.encoder
            && self.held.is_some()
        {
            self.moved.push(Moved {
                from_ns: before.at_ns,
                to_ns: tick.at_ns,
                travel_mm: (tick.position_mm - before.position_mm).abs() + MM_PER_COUNT,
            });
        }
    }

    /// The outputs have changed, while `shortest_mm` is the shortest λ̂ so far.
    pub fn output(&mut self, output: &OutputRecord, shortest_mm: Option<f64>) {
        self.carry(output.at_ns, shortest_mm);
        let is_at_rest = output.words.iter().all(|&word| word == ZERO_VOLT);
        self.held = (!is_at_rest).then_some(output.words);
    }

    /// What has moved until now is carried at `at_ns`.
    fn carry(&mut self, at_ns: u64, shortest_mm: Option<f64>) {
        if let Some(held) = &self.held {
            for moved in self.moved.drain(..) {
                let spread = Spread {
                    shortest_ns: at_ns - moved.to_ns,
                    longest_ns: at_ns - moved.from_ns,
                };
                let period_ns = moved.to_ns - moved.from_ns;
                if spread.shortest_ns < period_ns {
                    *self.spreads.entry(spread).or_default() += 1;
                } else if !is_over_crests(held, &Peaks::FARTHEST, moved.travel_mm, shortest_mm) {
                    // What is over a crest of the highest voltage there is, is so whatever follows: a shorter
                    // λ̂ only widens it.
                    self.late.push(Late {
                        spread,
                        travel_mm: moved.travel_mm,
                        held: Box::new(*held),
                    });
                }
            }
        }
    }

    /// The times, with the `peaks` and the shortest λ̂ of the whole run; none without movement.
    pub fn finish(mut self, peaks: &Peaks, shortest_mm: Option<f64>) -> Option<Reaction> {
        // What no edge has carried by the end is that late at least; of the last tick an edge may be on its way.
        let end_ns = self.tick.map_or(0, |tick| tick.at_ns);
        self.moved
            .retain(|moved| end_ns - moved.to_ns >= moved.to_ns - moved.from_ns);
        self.carry(end_ns, shortest_mm);
        for late in &self.late {
            if !is_over_crests(&late.held, peaks, late.travel_mm, shortest_mm) {
                *self.spreads.entry(late.spread).or_default() += 1;
            }
        }
        let longest_ns = self.spreads.keys().map(|spread| spread.longest_ns).max()? as f64;
        Some(Reaction {
            p50_ms: quantile_ns(&self.spreads, 0.5, longest_ns) * 1e-6,
            p99_ms: quantile_ns(&self.spreads, 0.99, longest_ns) * 1e-6,
            max_ms: longest_ns * 1e-6,
        })
    }

    /// How many movements are held, and how many different times.
    pub fn held(&self) -> (usize, usize) {
        (self.moved.len() + self.late.len(), self.spreads.len())
    }
}

/// Whether every actuator is so near a crest that the travel may take it as far behind as it is
/// before it now, within the rounding of the words.
fn is_over_crests(
    held: &[u16; ACTUATORS],
    peaks: &Peaks,
    travel_mm: f64,
    shortest_mm: Option<f64>,
) -> bool {
    let travel_cycles = shortest_mm.map_or(0.0, |shortest_mm| travel_mm / shortest_mm);
    let share = (PI * travel_cycles).min(FRAC_PI_2).cos();
    held.iter().enumerate().all(|(actuator, word)| {
        let held_v = f64::from(word.abs_diff(ZERO_VOLT)) * WORD_V;
        held_v >= share * peaks.volts(actuator) - WORD_V
    })
}

/// How closely a quantile is found, in ns.
const CLOSE_NS: f64 = 1e-3;

/// The time that a share of all movement stays below, found by halving.
fn quantile_ns(spreads: &BTreeMap<Spread, u64>, share: f64, longest_ns: f64) -> f64 {
    let below = |ns: f64| -> f64 {
        let spent = |(spread, &count): (&Spread, &u64)| {
            let shortest_ns = spread.shortest_ns as f64;
            count as f64 * (ns.clamp(shortest_ns, spread.longest_ns as f64) - shortest_ns)
        };
        spreads.iter().map(spent).sum()
    };
    let due = share * below(longest_ns);
    let (mut low, mut high) = (0.0, longest_ns);
    while high - low > CLOSE_NS {
        let middle = 0.5 * (low + high);
        if below(middle) < due {
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
    use crate::judge::actuators::judge;
    use crate::judge::synthetic::Run;
    use crate::judge::truth::Truth;
    use crate::run::recording::Recording;

    /// Bound in ms: instants are whole ns.
    const EXACT_MS: f64 = 1e-5;

    fn measured(recording: &Recording) -> Option<Reaction> {
        let surface = |_| 2.0;
        judge(&Truth::new("", "", &surface), recording).hand_to_output
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
    fn outputs_that_stand_still_until_the_end_are_as_late_as_that() {
        let mut recording = Run::steady(50.0, 2.0).record();
        recording
            .outputs
            .retain(|output| output.at_ns < 1_000_000_000);
        let reaction = measured(&recording).expect("a hand moves");
        assert!(reaction.max_ms > 900.0, "{reaction:?}");
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
