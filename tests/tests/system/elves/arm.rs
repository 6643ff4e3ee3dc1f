//! The arm follows the operator's hand over the link, driven by the sensor board's PWM.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use protocol::RoleCounters;
use tests::run::{Run, scene};

const SPEED_MM_S: f64 = 70.0;
const STROKES_HZ: f64 = 0.83;
const LAG_S: f64 = 0.020;
const DELAY_S: f64 = 0.020;
/// What the controller adds of velocity for each mm of distance to the hand, in 1/s.
const POSITION_GAIN_PER_S: f64 = 10.0;
/// Age of the velocity in a motion: half of the 16 ms over which it is taken.
const VELOCITY_AGE_S: f64 = 0.008;
/// From a reading of the hand to the PWM it leads to: 2 ms to the next motion, its frame of up to
/// 0.5 ms, 0.5 ms of cable, and 1 ms to the next sample.
const REACTION_S: f64 = 0.004;

static FOLLOWING: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(&format!(
        r#"
        duration_s = 3.0

        [surface]
        specimens = [{{ wavelength_mm = 2.0 }}]

        [motion]
        kind = "sinusoid"
        amplitude_mm_s = {SPEED_MM_S}
        frequency_hz = {STROKES_HZ}

        [arm]
        follows = "link"
        lag_ms = {}

        [link]
        delay_ms = {}
        "#,
        LAG_S * 1e3,
        DELAY_S * 1e3,
    )))
});

/// How far the arm may be from where the hand was when what it knows was read, in mm. With the lag L
/// and the age T of what it knows, x_a' = L (v e^(−jωT) + k e), so that |e| is at most
/// |v| |1 − L e^(−jωT)| / |jω + k L|, in which the numerator is at most ω (τ + T) and the denominator
/// at least k (1 − ωτ).
fn behind_mm() -> f64 {
    let omega = TAU * STROKES_HZ;
    let late_s = LAG_S + VELOCITY_AGE_S + REACTION_S;
    SPEED_MM_S * omega * late_s / (POSITION_GAIN_PER_S * (1.0 - omega * LAG_S))
}

#[test]
fn the_arm_stays_within_delay_and_lag_of_the_hand() {
    let run = &*FOLLOWING;
    let omega = TAU * STROKES_HZ;
    // What the hand has moved when its first motion reaches the arm is never made up for: both count
    // from there. It comes within a tenth of a second.
    let before_mm = SPEED_MM_S / omega * (1.0 - (omega * 0.1).cos());
    let bound_mm = SPEED_MM_S * (DELAY_S + REACTION_S) + behind_mm() + before_mm;
    assert!(bound_mm < 6.0, "{bound_mm} mm says nothing");
    let mut farthest_mm: f64 = 0.0;
    for scan in &run.recording.scans {
        let hand_mm = run.scene.motion.position_mm(scan.at_ns as f64 * 1e-9);
        farthest_mm = farthest_mm.max((scan.position_mm - hand_mm).abs());
    }
    assert!(
        farthest_mm <= bound_mm,
        "{farthest_mm} mm, bound {bound_mm} mm"
    );
    // It is an arm of its own, which comes late.
    assert!(
        farthest_mm >= 0.5 * SPEED_MM_S * DELAY_S,
        "{farthest_mm} mm"
    );
}

#[test]
fn the_arm_makes_the_hands_whole_stroke_by_its_pwm_alone() {
    // Nothing but the duty and direction on the sensor board's pins moves a driven arm.
    let run = &*FOLLOWING;
    let (low_mm, high_mm) = run
        .recording
        .scans
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), scan| {
            (low.min(scan.position_mm), high.max(scan.position_mm))
        });
    let stroke_mm = 2.0 * SPEED_MM_S / (TAU * STROKES_HZ);
    let off_mm = high_mm - low_mm - stroke_mm;
    assert!(
        off_mm.abs() <= 2.0 * behind_mm(),
        "{off_mm} mm of {stroke_mm} mm"
    );
}

#[test]
fn motions_reach_the_arms_drive_at_500_hz() {
    let status = FOLLOWING.recording.sensor_status.unwrap();
    let RoleCounters::Sensor(counters) = status.role else {
        panic!("{status:?}");
    };
    // From the handshake on, which takes two ways of the link and less than 0.1 s.
    let due = 500.0 * (status.uptime_us as f64 * 1e-6 - 0.2);
    assert!(
        f64::from(counters.motions) >= due,
        "{counters:?}, due {due}"
    );
}

#[test]
fn the_surface_is_felt_under_the_arm_that_follows() {
    let summary = &FOLLOWING.verdict.summary;
    assert!(summary.rms_percent.unwrap() <= 1.0, "{summary:?}");
    assert!(summary.wrong_share.unwrap() <= 0.001, "{summary:?}");
}

/// From the last command to the end of the PWM that nobody renews: 256 periods of 50 µs.
const RENEWED_WITHIN_S: f64 = 0.0128;

#[test]
fn an_arm_that_is_told_nothing_more_stands_still_long_before_the_watchdog() {
    const STRUCK_S: f64 = 1.2;
    const SHORT_LAG_S: f64 = 0.010;
    for kind in ["adc-stopped", "sensor-hang", "sensor-panic"] {
        let run = Run::of(scene(&format!(
            r#"
            duration_s = 2.4

            [surface]
            specimens = [{{ wavelength_mm = 2.0 }}]

            [motion]
            speed_mm_s = {SPEED_MM_S}

            [arm]
            follows = "link"
            lag_ms = {}

            [[fault]]
            at_s = {STRUCK_S}
            kind = "{kind}"
            "#,
            SHORT_LAG_S * 1e3
        )));
        let scans = &run.recording.scans;
        let at = |at_s: f64| {
            let scan = scans.iter().find(|scan| scan.at_ns as f64 * 1e-9 >= at_s);
            scan.unwrap_or_else(|| panic!("{kind}: no scan from {at_s} s on"))
        };
        let (before, struck) = (at(STRUCK_S - 0.05), at(STRUCK_S - 0.001));
        let way_mm = struck.position_mm - before.position_mm;
        assert!(way_mm > 0.8 * SPEED_MM_S * 0.049, "{kind}: it moves before");
        let [reset] = run.recording.signs.resets[..] else {
            panic!("{kind}: one reset, not {:?}", run.recording.signs.resets);
        };
        let reset_s = reset.at_ns as f64 * 1e-9;
        assert!(
            reset_s > STRUCK_S + 0.2,
            "{kind}: the watchdog takes its time"
        );
        // What the sample that was under way and the arm's own lag add; where it is shows when it is sampled again.
        let most_mm = 1.2 * SPEED_MM_S * (0.001 + 0.001 + RENEWED_WITHIN_S + SHORT_LAG_S);
        let gone_mm = at(reset_s).position_mm - struck.position_mm;
        assert!(
            (0.0..=most_mm).contains(&gone_mm),
            "{kind}: {gone_mm} mm, bound {most_mm} mm"
        );
        // And follows again.
        let end_mm = scans.last().map_or(0.0, |scan| scan.position_mm);
        assert!(
            end_mm > at(reset_s).position_mm + 10.0,
            "{kind}: {end_mm} mm"
        );
    }
}
