//! No stimulus without a fresh valid estimate.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use firmware_display::ZERO_VOLT;
use hil_sim_core::run::recording::{OutputRecord, volts};
use protocol::{DisplayConfiguration, RoleCounters};
use tests::run::{Run, scene, scene_in};

/// From here to there, in s, the gauges say nothing.
const DEAD_FROM_S: f64 = 0.8;
const DEAD_TO_S: f64 = 2.0;
/// Amplitude of the gauges' signal, in V and in steps of the ADC.
const SIGNAL_V: f64 = 0.3;
const SIGNAL_LSB: f64 = SIGNAL_V / 3.3 * 4096.0;
/// The counting window A, in s, and the time constant of the band-pass' slowest poles, √2/(2π · 5 Hz).
const WINDOW_S: f64 = 0.08;
const POLE_S: f64 = std::f64::consts::SQRT_2 / (TAU * 5.0);
const TICK_NS: u64 = 1_000_000_000 / firmware_display::TICK_RATE_HZ as u64;

/// 25 Hz, as 2 mm at 50 mm/s give, with a pause in which all gauges rest; estimated by `method`.
fn dead_for_a_while(method: &str) -> Run {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("silence")
        .join(method);
    fs::create_dir_all(&folder).unwrap();
    let mut csv = "t_s,g0,g1,g2,g3,g4\n".to_owned();
    for row in 0..=10_400 {
        let t_s = f64::from(row) / 4_000.0;
        let swing = if (DEAD_FROM_S..DEAD_TO_S).contains(&t_s) {
            0.0
        } else {
            SIGNAL_V * (TAU * 25.0 * t_s).sin()
        };
        let v = 1.65 + swing;
        writeln!(csv, "{t_s},{v},{v},{v},{v},{v}").unwrap();
    }
    fs::write(folder.join("gauges.csv"), csv).unwrap();
    Run::of(scene_in(
        &folder,
        &format!(
            r#"
            duration_s = 2.6

            [surface]
            specimens = [{{ wavelength_mm = 2.0 }}]

            [gauges]
            kind = "recorded"
            file = "gauges.csv"

            [estimator]
            method = "{method}"
            "#
        ),
    ))
}

static DEAD_FOR_A_WHILE: LazyLock<Run> = LazyLock::new(|| dead_for_a_while("counting"));

fn is_silent(output: &OutputRecord) -> bool {
    output.words.iter().all(|&word| word == ZERO_VOLT)
}

fn highest_v(outputs: &[OutputRecord]) -> f64 {
    let words = outputs.iter().flat_map(|output| output.words);
    words.map(|word| volts(word).abs()).fold(0.0, f64::max)
}

/// The outputs from one instant to another, in ns.
fn outputs(from_ns: u64, to_ns: u64) -> &'static [OutputRecord] {
    let all = &DEAD_FOR_A_WHILE.recording.outputs;
    let at = |ns: u64| all.partition_point(|output| output.at_ns < ns);
    &all[at(from_ns)..at(to_ns)]
}

/// When the valid estimates of a run arrived, in ns.
fn valid_ns(run: &Run) -> Vec<u64> {
    let estimates = &run.recording.estimates;
    let valid = estimates.iter().filter(|record| record.estimate.valid);
    valid.filter_map(|record| record.received_ns).collect()
}

/// The arrivals of the last valid estimate before the pause, and of the first one after it, in ns.
fn pause_ns(run: &Run) -> (u64, u64) {
    let valid_ns = valid_ns(run);
    let dead_to_ns = (DEAD_TO_S * 1e9) as u64;
    let after = valid_ns.partition_point(|&at_ns| at_ns < dead_to_ns);
    (valid_ns[after - 1], valid_ns[after])
}

#[test]
fn a_dead_link_leaves_all_outputs_at_zero_volt() {
    let run = Run::of(scene(
        r#"
        duration_s = 1.0

        [surface]
        specimens = [{ wavelength_mm = 2.0 }]

        [link]
        loss = 1.0
        "#,
    ));
    assert!(run.recording.ticks.len() > 1_900);
    assert!(run.recording.outputs.iter().all(is_silent));
    assert_eq!((run.facts.resets, run.facts.clears), (0, 0));
}

#[test]
fn outputs_are_at_zero_volt_until_the_first_valid_estimate_and_then_fade_in() {
    let first_ns = valid_ns(&DEAD_FOR_A_WHILE)[0];
    assert!(outputs(0, first_ns).iter().all(is_silent));
    let DisplayConfiguration { fade_in_ms, .. } = DisplayConfiguration::DEFAULT;
    // In the n-th tick the gain is n parts of the fade's ticks, and the next valid estimate changes
    // nothing; the first tick may be a tick away.
    let half_ns = u64::from(fade_in_ms) * 1_000_000 / 2;
    let fading = outputs(first_ns, first_ns + half_ns);
    assert!(highest_v(fading) <= 5.0 * 0.5 + 5.0 * TICK_NS as f64 / (2 * half_ns) as f64);
    // A crest in each half cycle of 20 ms, of 5 V less the fall within half a tick of 0.0125 cycles.
    let full = outputs(
        first_ns + 2 * half_ns + TICK_NS,
        first_ns + 2 * half_ns + 25_000_000,
    );
    assert!(
        highest_v(full) >= 5.0 * (TAU * 0.0125 / 2.0).cos(),
        "{}",
        highest_v(full)
    );
}

#[test]
fn a_silent_gauge_gives_no_valid_estimate_once_the_filters_have_rung_out() {
    let (last_ns, next_ns) = pause_ns(&DEAD_FOR_A_WHILE);
    let last_s = last_ns as f64 * 1e-9;
    // Below one step of the ADC after ln(amplitude) time constants, over the whole of a window; 10 ms
    // to the next estimate, 1 ms on the wire.
    let rung_out_s = DEAD_FROM_S + POLE_S * SIGNAL_LSB.ln() + WINDOW_S + 0.011;
    assert!(
        (DEAD_FROM_S..rung_out_s).contains(&last_s),
        "{last_s} s of {rung_out_s} s"
    );
    // And one as soon as a crossing is in the window.
    let next_s = next_ns as f64 * 1e-9;
    assert!(next_s < DEAD_TO_S + WINDOW_S, "{next_s} s");
}

#[test]
fn no_other_method_stands_by_a_silent_gauge_longer() {
    for method in ["default", "crossings", "counting-adapted"] {
        let (last_ns, next_ns) = pause_ns(&dead_for_a_while(method));
        let (last_s, next_s) = (last_ns as f64 * 1e-9, next_ns as f64 * 1e-9);
        // The counting method's bound with its longest window, 0.2 s.
        let rung_out_s = DEAD_FROM_S + POLE_S * SIGNAL_LSB.ln() + 0.2 + 0.011;
        assert!(
            (DEAD_FROM_S - 0.1..rung_out_s).contains(&last_s),
            "{method}: {last_s} s of {rung_out_s} s"
        );
        // It has to be sure again within half a second.
        assert!(next_s < DEAD_TO_S + 0.5, "{method}: {next_s} s");
    }
}

#[test]
fn an_estimate_too_old_fades_the_stimulus_to_zero_volt_in_time() {
    let DisplayConfiguration {
        max_age_ms,
        fade_out_ms,
        ..
    } = DisplayConfiguration::DEFAULT;
    let (last_ns, next_ns) = pause_ns(&DEAD_FOR_A_WHILE);
    let old_ns = last_ns + u64::from(max_age_ms) * 1_000_000;
    // The last λ̂ is that of a single crossing at most, 8 mm: a crest every 80 ms of 50 mm/s.
    let held = outputs(old_ns - 90_000_000, old_ns);
    assert!(highest_v(held) >= 4.99, "{}", highest_v(held));
    // Two ticks until the estimate is taken, one in which it shows.
    let silent_ns = old_ns + u64::from(fade_out_ms) * 1_000_000 + 3 * TICK_NS;
    assert!(silent_ns < next_ns);
    let fading = outputs(old_ns, silent_ns);
    assert!(is_silent(fading.last().unwrap()), "{:?}", fading.last());
    assert!(fading.iter().filter(|output| !is_silent(output)).count() > 50);
    assert!(outputs(silent_ns, next_ns).is_empty());
    // Faded, without a jolt.
    let actuators = &DEAD_FOR_A_WHILE.verdict.actuators;
    assert!(actuators.max_step_v.unwrap() <= actuators.natural_step_v.unwrap());
}

#[test]
fn the_stimulus_comes_back_with_the_signal() {
    let (_, next_ns) = pause_ns(&DEAD_FOR_A_WHILE);
    let back = outputs(next_ns, u64::MAX);
    assert!(highest_v(back) >= 4.99, "{}", highest_v(back));
    let status = DEAD_FOR_A_WHILE.recording.display_status.unwrap();
    let RoleCounters::Display(counters) = status.role else {
        panic!("{status:?}");
    };
    assert_eq!(counters.fades, 1);
}
