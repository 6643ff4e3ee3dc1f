//! The slider against closed forms, and against a plain integration in steps of a microsecond.

use super::*;
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
fn rubbed(friction: Friction, speed_m_s: f64) -> Rhythm {
    let mut slider = slider(friction);
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
fn a_resting_slider_lets_the_force_rise_with_stiffness_times_speed_until_static_friction() {
    for (friction, static_n) in FRICTIONS.into_iter().zip([0.45, 0.6, 0.78]) {
        for speed_m_s in [0.03, -0.07] {
            let mut slider = slider(friction);
            // Spring and damper together.
            let breaks_s = (static_n - 0.15 * f64::abs(speed_m_s)) / (400.0 * f64::abs(speed_m_s));
            let mut scan = 0;
            while slider.sticks() {
                let t_s = f64::from(scan) * SCAN_S;
                slider.follow(t_s, speed_m_s * t_s);
                if slider.sticks() {
                    assert!((slider.spring_n() - 400.0 * speed_m_s * t_s).abs() < 1e-12);
                }
                scan += 1;
            }
            let left_s = f64::from(scan - 1) * SCAN_S;
            assert!(
                left_s - SCAN_S <= breaks_s && breaks_s <= left_s,
                "{friction:?}"
            );
        }
    }
}

#[test]
fn a_slider_that_slides_steadily_lags_by_kinetic_friction_over_stiffness() {
    for friction in FRICTIONS {
        // So fast that the first swing does not come to rest, and e^(−(v/vs)²) is nothing.
        for speed_m_s in [0.6, -0.6] {
            let mut slider = slider(friction);
            for scan in 0..8_000 {
                let t_s = f64::from(scan) * SCAN_S;
                slider.follow(t_s, speed_m_s * t_s);
            }
            // 2 s later e^(−c/2m · 2 s) = e^(−37) of the swing is left; the rest is rounding of x_arm at
            // 1 m, 1e-16 m, taken as a velocity over 250 µs.
            let due_m = 0.6 * 0.6 / 400.0 * speed_m_s.signum();
            let lag_m = slider.stretch_m();
            assert!((lag_m - due_m).abs() < 1e-10, "{friction:?}: {lag_m} m");
        }
    }
}

#[test]
fn the_rhythm_is_that_of_a_plain_integration_in_steps_of_a_microsecond() {
    for friction in FRICTIONS {
        for speed_m_s in [0.03, 0.07] {
            let (fast, plain) = (rubbed(friction, speed_m_s), reference(friction, speed_m_s));
            // The first and the last slip are seen on a scan, ± 250 µs of 2 s: 2.5e-4. Euler's error is
            // its step times the fastest rate in a slip, 1 µs / 0.22 ms, for the tenth of the period that
            // falls into it: 5e-4.
            let bound = 7.5e-4;
            assert!(
                (fast.hz / plain.hz - 1.0).abs() < bound,
                "{friction:?} {speed_m_s}: {fast:?}, {plain:?}"
            );
            assert!(
                (fast.hop_mm / plain.hop_mm - 1.0).abs() < bound,
                "{friction:?} {speed_m_s}: {fast:?}, {plain:?}"
            );
            // A scan too many or too few in each period of 20 ms or more, on average half of one.
            assert!((fast.stuck - plain.stuck).abs() < 2e-3, "{friction:?}");
            // What it travels in a period, the arm does, too.
            assert!((fast.hop_mm * 1e-3 * fast.hz / speed_m_s - 1.0).abs() < 5e-3);
        }
    }
}

/// Places in mm every millisecond of two seconds along a stroke with three reversals; steps shorter by
/// `finer`.
fn stroke(friction: Friction, stiffness: f64, finer: f64, scans_per_ms: u32) -> Vec<f64> {
    let mut slider = Slider::new(Stribeck::new(friction), stiffness);
    slider.longest_step_s /= finer;
    let arm_m = |t_s: f64| 0.07 / 5.0 * (1.0 - (5.0 * t_s).cos());
    (0..2_000 * scans_per_ms)
        .filter_map(|scan| {
            let t_s = f64::from(scan) / f64::from(scans_per_ms) * 1e-3;
            slider.follow(t_s, arm_m(t_s));
            (scan % scans_per_ms == 0).then(|| place_m(&slider, arm_m(t_s)) * 1e3)
        })
        .collect()
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_step_does_not_matter_within_a_fifth_of_a_micrometre_nor_the_scans_within_one() {
    for friction in FRICTIONS {
        for stiffness in [100.0, 400.0, 3_000.0] {
            let places = stroke(friction, stiffness, 1.0, 4);
            // Rates are off by 3e-5, a slip of 10 ms by 0.3 µs, which at 200 mm/s is 0.06 µm. The next rest
            // begins afresh but for its place.
            let off_mm = farthest(&places, &stroke(friction, stiffness, 25.0, 4));
            assert!(off_mm < 2e-4, "{friction:?} {stiffness}: {off_mm} mm");
            // Straight lines between scans are off in velocity by a·T/2 = 350 mm/s² · 125 µs = 0.04 mm/s.
            // That moves a break by c·Δv/(k·v) = 0.3 µs at 50 mm/s, and the slip behind it by 0.06 µm; the
            // slower the arm and the softer the spring, the more.
            let off_mm = farthest(&places, &stroke(friction, stiffness, 1.0, 20));
            assert!(off_mm < 1e-3, "{friction:?} {stiffness}: {off_mm} mm");
        }
    }
}

#[test]
fn a_reversal_passes_through_rest_from_one_preload_to_the_other() {
    for friction in FRICTIONS {
        for side in [1.0, -1.0] {
            let mut slider = slider(friction);
            let speed_m_s = 0.05;
            let static_n = Stribeck::new(friction).static_n();
            // Out for a second, in a rest of its own there or not, then back.
            let arm_m = |t_s: f64| side * speed_m_s * (1.0 - (t_s - 1.0).abs());
            let mut rests: Vec<(f64, f64, f64)> = Vec::new();
            for scan in 0..5_000 {
                let t_s = f64::from(scan) * SCAN_S;
                slider.follow(t_s, arm_m(t_s));
                // From 1.02 s on: a slip that goes on at the reversal lasts 10 ms at most.
                if t_s > 1.02 && (slider.sticks() || rests.is_empty()) {
                    rests.push((t_s, place_m(&slider, arm_m(t_s)), slider.spring_n()));
                } else if !rests.is_empty() {
                    break;
                }
            }
            let (first, last) = (rests[0], rests[rests.len() - 1]);
            // It rests while the arm comes back, and the force falls by k·v.
            assert!(last.0 - first.0 > 5e-3, "{friction:?}: {rests:?}");
            assert!((last.1 - first.1).abs() < 1e-12);
            let slope = (last.2 - first.2) / (last.0 - first.0);
            assert!((slope + side * 400.0 * speed_m_s).abs() < 1e-9, "{slope}");
            // From a pull to one side until static friction to the other, within a scan's k·v and the
            // damper's c·v.
            let margin_n = 400.0 * speed_m_s * SCAN_S + 0.15 * speed_m_s;
            let end_n = last.2 * -side;
            assert!(
                end_n <= static_n && end_n > static_n - 2.0 * margin_n,
                "{friction:?}: {end_n} N of {static_n} N"
            );
        }
    }
}

#[test]
fn an_arm_that_stops_leaves_the_slider_at_rest_under_load() {
    for friction in FRICTIONS {
        let mut slider = slider(friction);
        let mut rest_m = 0.0;
        for scan in 0..8_000 {
            let t_s = f64::from(scan) * SCAN_S;
            let arm_m = 0.05 * t_s.min(1.0);
            slider.follow(t_s, arm_m);
            if scan == 6_000 {
                rest_m = slider.stretch_m();
            }
        }
        assert!(slider.sticks());
        assert_eq!(slider.stretch_m(), rest_m);
        assert!(slider.spring_n().abs() <= Stribeck::new(friction).static_n());
    }
}

#[test]
fn instants_that_do_not_advance_change_nothing() {
    let mut slider = slider(Friction::Strong);
    slider.follow(0.0, 0.0);
    slider.follow(0.01, 0.0005);
    let stretch_m = slider.stretch_m();
    slider.follow(0.01, 0.0007);
    slider.follow(0.005, 0.0);
    assert_eq!(slider.stretch_m(), stretch_m);
}
