//! Recordings that nobody tuned the estimators on: from [`crate::estimation::stranger`], with a ringing sensor, 1/f
//! noise, drift and offsets all at once, and judged by the goals of scenes that have none of these.

use std::f64::consts::TAU;

use hil_sim_core::judge::Summary;

use crate::estimation::running::{of_each, run};
use crate::estimation::stranger::{RECORDED_HZ, Stranger};

/// A recording's name, and what it is of.
type Recording = (&'static str, Stranger);

const FIND_STIFFNESS: &str = "[estimator]\nstiffness = \"estimated\"\n";
const MILD: Option<f64> = Some(0.68);
const STRONG: Option<f64> = Some(0.95);

fn at_35(t_s: f64) -> f64 {
    35.0 * t_s
}

fn at_40(t_s: f64) -> f64 {
    40.0 * t_s
}

fn at_50(t_s: f64) -> f64 {
    50.0 * t_s
}

fn at_65(t_s: f64) -> f64 {
    65.0 * t_s
}

fn at_70(t_s: f64) -> f64 {
    70.0 * t_s
}

/// v = 60 sin(2π 0.7 t) mm/s.
fn strokes(t_s: f64) -> f64 {
    60.0 / (TAU * 0.7) * (1.0 - (TAU * 0.7 * t_s).cos())
}

/// v = 65 sin(2π 2 t) mm/s.
fn quick_strokes(t_s: f64) -> f64 {
    65.0 / (TAU * 2.0) * (1.0 - (TAU * 2.0 * t_s).cos())
}

/// Strokes as a hand makes them: there and back in 1.6 s with the least jerk, 45 mm long, and a tremor.
fn hand(t_s: f64) -> f64 {
    let stroke = (t_s / 0.8).floor();
    let share = t_s / 0.8 - stroke;
    let eased = share.powi(3) * (10.0 + share * (6.0 * share - 15.0));
    let there = stroke as i64 % 2 == 0;
    let place_mm = 45.0 * if there { eased } else { 1.0 - eased };
    place_mm + 0.05 * (TAU * 9.0 * t_s).sin()
}

fn of(wavelength_mm: f64, arm_mm: fn(f64) -> f64) -> Stranger {
    Stranger {
        surface: vec![(wavelength_mm, 0.0)],
        arm_mm,
        ..Stranger::default()
    }
}

/// With the force channel, and the stiffness told or not.
fn sticky(
    friction: Option<f64>,
    rest_of_scene: &'static str,
    wavelength_mm: f64,
    arm_mm: fn(f64) -> f64,
) -> Stranger {
    Stranger {
        friction,
        force: true,
        rest_of_scene,
        ..of(wavelength_mm, arm_mm)
    }
}

/// Without.
fn blind(friction: Option<f64>, wavelength_mm: f64, arm_mm: fn(f64) -> f64) -> Stranger {
    Stranger {
        friction,
        ..of(wavelength_mm, arm_mm)
    }
}

/// The recording in rows of 1 ms.
fn slowly(stranger: Stranger) -> Stranger {
    Stranger {
        rows_per_s: RECORDED_HZ[0],
        ..stranger
    }
}

/// What must come out of recordings.
#[derive(Clone, Copy, Default)]
struct Goal {
    rms_percent: Option<f64>,
    wrong_share: Option<f64>,
    valid_share: Option<f64>,
    settling_ms: Option<f64>,
}

impl Goal {
    fn unmet(&self, summary: &Summary) -> bool {
        let above = |value: Option<f64>, most: Option<f64>| {
            most.is_some_and(|most| value.is_none_or(|value| value > most))
        };
        let negative = |value: Option<f64>| value.map(|value| -value);
        above(summary.rms_percent, self.rms_percent)
            || above(summary.wrong_share, self.wrong_share)
            || above(negative(summary.valid_share), negative(self.valid_share))
            || above(summary.settling_ms, self.settling_ms)
    }
}

fn meet(goal: Goal, recordings: &[Recording]) {
    let summaries = of_each(recordings, |(name, stranger)| {
        run(stranger.scene(name)).verdict.summary
    });
    let mut failures = Vec::new();
    for ((name, _), summary) in recordings.iter().zip(summaries) {
        println!(
            "{name}: rms {:.2} %, {:.3} valid, {:.4} wrong, settled after {:?} ms",
            summary.rms_percent.unwrap_or(f64::NAN),
            summary.valid_share.unwrap_or(f64::NAN),
            summary.wrong_share.unwrap_or(f64::NAN),
            summary.settling_ms
        );
        if goal.unmet(&summary) {
            failures.push(format!("{name}: {summary:?}"));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

const RIGHT: Goal = Goal {
    rms_percent: None,
    wrong_share: Some(0.001),
    valid_share: None,
    settling_ms: None,
};

#[test]
fn steady_rubbing_is_right_within_half_a_percent() {
    let goal = Goal {
        rms_percent: Some(0.5),
        // The start takes 2.1 wavelengths of travel: of 3.6 mm at 35 mm/s 0.22 of 8 s.
        valid_share: Some(0.97),
        ..RIGHT
    };
    let recordings = [
        ("steady-1.0mm-70mm-s", of(1.0, at_70)),
        ("steady-1.0mm-70mm-s-slowly", slowly(of(1.0, at_70))),
        ("steady-1.2mm-40mm-s", of(1.2, at_40)),
        ("steady-2.7mm-65mm-s-slowly", slowly(of(2.7, at_65))),
        ("steady-3.6mm-35mm-s", of(3.6, at_35)),
    ];
    meet(goal, &recordings);
}

#[test]
fn steady_rubbing_at_0_db_is_right_within_one_and_a_half_percent() {
    let goal = Goal {
        rms_percent: Some(1.5),
        valid_share: Some(0.9),
        ..RIGHT
    };
    let noisy = |stranger: Stranger| Stranger {
        snr_db: 0.0,
        ..stranger
    };
    let recordings = [
        ("0-db-1.6mm-50mm-s", noisy(of(1.6, at_50))),
        ("0-db-2.9mm-65mm-s", noisy(of(2.9, at_65))),
    ];
    meet(goal, &recordings);
}

#[test]
fn strokes_are_right_within_six_tenths_of_a_percent() {
    let goal = Goal {
        rms_percent: Some(0.6),
        valid_share: Some(0.97),
        ..RIGHT
    };
    let recordings = [
        ("strokes-1.6mm", of(1.6, strokes)),
        ("hand-2.3mm", of(2.3, hand)),
    ];
    meet(goal, &recordings);
}

#[test]
fn quick_strokes_are_right_within_one_percent() {
    let goal = Goal {
        rms_percent: Some(1.0),
        valid_share: Some(0.97),
        ..RIGHT
    };
    let recordings = [
        ("quick-1.4mm", of(1.4, quick_strokes)),
        ("quick-3.4mm", of(3.4, quick_strokes)),
    ];
    meet(goal, &recordings);
}

#[test]
fn boundaries_are_settled_in_time() {
    let onto = |arm_mm| Stranger {
        surface: vec![(1.1, 0.0), (3.7, 77.3)],
        duration_s: 3.0,
        ..of(1.1, arm_mm)
    };
    let within = |settling_ms| Goal {
        settling_ms: Some(settling_ms),
        ..Goal::default()
    };
    meet(within(90.0), &[("boundary-70mm-s", onto(at_70))]);
    meet(within(130.0), &[("boundary-50mm-s", onto(at_50))]);
}

#[test]
fn stick_and_slip_with_the_force_channel_are_right_within_two_percent() {
    let goal = Goal {
        rms_percent: Some(2.0),
        valid_share: Some(0.95),
        ..RIGHT
    };
    let recordings = [
        ("force-mild-1.1mm-65mm-s", sticky(MILD, "", 1.1, at_65)),
        (
            "force-mild-2.3mm-40mm-s-slowly",
            slowly(sticky(MILD, "", 2.3, at_40)),
        ),
        ("force-mild-3.9mm-hand", sticky(MILD, "", 3.9, hand)),
        ("force-strong-1.1mm-40mm-s", sticky(STRONG, "", 1.1, at_40)),
        ("force-strong-2.3mm-65mm-s", sticky(STRONG, "", 2.3, at_65)),
        (
            "force-strong-2.3mm-hand-slowly",
            slowly(sticky(STRONG, "", 2.3, hand)),
        ),
        (
            "found-mild-1.1mm-65mm-s",
            sticky(MILD, FIND_STIFFNESS, 1.1, at_65),
        ),
        (
            "found-mild-2.3mm-hand",
            sticky(MILD, FIND_STIFFNESS, 2.3, hand),
        ),
        (
            "found-strong-1.1mm-40mm-s-slowly",
            slowly(sticky(STRONG, FIND_STIFFNESS, 1.1, at_40)),
        ),
        (
            "found-strong-3.9mm-hand",
            sticky(STRONG, FIND_STIFFNESS, 3.9, hand),
        ),
    ];
    meet(goal, &recordings);
}

#[test]
fn strong_stick_slip_without_the_force_channel_is_wrong_in_three_percent_at_most() {
    let goal = Goal {
        wrong_share: Some(0.03),
        ..Goal::default()
    };
    let recordings = [
        ("blind-strong-1.1mm-65mm-s", blind(STRONG, 1.1, at_65)),
        ("blind-strong-1.1mm-hand", blind(STRONG, 1.1, hand)),
        (
            "blind-strong-2.3mm-40mm-s-slowly",
            slowly(blind(STRONG, 2.3, at_40)),
        ),
        ("blind-strong-3.9mm-40mm-s", blind(STRONG, 3.9, at_40)),
        ("blind-strong-3.9mm-hand", blind(STRONG, 3.9, hand)),
    ];
    meet(goal, &recordings);
}

#[test]
#[ignore = "short textures in strong stick-slip excite the ringing sensor: 2.5 % off"]
fn so_is_strong_stick_slip_over_a_short_texture_by_hand() {
    let goal = Goal {
        rms_percent: Some(2.0),
        ..RIGHT
    };
    let recordings = [
        ("force-strong-1.1mm-hand", sticky(STRONG, "", 1.1, hand)),
        (
            "found-strong-1.1mm-hand",
            sticky(STRONG, FIND_STIFFNESS, 1.1, hand),
        ),
    ];
    meet(goal, &recordings);
}

#[test]
#[ignore = "mild stick-slip by hand slips through: up to 1.1 % of the estimates"]
fn mild_stick_slip_without_the_force_channel_is_never_wrong() {
    let recordings = [
        ("blind-mild-1.1mm-hand", blind(MILD, 1.1, hand)),
        ("blind-mild-2.3mm-40mm-s", blind(MILD, 2.3, at_40)),
        ("blind-mild-2.3mm-hand", blind(MILD, 2.3, hand)),
        ("blind-mild-3.9mm-65mm-s", blind(MILD, 3.9, at_65)),
    ];
    meet(RIGHT, &recordings);
}

#[test]
fn recordings_in_rows_of_a_millisecond_are_right_at_any_noise() {
    let goal = Goal {
        rms_percent: Some(1.5),
        // The start takes 2.1 wavelengths of travel, as with more rows.
        valid_share: Some(0.97),
        ..RIGHT
    };
    let noisy = Stranger {
        snr_db: 0.0,
        ..of(1.6, at_50)
    };
    let recordings = [
        ("steady-3.6mm-35mm-s-slowly", slowly(of(3.6, at_35))),
        ("strokes-1.6mm-slowly", slowly(of(1.6, strokes))),
        ("hand-2.3mm-slowly", slowly(of(2.3, hand))),
        ("0-db-1.6mm-50mm-s-slowly", slowly(noisy)),
    ];
    meet(goal, &recordings);
}
