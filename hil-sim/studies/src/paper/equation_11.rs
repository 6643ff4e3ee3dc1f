//! Equation (11): the expected error over the window A, and the best A.

use std::ops::Range;

use crate::output::plot::palette::{FIRST, INK, QUIET, REFUSED, SECOND};
use crate::output::plot::{Axis, Mark};
use crate::paper::exhibit::{Exhibit, Part};
use crate::paper::theory::{HAND_HZ, WINDOW_S, best_window_s, error_mm as error_at_mm};
use crate::psychophysics::SAMPLES_MM;
use crate::study::{Record, Table, csv, short};

/// What is shown, in so many points.
const SHOWN_S: Range<f64> = 0.01..0.2;
const POINTS: u32 = 190;

pub(super) fn exhibit() -> Exhibit {
    let windows_s = || {
        let step_s = (SHOWN_S.end - SHOWN_S.start) / f64::from(POINTS);
        (0..=POINTS).map(move |point| SHOWN_S.start + f64::from(point) * step_s)
    };
    let error_mm = |window_s, wavelength_mm| error_at_mm(window_s, wavelength_mm, HAND_HZ);
    // Each specimen's λ, best A, and error there.
    let best = SAMPLES_MM.map(|mm| {
        let best_s = best_window_s(mm, HAND_HZ);
        (mm, best_s, error_mm(best_s, mm))
    });
    let [of_1_mm, .., of_4_mm] = SAMPLES_MM.map(|mm| best_window_s(mm, 2.0 * HAND_HZ));
    let mean_s = best.iter().map(|best| best.1).sum::<f64>() / best.len() as f64;
    let colours = [FIRST, SECOND, REFUSED, QUIET];
    let lines = SAMPLES_MM.into_iter().zip(colours).map(|(mm, colour)| {
        let points = windows_s().map(|window_s| (window_s, error_mm(window_s, mm).min(0.6)));
        Mark::line(colour, points.collect())
    });
    let least = best.into_iter().zip(colours);
    let least = least.map(|((_, best_s, mm), colour)| Mark::discs(colour, vec![(best_s, mm)]));
    let taken = Mark::strokes(INK, &[WINDOW_S], 0.0..0.6);
    let chart = Part::chart(
        "fᵥ = 1 Hz, σ = 1 mm, fs = 1 kHz",
        &[
            (FIRST, "λ = 1 mm"),
            (SECOND, "2 mm"),
            (REFUSED, "3 mm"),
            (QUIET, "4 mm, each with its least error"),
            (INK, "A = 0.080 s"),
        ],
        (
            280.0,
            &Axis::round("window A in s", SHOWN_S),
            &Axis::round("expected error in mm", 0.0..0.6),
        ),
        [taken].into_iter().chain(lines).chain(least),
    );
    const COLUMNS: [&str; 4] = ["error_1mm", "error_2mm", "error_3mm", "error_4mm"];
    let rows = windows_s().map(|window_s| {
        let row = Record::default().with("window_s", window_s);
        let errors = COLUMNS.into_iter().zip(SAMPLES_MM);
        errors.fold(row, |row, (name, mm)| {
            row.with(name, error_mm(window_s, mm))
        })
    });
    let table = best.into_iter().map(|(mm, best_s, least_mm)| {
        Record::default()
            .with("λ, mm", short(mm))
            .with("A, s", format!("{best_s:.4}"))
            .with("error there, mm", format!("{least_mm:.3}"))
    });
    Exhibit {
        id: "equation-11",
        title: "Equation (11): the expected error over the window A",
        paper: "The paper draws no such curve; it says that A was determined to be 0.080 s.".into(),
        seen: format!(
            "Each wavelength has a best window of its own, shorter for longer ones, and their mean is {mean_s:.4} s: \
             the paper's 0.080 s. Nothing here comes from a run; a hand of 2 Hz instead of 1 would want windows \
             from {of_1_mm:.3} s (1 mm) to {of_4_mm:.3} s (4 mm)."
        ),
        csvs: vec![("equation-11.csv", csv(rows))],
        parts: vec![
            chart,
            Part::Table(Table::from_iter(table).called("The best A")),
        ],
        ..Exhibit::default()
    }
}
