//! The paper's Table I (Okamoto et al. 2009): four specimens at three speeds, by its own method, all on
//! the ELFs.

use std::sync::LazyLock;

use firmware_sensor::counting::predicted_mean_mm;
use hil_sim_core::scene::{Estimator, Scene};
use protocol::Method;
use tests::run::{Run, runs_of};

/// The counting window A, in s.
const WINDOW_S: f64 = 0.080;
/// The settled estimates' mean comes within this of the predicted one, in mm.
const MEAN_BOUND_MM: f64 = 0.03;
/// A cell of the table.
struct Cell {
    speed_mm_s: f64,
    wavelength_mm: f64,
    /// What counting arrives at on a clean signal, to three digits.
    predicted_mm: f64,
}

const fn cell(speed_mm_s: f64, wavelength_mm: f64, predicted_mm: f64) -> Cell {
    Cell {
        speed_mm_s,
        wavelength_mm,
        predicted_mm,
    }
}

const CELLS: [Cell; 12] = [
    cell(30.0, 1.0, 1.008),
    cell(30.0, 2.0, 2.080),
    cell(30.0, 3.0, 3.360),
    cell(30.0, 4.0, 4.320),
    cell(50.0, 1.0, 1.000),
    cell(50.0, 2.0, 2.000),
    cell(50.0, 3.0, 3.111),
    cell(50.0, 4.0, 4.000),
    cell(70.0, 1.0, 1.001),
    cell(70.0, 2.0, 2.016),
    cell(70.0, 3.0, 3.049),
    cell(70.0, 4.0, 4.107),
];

/// The run of each cell.
static RUNS: LazyLock<Vec<Run>> = LazyLock::new(|| {
    runs_of(&CELLS, |cell| Scene {
        // 0.3 s until band-pass and window are settled, and the 2 s of the paper's mean.
        duration_s: 2.3,
        estimator: Estimator {
            method: Method::Counting,
            ..Estimator::default()
        },
        ..Scene::constant(cell.wavelength_mm, cell.speed_mm_s)
    })
});

fn in_every_cell(judge: impl Fn(&Cell, &Run) -> Result<(), String>) {
    assert_eq!(RUNS.len(), CELLS.len());
    let failures: Vec<String> = CELLS
        .iter()
        .zip(&*RUNS)
        .filter_map(|(cell, run)| {
            let what = judge(cell, run).err()?;
            Some(format!(
                "{} mm at {} mm/s: {what}",
                cell.wavelength_mm, cell.speed_mm_s
            ))
        })
        .collect();
    assert!(failures.is_empty(), "{failures:#?}");
}

fn hold(holds: bool, what: String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what) }
}

#[test]
fn the_predicted_column_follows_from_the_counts_whole_numbers() {
    for cell in &CELLS {
        let predicted_mm = predicted_mean_mm(cell.wavelength_mm, cell.speed_mm_s, WINDOW_S);
        // The column has three digits.
        assert!(
            (predicted_mm - cell.predicted_mm).abs() <= 0.0005 + 1e-9,
            "{} mm at {} mm/s: {predicted_mm} mm, the column says {}",
            cell.wavelength_mm,
            cell.speed_mm_s,
            cell.predicted_mm
        );
    }
}

#[test]
fn the_mean_wavelength_of_every_cell_is_the_predicted_one_within_0_03_mm() {
    in_every_cell(|cell, run| {
        let mean_mm = run.verdict.summary.mean_mm.unwrap_or(f64::NAN);
        let off_mm = (mean_mm - cell.predicted_mm).abs();
        hold(
            off_mm <= MEAN_BOUND_MM,
            format!("mean {mean_mm} mm, predicted {}", cell.predicted_mm),
        )
    });
}

#[test]
fn the_actuators_vibrate_at_speed_over_estimated_wavelength_within_a_thousandth() {
    in_every_cell(|_, run| {
        let actuators = &run.verdict.actuators;
        let measured_hz = actuators.frequency_hz.unwrap_or(f64::NAN);
        let due_hz = actuators.truth_hz.unwrap_or(f64::NAN);
        hold(
            (measured_hz / due_hz - 1.0).abs() <= 1e-3,
            format!("{measured_hz} Hz, v/λ̂ is {due_hz} Hz"),
        )
    });
}

#[test]
fn every_channels_mean_over_time_is_below_five_millivolts() {
    in_every_cell(|cell, run| {
        let mean_v = run.verdict.actuators.mean_v.unwrap_or(f64::NAN);
        // Here alone the count's λ̂ swings, 2.4 mm and 4.8 mm by turns: a wave that is due half as long as the other
        // half has a mean of its own.
        let swings = (cell.wavelength_mm, cell.speed_mm_s) == (4.0, 30.0);
        let bound_v = if swings { 15e-3 } else { 5e-3 };
        hold(mean_v.abs() <= bound_v, format!("{mean_v} V"))
    });
}

#[test]
fn all_channels_change_on_one_ldac_edge() {
    in_every_cell(|_, run| {
        let late = run
            .recording
            .outputs
            .iter()
            .find(|output| output.skew_ns != 0);
        hold(
            late.is_none() && !run.recording.outputs.is_empty(),
            format!("{late:?}"),
        )
    });
}

#[test]
fn no_step_is_larger_than_a_ticks_travel_explains() {
    in_every_cell(|_, run| {
        let step_v = run.verdict.actuators.max_step_v.unwrap_or(f64::NAN);
        let natural_v = run.verdict.actuators.natural_step_v.unwrap_or(f64::NAN);
        hold(
            step_v <= natural_v,
            format!("{step_v} V, explained {natural_v} V"),
        )
    });
}

#[test]
fn a_hand_movement_is_at_the_outputs_within_a_millisecond() {
    in_every_cell(|_, run| {
        let p99_ms = run
            .verdict
            .actuators
            .hand_to_output_p99_ms
            .unwrap_or(f64::NAN);
        hold(p99_ms <= 1.0, format!("p99 {p99_ms} ms"))
    });
}
