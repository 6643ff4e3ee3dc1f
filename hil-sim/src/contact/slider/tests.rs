//! The slider against closed forms, and against a plain integration in steps of a microsecond.

use super::*;
use crate::contact::stribeck::{KINETIC, NORMAL_N};
use crate::scene::Friction;

const SCAN_S: f64 = 250e-6;
const STIFFNESS: f64 = 400.0;
const FRICTIONS: [Friction; 3] = [Friction::Mild, Friction::Strong, Friction::Severe];

fn slider(friction: Friction) -> Slider {
    Slider::new(Stribeck::new(friction), STIFFNESS)
}

/// Place of the slider at `t_s`, in m.
fn place_m(slider: &Slider, arm_m: f64) -> f64 {
    arm_m - slider.stretch_m()
}

/// What steady rubbing comes to.
#[derive(Clone, Copy, Debug)]
struct Rhythm {
    /// Slips a second, 0 if it slides.
    hz: f64,
    /// Travel of one slip, in mm: its mean.
    hop_mm: f64,
    /// Share of the time at rest.
    stuck: f64,
}

/// The rhythm of a sequence of (t, x, at rest), from 1 s on. Slips begin where rest ends.
fn rhythm(track: impl Iterator<Item = (f64, f64, bool)>) -> Rhythm {
    let (mut total, mut stuck, mut before) = (0u32, 0u32, true);
    let mut begins: Vec<(f64, f64)> = Vec::new();
    for (t_s, x_m, rests) in track.filter(|point| point.0 >= 1.0) {
        total += 1;
        stuck += u32::from(rests);
        if before && !rests {
            begins.push((t_s, x_m));
        }
        before = rests;
    }
    // The first may be cut by the beginning.
    let begins = begins.get(1..).unwrap_or(&[]);
    let (mut hz, mut hop_mm) = (0.0, 0.0);
    if let (Some(first), Some(last)) = (begins.first(), begins.last())
        && begins.len() > 2
    {
        let slips = (begins.len() - 1) as f64;
        hz = slips / (last.0 - first.0);
        hop_mm = (last.1 - first.1) / slips * 1e3;
    }
    Rhythm {
        hz,
        hop_mm,
        stuck: f64::from(stuck) / f64::from(total),
    }
}

/// Three seconds at `speed_m_s` from rest.
fn rubbed(friction: Friction, speed_m_s: f64, sub_step_s: f64) -> Rhythm {
    let mut slider = Slider {
        sub_step_s,
        ..slider(friction)
    };
    rhythm((0..12_000).map(|scan| {
        let t_s = f64::from(scan) * SCAN_S;
        slider.follow(t_s, speed_m_s * t_s);
        (t_s, place_m(&slider, speed_m_s * t_s), slider.sticks())
    }))
}

/// The same, written down once more in the plainest way: places instead of stretches, semi-implicit
/// Euler, the friction law from the paper's numbers, rest where the velocity turned and the pull allows it.
fn reference(friction: Friction, speed_m_s: f64) -> Rhythm {
    let step_s = 1e-6;
    let static_coefficient = match friction {
        Friction::Mild => 0.75,
        Friction::Strong => 1.0,
        Friction::Severe => 1.3,
    };
    let (mut x, mut v, mut rests) = (0.0f64, 0.0f64, true);
    rhythm((0..3_000_000).map(|step| {
        let t_s = f64::from(step) * step_s;
        let pull = 400.0 * (speed_m_s * t_s - x) + 0.15 * (speed_m_s - v);
        if rests && pull.abs() > 0.6 * static_coefficient {
            rests = false;
        }
        if !rests {
            let direction = if v == 0.0 { pull.signum() } else { v.signum() };
            let mu = 0.6 + (static_coefficient - 0.6) * (-(v / 0.02).powi(2)).exp();
            let after = v + step_s * (pull - direction * 0.6 * mu) / 0.004;
            if after * direction <= 0.0 && v != 0.0 && pull.abs() <= 0.6 * static_coefficient {
                (v, rests) = (0.0, true);
            } else {
                v = after;
            }
            x += step_s * v;
        }
        (t_s, x, rests)
    }))
}

#[test]
fn print_the_rhythm() {
    for friction in FRICTIONS {
        for speed_m_s in [0.03, 0.05, 0.07, 0.1] {
            println!(
                "{friction:?} {speed_m_s}: {:?} {:?} {:?}",
                rubbed(friction, speed_m_s, SUB_STEP_S),
                rubbed(friction, speed_m_s, SUB_STEP_S / 50.0),
                reference(friction, speed_m_s)
            );
        }
    }
}
