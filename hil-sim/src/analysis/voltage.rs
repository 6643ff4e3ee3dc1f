//! One actuator's voltage over time.

use crate::analysis::seconds;
use crate::recording::{Recording, volts};

/// A gap between two edges longer than this many ticks is a hold, not a slope.
const HOLD_TICKS: f64 = 1.5;

/// The instant of every LDAC edge in s, and the number of its output. Where the words did not change for a
/// while (a hand at rest needs no edge), a point just before the next edge keeps the last output.
pub fn edges(recording: &Recording) -> Vec<(f64, usize)> {
    let tick_s = tick_s(recording);
    let mut points: Vec<(f64, usize)> = Vec::with_capacity(recording.outputs.len());
    for (number, output) in recording.outputs.iter().enumerate() {
        let t_s = seconds(output.at_ns);
        if let (Some(&(before_s, before)), Some(tick_s)) = (points.last(), tick_s)
            && t_s - before_s > HOLD_TICKS * tick_s
        {
            points.push((t_s - tick_s, before));
        }
        points.push((t_s, number));
    }
    points
}

/// The voltage of an actuator at each of [`edges`], in s and V.
pub fn voltage(recording: &Recording, actuator: usize) -> Vec<(f64, f64)> {
    let of = |number: usize| volts(recording.outputs[number].words[actuator]);
    let edges = edges(recording).into_iter();
    edges.map(|(t_s, number)| (t_s, of(number))).collect()
}

/// The time between two ticks, in s: the median of the recorded ones.
fn tick_s(recording: &Recording) -> Option<f64> {
    let ticks = &recording.ticks;
    let mut gaps_ns: Vec<u64> = ticks
        .windows(2)
        .map(|pair| pair[1].at_ns.saturating_sub(pair[0].at_ns))
        .collect();
    let middle = gaps_ns.len() / 2;
    (!gaps_ns.is_empty())
        .then(|| *gaps_ns.select_nth_unstable(middle).1)
        .map(seconds)
}

/// The largest voltage of either sign, in V; 0 without points.
pub fn peak_v(voltage: &[(f64, f64)]) -> f64 {
    voltage
        .iter()
        .map(|point| point.1.abs())
        .fold(0.0, f64::max)
}
