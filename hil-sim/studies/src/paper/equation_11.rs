//! Equation (11): the expected error over the window A, and the best A.

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::palette::{FIRST, INK, QUIET, REFUSED, SECOND};
use crate::paper::PaperError;
use crate::paper::exhibit::{Exhibit, Part};
use crate::paper::theory::{HAND_HZ, WINDOW_S, best_window_s, error_mm as error_at_mm};
use crate::psychophysics::published::SAMPLES_MM;
use crate::study::csv_text_under;

/// What is shown, in s, in so many points.
const SHOWN_S: std::ops::Range<f64> = 0.01..0.2;
const POINTS: u32 = 190;

pub(super) fn exhibit() -> Result<Exhibit, PaperError> {
    let windows_s = || {
        let step_s = (SHOWN_S.end - SHOWN_S.start) / f64::from(POINTS);
        (0..=POINTS).map(move |point| SHOWN_S.start + f64::from(point) * step_s)
    };
    let error_mm = |window_s, wavelength_mm| error_at_mm(window_s, wavelength_mm, HAND_HZ);
    let best_s = SAMPLES_MM.map(|mm| best_window_s(mm, HAND_HZ));
    let [of_1_mm, .., of_4_mm] = SAMPLES_MM.map(|mm| best_window_s(mm, 2.0 * HAND_HZ));
    let mean_s = best_s.iter().sum::<f64>() / best_s.len() as f64;
    let colours = [FIRST, SECOND, REFUSED, QUIET];
    let mut marks = vec![Mark::strokes(INK, &[WINDOW_S], 0.0..0.6)];
    for (wavelength_mm, colour) in SAMPLES_MM.into_iter().zip(colours) {
        let line = windows_s()
            .map(|window_s| (window_s, error_mm(window_s, wavelength_mm).min(0.6)))
            .collect();
        marks.push(Mark::line(colour, line));
    }
    for ((wavelength_mm, colour), best_s) in SAMPLES_MM.into_iter().zip(colours).zip(best_s) {
        let least_mm = error_mm(best_s, wavelength_mm);
        marks.push(Mark::discs(colour, vec![(best_s, least_mm)]));
    }
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
        marks,
    );
    let rows = windows_s().map(|window_s| (window_s, SAMPLES_MM.map(|mm| error_mm(window_s, mm))));
    let header = [
        "window_s",
        "error_1mm",
        "error_2mm",
        "error_3mm",
        "error_4mm",
    ];
    let table = Part::Table {
        caption: "The best A".into(),
        heads: vec!["λ, mm".into(), "A, s".into(), "error there, mm".into()],
        rows: SAMPLES_MM
            .into_iter()
            .zip(best_s)
            .map(|(mm, best_s)| {
                let least_mm = error_mm(best_s, mm);
                vec![
                    mm.to_string(),
                    format!("{best_s:.4}"),
                    format!("{least_mm:.3}"),
                ]
            })
            .collect(),
    };
    Ok(Exhibit {
        id: "equation-11",
        title: "Equation (11): the expected error over the window A".into(),
        paper: "The paper draws no such curve; it says that A was determined to be 0.080 s.".into(),
        seen: format!(
            "Each wavelength has a best window of its own, shorter for longer ones, and their mean is {mean_s:.4} s: \
             the paper's 0.080 s. Nothing here comes from a run; a hand of 2 Hz instead of 1 would want windows \
             from {of_1_mm:.3} s (1 mm) to {of_4_mm:.3} s (4 mm)."
        ),
        conclusions: Vec::new(),
        csvs: vec![("equation-11.csv".into(), csv_text_under(&header, rows)?)],
        parts: vec![chart, table],
        shared: &[],
    })
}
