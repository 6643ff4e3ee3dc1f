//! The display's mode is set over the console, and then the pattern moves across the skin.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use hil_sim_core::run::recording::{ACTUATORS, OutputRecord, volts};
use tests::run::{Run, scene};

const SPEED_MM_S: f64 = 50.0;
/// Of the default grid.
const COLUMNS: usize = 10;
/// In this time, in ns, the pattern is measured: ten cycles of the 12.5 Hz of 4 mm.
const FROM_NS: u64 = 500_000_000;
const TO_NS: u64 = 1_300_000_000;

static RUN: LazyLock<Run> = LazyLock::new(|| {
    Run::of(scene(&format!(
        r#"
        duration_s = 1.4

        [surface]
        specimens = [{{ wavelength_mm = 4.0 }}]

        [motion]
        speed_mm_s = {SPEED_MM_S}

        [estimator]
        method = "counting"

        [display]
        mode = "travelling"
        "#
    )))
});

/// The one λ̂ in force while the pattern is measured, in mm.
fn wavelength_mm() -> f64 {
    // Those before are in force at the beginning.
    let in_force = RUN.recording.estimates.iter().filter(|record| {
        let received_ns = record.received_ns.unwrap_or(u64::MAX);
        record.estimate.valid && (FROM_NS - 100_000_000..TO_NS).contains(&received_ns)
    });
    let mut all_mm: Vec<f32> = in_force.filter_map(|r| r.estimate.wavelength_mm).collect();
    assert!(all_mm.len() > 80);
    all_mm.dedup();
    // 50 mm/s over 4 mm: two crossings a window, always.
    assert_eq!(all_mm, [4.0]);
    all_mm[0].into()
}

fn measured() -> Vec<&'static OutputRecord> {
    let outputs = RUN.recording.outputs.iter();
    outputs
        .filter(|o| (FROM_NS..TO_NS).contains(&o.at_ns))
        .collect()
}

/// Amplitude in V and phase in cycles of an actuator against a sine of `hz`, over whole cycles.
fn tone(actuator: usize, hz: f64) -> (f64, f64) {
    let mut sums = [0.0; 2];
    let outputs = measured();
    for output in &outputs {
        let (sine, cosine) = (TAU * hz * output.at_ns as f64 * 1e-9).sin_cos();
        let v = volts(output.words[actuator]);
        sums[0] += v * sine;
        sums[1] += v * cosine;
    }
    let amplitude_v = 2.0 * sums[0].hypot(sums[1]) / outputs.len() as f64;
    (amplitude_v, sums[1].atan2(sums[0]) / TAU)
}

#[test]
fn each_column_is_ahead_by_its_place_over_the_wavelength() {
    let wavelength_mm = wavelength_mm();
    let hz = SPEED_MM_S / wavelength_mm;
    // Five counts a tick: a common edge in every tick of the measurement.
    let ticks = (TO_NS - FROM_NS) * u64::from(firmware_display::TICK_RATE_HZ) / 1_000_000_000;
    assert_eq!(measured().len() as u64, ticks);
    let actuators = &RUN.scene.display.actuators;
    let (_, first) = tone(0, hz);
    for actuator in 0..ACTUATORS {
        let (amplitude_v, phase) = tone(actuator, hz);
        let ahead_mm = f64::from(actuators[actuator].x_um - actuators[0].x_um) * 1e-3;
        let off = phase - first - ahead_mm / wavelength_mm;
        let off = off - off.round();
        // Words are rounded to 0.15 mV of 5 V; edges come within 20 µs of the same time after a tick.
        assert!(
            off.abs() <= hz * 20e-6,
            "actuator {actuator}: {off} cycles off"
        );
        assert!(
            (amplitude_v - 5.0).abs() < 5e-3,
            "actuator {actuator}: {amplitude_v} V"
        );
    }
}

#[test]
fn neighbouring_columns_differ_by_pitch_over_wavelength_and_rows_not_at_all() {
    let hz = SPEED_MM_S / wavelength_mm();
    let between = tone(1, hz).1 - tone(0, hz).1;
    // 1.5 mm of 4 mm.
    let off = between - 0.375;
    assert!((off - off.round()).abs() <= hz * 20e-6, "{between} cycles");
    for output in &RUN.recording.outputs {
        let mut rows = output.words.chunks(COLUMNS);
        let first = rows.next().unwrap();
        assert!(rows.all(|row| row == first), "{output:?}");
    }
}

#[test]
fn the_mode_came_over_the_console() {
    // What the sensor and the display say to each other has no place for it.
    let console = RUN.recording.display_status.unwrap().console;
    // The host's Hello and its Configure.
    assert!(console.received >= 2, "{console:?}");
    assert_eq!(
        (console.corrupt, console.lost, console.overruns),
        (0, 0, 0),
        "{console:?}"
    );
}
