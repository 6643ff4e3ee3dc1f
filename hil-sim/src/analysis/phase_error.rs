//! How far the stimulus is from its due phase, cycle by cycle.

use std::f64::consts::TAU;

use crate::analysis::mean;
use crate::analysis::phase::DuePhase;
use crate::analysis::voltage::peak_v;

/// Root mean square of a window's voltage, over the highest voltage, from which on the stimulus
/// counts as at full amplitude: a full sine has 0.71, one that fades in over half the window 0.58.
const FULL: f64 = 0.65;
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

/// A point of a voltage beside the phase due then.
struct Point {
    volts: f64,
    due_cycles: f64,
    travelled_cycles: f64,
    /// Cycles travelled for which it stands: half of the way to each neighbour.
    weight: f64,
}

/// Demodulates a voltage (s, V) by its due phase φ: least squares of a sin 2πφ + b cos 2πφ over
/// each cycle of travel, forwards or backwards; the phase error is atan2(b, a)/2π. None if the
/// stimulus never was at full amplitude for a cycle.
pub fn phase_error(voltage: &[(f64, f64)], due: &DuePhase) -> Option<PhaseError> {
    let full_v = FULL * peak_v(voltage);
    let errors: Vec<f64> = points(voltage, due)
        .chunk_by(|one, other| one.travelled_cycles.floor() == other.travelled_cycles.floor())
        .filter(|window| window.len() >= ENOUGH_POINTS)
        .filter_map(|window| demodulate(window, full_v))
        .collect();
    Some(PhaseError {
        rms_cycles: mean(errors.iter().map(|error| error * error))?.sqrt(),
        mean_cycles: mean(errors.iter().copied())?,
    })
}

fn points(voltage: &[(f64, f64)], due: &DuePhase) -> Vec<Point> {
    let travelled: Vec<f64> = voltage
        .iter()
        .map(|point| due.travelled_cycles(point.0))
        .collect();
    voltage
        .iter()
        .enumerate()
        .map(|(at, &(t_s, volts))| {
            let before = travelled[at.saturating_sub(1)];
            let after = travelled[(at + 1).min(travelled.len() - 1)];
            Point {
                volts,
                due_cycles: due.cycles(t_s),
                travelled_cycles: travelled[at],
                weight: 0.5 * (after - before),
            }
        })
        .collect()
}

/// The phase of a window's voltage relative to its due phase, in cycles.
fn demodulate(window: &[Point], full_v: f64) -> Option<f64> {
    let [mut ss, mut sc, mut cc, mut sv, mut cv, mut vv] = [0.0; 6];
    for &Point {
        volts,
        due_cycles,
        weight,
        ..
    } in window
    {
        let (s, c) = (TAU * due_cycles).sin_cos();
        ss += weight * s * s;
        sc += weight * s * c;
        cc += weight * c * c;
        sv += weight * s * volts;
        cv += weight * c * volts;
        vv += weight * volts * volts;
    }
    // sin² + cos² = 1: this is the sum of the weights.
    let whole = ss + cc;
    let determinant = ss * cc - sc * sc;
    // A window in which the phase hardly moved does not tell a from b.
    if determinant <= 1e-3 * whole * whole || vv < full_v * full_v * whole {
        return None;
    }
    let a = (sv * cc - cv * sc) / determinant;
    let b = (cv * ss - sv * sc) / determinant;
    Some(b.atan2(a) / TAU)
}
