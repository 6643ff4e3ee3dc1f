//! Fig. 6: accuracy over the vibratory frequency.

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::palette::{FIRST, INK, QUIET, REFUSED, SECOND};
use crate::paper::PaperError;
use crate::paper::exhibit::{Conclusion, Exhibit, Part};
use crate::paper::plan::Runs;
use crate::paper::published::PAPER_MM;
use crate::paper::table_1::{measured, predicted_mm};
use crate::study::csv_text_under;

const EXHIBIT: &str = "Fig. 6";

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let papers = PAPER_MM.as_flattened();
    let (mut paper, mut predicted, mut counted, mut default) = (vec![], vec![], vec![], vec![]);
    let mut rows = Vec::new();
    for (at, cell) in runs.cells.iter().enumerate() {
        let measured = measured(cell, EXHIBIT)?;
        let point = |mm: f64| (cell.frequency_hz(), mm / cell.wavelength_mm);
        let of_paper = papers.get(at).copied().map(point);
        paper.extend(of_paper);
        predicted.push(point(predicted_mm(cell)));
        counted.push(point(measured.counted_mm));
        default.push(point(measured.default_mm));
        let accuracy = |points: &[(f64, f64)]| points.last().map(|point| point.1);
        rows.push((
            (cell.speed_mm_s, cell.wavelength_mm, cell.frequency_hz()),
            of_paper.map(|point| point.1),
            (accuracy(&predicted), accuracy(&counted), accuracy(&default)),
        ));
    }
    let spread = |points: &[(f64, f64)], from_hz: f64, to_hz: f64| {
        let within = points.iter().filter(|p| (from_hz..to_hz).contains(&p.0));
        within
            .map(|p| 100.0 * (p.1 - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let x = Axis::round("vibratory frequency v/λ in Hz", 0.0..75.0);
    let y = Axis::round("accuracy λe/λ", 0.85..1.2);
    let chart = Part::chart(
        "ratio of the estimated to the true wavelength",
        &[
            (REFUSED, "our count"),
            (QUIET, "what whole counts alone must give"),
            (FIRST, "the default estimator"),
            (SECOND, "the paper's Table I"),
        ],
        (310.0, &x, &y),
        [
            Mark::line(INK, vec![(0.0, 1.0), (75.0, 1.0)]),
            Mark::discs(QUIET, predicted),
            Mark::discs(SECOND, paper.clone()),
            Mark::discs(REFUSED, counted.clone()),
            Mark::discs(FIRST, default.clone()),
        ],
    );
    let header = [
        "speed_mm_s",
        "wavelength_mm",
        "frequency_hz",
        "paper",
        "predicted",
        "counted",
        "default",
    ];
    Ok(Exhibit {
        id: "fig-6",
        title: "Fig. 6: accuracy over the vibratory frequency".into(),
        paper: "Table I's twelve points and seven more, which stand only in the paper's picture: our seven (1 mm at 40, \
                45, 55, 60 and 65 mm/s, 2 mm at 40 and 56 mm/s) fill the gaps."
            .into(),
        seen: format!(
            "Below 15 Hz our count is off by up to {:.0} %, where a window holds two crossings or fewer, and above \
             that by up to {:.0} %. The paper's count is also {:.0} % off at 70 Hz, by stick-slip as it says, which \
             these runs do not have; the default estimator stays within {:.2} % everywhere.",
            spread(&counted, 0.0, 15.0),
            spread(&counted, 15.0, 75.0),
            spread(&paper, 65.0, 75.0),
            spread(&default, 0.0, 75.0),
        ),
        conclusions: vec![
            Conclusion {
                claim: "the count is further off below 15 Hz than above",
                holds: spread(&counted, 0.0, 15.0) > spread(&counted, 15.0, 75.0),
            },
            Conclusion {
                claim: "the default estimator is nearer to the truth than the count is at its best",
                holds: spread(&default, 0.0, 75.0) < spread(&counted, 15.0, 75.0),
            },
        ],
        csvs: vec![("fig-6.csv".into(), csv_text_under(&header, rows)?)],
        parts: vec![chart],
        shared: &[],
    })
}
