//! Fig. 4: a gauge behind the band-pass, and the impulses of its crossings.

use crate::output::plot::Axis;
use crate::output::plot::palette::{FIRST, REFUSED};
use crate::output::report::crossings::banded;
use crate::paper::PaperError;
use crate::paper::exhibit::{Exhibit, Part};
use crate::paper::plan::{COUNTED_GAUGE, Runs};
use crate::study::{Record, csv, short};

const EXHIBIT: &str = "Fig. 4";
/// The cell of Table I that is shown, λ in mm and v in mm/s, and the time.
const CELL: (f64, f64) = (2.0, 50.0);
const SHOWN_S: std::ops::Range<f64> = 1.0..1.4;

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let empty = |missing| PaperError::Empty(EXHIBIT, missing);
    let (wavelength_mm, speed_mm_s) = CELL;
    let mut cells = runs.cells.iter();
    let cell = cells.find(|cell| (cell.wavelength_mm, cell.speed_mm_s) == CELL);
    let cell = cell.ok_or(empty("run"))?;
    let banded = banded(&cell.recording.scans, COUNTED_GAUGE, &SHOWN_S);
    if banded.samples.is_empty() {
        return Err(empty("samples"));
    }
    let (y, marks) = banded.drawn();
    let legend = [
        (FIRST, "gauge 2, 5–100 Hz"),
        (REFUSED, "impulse at each zero crossing"),
    ];
    let caption = format!("{wavelength_mm} mm at {speed_mm_s} mm/s");
    let x = Axis::round("time in s", SHOWN_S);
    let shown_s = SHOWN_S.end - SHOWN_S.start;
    let impulses = &banded.impulses;
    let rows = banded.samples.iter().map(|&(t_s, signal)| {
        Record::default()
            .with("t_s", t_s)
            .with("signal_lsb", signal)
            .with("impulse", short(u8::from(impulses.contains(&t_s))))
    });
    Ok(Exhibit {
        id: "fig-4",
        title: "Fig. 4: band-passed signal and crossing impulses",
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
        csvs: vec![("fig-4.csv", csv(rows))],
        parts: vec![Part::chart(caption, &legend, (300.0, &x, &y), marks)],
        ..Exhibit::default()
    })
}
