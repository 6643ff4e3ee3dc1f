//! Fig. 4: a gauge behind the band-pass, and the impulses of its crossings.

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::palette::{FIRST, REFUSED};
use crate::output::report::crossings::banded;
use crate::paper::PaperError;
use crate::paper::exhibit::{Exhibit, Part};
use crate::paper::plan::Runs;
use crate::study::csv_text_under;

const EXHIBIT: &str = "Fig. 4";
/// The cell of Table I that is shown, λ in mm and v in mm/s, and the time, in s.
const CELL: (f64, f64) = (2.0, 50.0);
const SHOWN_S: std::ops::Range<f64> = 1.0..1.4;
/// The gauge that is counted.
const GAUGE: usize = 2;

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let empty = |missing| PaperError::Empty {
        exhibit: EXHIBIT,
        missing,
    };
    let (wavelength_mm, speed_mm_s) = CELL;
    let cell = runs
        .cells
        .iter()
        .find(|cell| (cell.wavelength_mm, cell.speed_mm_s) == CELL)
        .ok_or(empty("run"))?;
    let banded = banded(&cell.recording.scans, GAUGE, SHOWN_S.end);
    let samples: Vec<(f64, f64)> = banded
        .samples
        .into_iter()
        .filter(|sample| SHOWN_S.contains(&sample.0))
        .collect();
    let impulses: Vec<f64> = banded
        .impulses
        .into_iter()
        .filter(|t_s| SHOWN_S.contains(t_s))
        .collect();
    if samples.is_empty() {
        return Err(empty("samples"));
    }
    let peak = samples
        .iter()
        .map(|sample| sample.1.abs())
        .fold(1.0, f64::max)
        * 1.1;
    let x = Axis::round("time in s", SHOWN_S);
    let y = Axis::round("signal in ADC steps", -1.4 * peak..peak);
    let marks = [
        Mark::strokes(REFUSED, &impulses, -1.35 * peak..-1.1 * peak),
        Mark::line(FIRST, samples.clone()),
    ];
    let legend = [
        (FIRST, "gauge 2, 5–100 Hz"),
        (REFUSED, "impulse at each zero crossing"),
    ];
    let caption = format!("{wavelength_mm} mm at {speed_mm_s} mm/s");
    let shown_s = SHOWN_S.end - SHOWN_S.start;
    let rows = samples.iter().map(|&(t_s, signal)| {
        let impulse = u8::from(impulses.contains(&t_s));
        (t_s, signal, impulse)
    });
    Ok(Exhibit {
        id: "fig-4",
        title: "Fig. 4: band-passed signal and crossing impulses".into(),
        paper:
            "The paper shows an example and gives neither specimen nor speed nor scale in its text."
                .into(),
        seen: format!(
            "{} impulses in {shown_s:.1} s are {:.1} Hz by equation (2), against v/λ = {:.1} Hz. \
             Ours comes of a simulated gauge without noise, filtered by the sensor's own filters from the ADC \
             codes of the run, so it is more regular than a rubbed specimen's is.",
            impulses.len(),
            impulses.len() as f64 / (2.0 * shown_s),
            cell.frequency_hz(),
        ),
        conclusions: Vec::new(),
        csvs: vec![(
            "fig-4.csv".into(),
            csv_text_under(&["t_s", "signal_lsb", "impulse"], rows)?,
        )],
        parts: vec![Part::chart(caption, &legend, (300.0, &x, &y), marks)],
        shared: &[],
    })
}
