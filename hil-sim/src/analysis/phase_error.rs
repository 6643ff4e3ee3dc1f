//! How far the stimulus is from its due phase, cycle by cycle.

use std::f64::consts::TAU;

use crate::analysis::mean;
use crate::analysis::phase::DuePhase;
use crate::analysis::voltage::peak_v;

/// Root mean square of a window's voltage, over the highest voltage, from which on the stimulus
/// counts as on: a full sine has 0.71.
const ON: f64 = 0.5;
/// Points that a window needs for its two unknowns to be worth anything.
const ENOUGH_POINTS: usize = 5;

/// The stimulus' phase errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseError {
    /// Root mean square, in cycles.
    pub rms_cycles: f64,
    /// Mean, in cycles: above 0 where the stimulus is ahead.
    pub mean_cycles: f64,
}

/// Demodulates a voltage (s, V) by its due phase φ: least squares of a sin 2πφ + b cos 2πφ over
/// each cycle of travel, forwards or backwards; the phase error is atan2(b, a)/2π. None if the
/// stimulus never was on for a cycle.
pub fn phase_error(voltage: &[(f64, f64)], due: &DuePhase) -> Option<PhaseError> {
    let on_v = ON * peak_v(voltage);
    let cycle_of = |point: &(f64, f64)| due.travelled_cycles(point.0).floor();
    let errors: Vec<f64> = voltage
        .chunk_by(|one, other| cycle_of(one) == cycle_of(other))
        .filter(|window| window.len() >= ENOUGH_POINTS)
        .filter(|window| {
            let square = mean(window.iter().map(|point| point.1 * point.1)).unwrap_or(0.0);
            square > 0.0 && square.sqrt() >= on_v
        })
        .filter_map(|window| demodulate(window, due))
        .collect();
    Some(PhaseError {
        rms_cycles: mean(errors.iter().map(|error| error * error))?.sqrt(),
        mean_cycles: mean(errors.iter().copied())?,
    })
}

/// The phase of a window's voltage relative to its due phase, in cycles.
fn demodulate(window: &[(f64, f64)], due: &DuePhase) -> Option<f64> {
    let [mut ss, mut sc, mut cc, mut sv, mut cv] = [0.0; 5];
    for &(t_s, v) in window {
        let (s, c) = (TAU * due.cycles(t_s)).sin_cos();
        ss += s * s;
        sc += s * c;
        cc += c * c;
        sv += s * v;
        cv += c * v;
    }
    let determinant = ss * cc - sc * sc;
    // A window in which the phase hardly moved does not tell a from b.
    if determinant < 1e-3 * (ss + cc) * (ss + cc) {
        return None;
    }
    let a = (sv * cc - cv * sc) / determinant;
    let b = (cv * ss - sv * sc) / determinant;
    Some(b.atan2(a) / TAU)
}
