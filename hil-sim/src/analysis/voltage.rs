//! One actuator's voltage over time.

use crate::analysis::seconds;
use crate::recording::{Recording, volts};

/// A gap between two edges longer than this many ticks is a hold, not a slope.
const HOLD_TICKS: f64 = 1.5;

/// The voltage of an actuator at every LDAC edge, in s and V. Where the words did not change for a
/// while (a hand at rest needs no edge), a point just before the next edge keeps the hold level.
pub fn voltage(recording: &Recording, actuator: usize) -> Vec<(f64, f64)> {
    let tick_s = tick_s(recording);
    let mut points: Vec<(f64, f64)> = Vec::with_capacity(recording.outputs.len());
    for output in &recording.outputs {
        let t_s = seconds(output.at_ns);
        if let (Some(&(before_s, before_v)), Some(tick_s)) = (points.last(), tick_s)
            && t_s - before_s > HOLD_TICKS * tick_s
        {
            points.push((t_s - tick_s, before_v));
        }
        points.push((t_s, volts(output.words[actuator])));
    }
    points
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
