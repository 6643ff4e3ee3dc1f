//! Recordings that nobody tuned the estimators on.

use std::f64::consts::TAU;

use crate::running::{of_each, run};
use crate::stranger::Stranger;

/// Strokes as a hand makes them: there and back in 1.6 s with the least jerk, 45 mm long, and a tremor.
fn hand_mm(t_s: f64) -> f64 {
    let stroke = (t_s / 0.8).floor();
    let share = t_s / 0.8 - stroke;
    let eased = share.powi(3) * (10.0 + share * (6.0 * share - 15.0));
    let there = stroke as i64 % 2 == 0;
    let place_mm = 45.0 * if there { eased } else { 1.0 - eased };
    place_mm + 0.05 * (TAU * 9.0 * t_s).sin()
}

#[test]
fn x() {
    let mut all: Vec<(String, Stranger)> = Vec::new();
    for warts in [false, true] {
        for rows_per_s in [1_000, 4_000] {
            let tag = format!("{}-{rows_per_s}", if warts { "warts" } else { "plain" });
            let mut add = |name: &str, stranger: Stranger| {
                all.push((format!("{name}-{tag}"), Stranger { warts, rows_per_s, seed: all.len() as u64 + 1, ..stranger }));
            };
            add("steady-1.2mm-45", Stranger { surface: vec![(1.2, 0.0)], arm_mm: |t| 45.0 * t, ..Stranger::default() });
            add("steady-2.7mm-60", Stranger { surface: vec![(2.7, 0.0)], arm_mm: |t| 60.0 * t, ..Stranger::default() });
            add("steady-3.6mm-35", Stranger { surface: vec![(3.6, 0.0)], arm_mm: |t| 35.0 * t, ..Stranger::default() });
            add("steady-1.0mm-70", Stranger { surface: vec![(1.0, 0.0)], arm_mm: |t| 70.0 * t, ..Stranger::default() });
            add("steady-0db-1.6mm-55", Stranger { surface: vec![(1.6, 0.0)], arm_mm: |t| 55.0 * t, snr_db: 0.0, ..Stranger::default() });
            add("sine-1.6mm", Stranger { surface: vec![(1.6, 0.0)], arm_mm: |t| 60.0 / (TAU * 0.7) * (1.0 - (TAU * 0.7 * t).cos()), ..Stranger::default() });
            add("sine-2hz-1.4mm", Stranger { surface: vec![(1.4, 0.0)], arm_mm: |t| 65.0 / (TAU * 2.0) * (1.0 - (TAU * 2.0 * t).cos()), ..Stranger::default() });
            add("sine-2hz-3.4mm", Stranger { surface: vec![(3.4, 0.0)], arm_mm: |t| 65.0 / (TAU * 2.0) * (1.0 - (TAU * 2.0 * t).cos()), ..Stranger::default() });
            add("hand-2.3mm", Stranger { surface: vec![(2.3, 0.0)], arm_mm: hand_mm, ..Stranger::default() });
            add("hand-1.1mm", Stranger { surface: vec![(1.1, 0.0)], arm_mm: hand_mm, ..Stranger::default() });
            add("boundary-70", Stranger { surface: vec![(1.1, 0.0), (3.7, 77.3)], arm_mm: |t| 70.0 * t, duration_s: 3.0, ..Stranger::default() });
            add("boundary-50", Stranger { surface: vec![(1.1, 0.0), (3.7, 77.3)], arm_mm: |t| 50.0 * t, duration_s: 4.0, ..Stranger::default() });
            for (f, friction) in [("mild", 0.68), ("strong", 0.95)] {
                for l in [1.1, 2.3, 3.9] {
                    for (m, arm_mm) in [("40", (|t| 40.0 * t) as fn(f64) -> f64), ("65", |t| 65.0 * t), ("hand", hand_mm)] {
                        let base = || Stranger { surface: vec![(l, 0.0)], arm_mm, friction: Some(friction), ..Stranger::default() };
                        add(&format!("{f}-force-{l}mm-{m}"), Stranger { force: true, ..base() });
                        add(&format!("{f}-found-{l}mm-{m}"), Stranger { force: true, rest_of_scene: "[estimator]\nstiffness = \"estimated\"\n", ..base() });
                        add(&format!("{f}-blind-{l}mm-{m}"), Stranger { ..base() });
                    }
                }
            }
        }
    }
    let lines = of_each(&all, |(name, stranger)| {
        let run = run(stranger.scene(name));
        let s = run.verdict.summary;
        let mut c = [0; 4];
        for e in &run.verdict.estimates { c[e.contact as usize] += 1; }
        format!("{name}: rms {:.3} bias {:.3} valid {:.3} wrong {:.4} settling {:?} contact {c:?}", s.rms_percent.unwrap_or(f64::NAN), s.bias_percent.unwrap_or(f64::NAN), s.valid_share.unwrap_or(f64::NAN), s.wrong_share.unwrap_or(f64::NAN), s.settling_ms)
    });
    for l in lines { println!("{l}"); }
}
