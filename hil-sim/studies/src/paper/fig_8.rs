//! Fig. 8: from one specimen onto another.

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::palette::{FIRST, INK, REFUSED, SECOND};
use crate::output::report::crossings::banded;
use crate::paper::PaperError;
use crate::paper::exhibit::{Conclusion, Exhibit, Part, number};
use crate::paper::plan::{FIG_8_BOUNDARY_MM, FIG_8_MM, FIG_8_SPEED_MM_S, Runs, estimates};
use crate::paper::theory::WINDOW_S;
use crate::study::csv_text_under;
use hil_sim_core::judge::JudgedEstimate;

const EXHIBIT: &str = "Fig. 8";
/// When the fingertip's middle is at the boundary, in s.
const BOUNDARY_S: f64 = FIG_8_BOUNDARY_MM / FIG_8_SPEED_MM_S;
/// What is shown, in s.
const SHOWN_S: std::ops::Range<f64> = BOUNDARY_S - 0.3..BOUNDARY_S + 0.7;
/// The gauge that is counted.
const GAUGE: usize = 2;
/// How far behind the middle the last gauge is, in mm.
const LAST_GAUGE_MM: f64 = 3.0;
/// Within how much of λ an estimate has arrived.
const ARRIVED: f64 = 0.1;
/// The upper edge of the chart, in mm.
const TOP_MM: f64 = 9.0;

/// How long after the boundary the first of these is within a tenth of λ, and from when on all are, in ms.
fn arrival(values: &[(f64, f64)]) -> (Option<f64>, Option<f64>) {
    let boundary = values.partition_point(|value| value.0 < BOUNDARY_S);
    let after = &values[boundary..];
    let near = |value: &&(f64, f64)| (value.1 / FIG_8_MM[1] - 1.0).abs() <= ARRIVED;
    let ms = |value: &(f64, f64)| 1e3 * (value.0 - BOUNDARY_S);
    let settled = after.iter().rposition(|value| !near(&value));
    let settled = settled.map_or(0, |last_off| last_off + 1);
    (after.iter().find(near).map(ms), after.get(settled).map(ms))
}

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let truth_mm = |x_mm: f64| FIG_8_MM[usize::from(x_mm >= FIG_8_BOUNDARY_MM)];
    let estimates: Vec<JudgedEstimate> = estimates(runs.fig_8, &truth_mm)
        .into_iter()
        .filter(|estimate| SHOWN_S.contains(&estimate.t_s))
        .collect();
    let values = |value: fn(&JudgedEstimate) -> Option<f64>| -> Vec<(f64, f64)> {
        let all = estimates.iter();
        all.filter_map(|e| Some((e.t_s, value(e)?))).collect()
    };
    let counted = values(|e| e.counted_mm);
    let default = values(|e| e.wavelength_mm.filter(|_| e.valid));
    if counted.is_empty() || default.is_empty() {
        return Err(PaperError::Empty {
            exhibit: EXHIBIT,
            missing: "estimates",
        });
    }
    let signal: Vec<(f64, f64)> = banded(&runs.fig_8.scans, GAUGE, SHOWN_S.end)
        .samples
        .into_iter()
        .filter(|sample| SHOWN_S.contains(&sample.0))
        .collect();
    let peak = 1.15 * signal.iter().map(|s| s.1.abs()).fold(1.0, f64::max);
    let (first_ms, _) = arrival(&counted);
    let (_, settled_ms) = arrival(&default);
    let full_s = BOUNDARY_S + WINDOW_S;
    let later = counted.iter().filter(|value| value.0 > full_s);
    let (low_mm, high_mm) = later.fold((f64::INFINITY, 0.0f64), |(low, high), value| {
        (low.min(value.1), high.max(value.1))
    });

    let x = Axis::round("time in s", SHOWN_S);
    let edge = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
        points
            .iter()
            .map(|&(t_s, mm)| (t_s, mm.min(TOP_MM)))
            .collect()
    };
    let truth = vec![
        (SHOWN_S.start, FIG_8_MM[0]),
        (BOUNDARY_S, FIG_8_MM[0]),
        (BOUNDARY_S, FIG_8_MM[1]),
        (SHOWN_S.end, FIG_8_MM[1]),
    ];
    let parts = vec![
        Part::chart(
            "sensory output",
            &[
                (FIRST, "gauge 2, 5–100 Hz"),
                (INK, "B: the fingertip's middle is at the boundary"),
            ],
            (220.0, &x, &Axis::round("signal in ADC steps", -peak..peak)),
            [
                Mark::thin(FIRST, signal.clone()),
                Mark::strokes(INK, &[BOUNDARY_S], -peak..peak),
            ],
        ),
        Part::chart(
            "estimated wavelength",
            &[
                (SECOND, "true λ"),
                (REFUSED, "count"),
                (FIRST, "the default estimator, valid"),
                (INK, "B, and a window later"),
            ],
            (280.0, &x, &Axis::round("wavelength in mm", 0.0..TOP_MM)),
            [
                Mark::strokes(INK, &[BOUNDARY_S, full_s], 0.0..TOP_MM),
                Mark::line(SECOND, truth),
                Mark::discs(REFUSED, edge(&counted)),
                Mark::discs(FIRST, edge(&default)),
            ],
        ),
    ];
    let rows = estimates.iter().map(|e| {
        let default_mm = e.wavelength_mm.filter(|_| e.valid);
        (e.t_s, e.truth_mm, e.counted_mm, default_mm)
    });
    let header = ["t_s", "truth_mm", "counted_mm", "default_mm"];
    let ms = |value: Option<f64>| number(value, 0);
    Ok(Exhibit {
        id: "fig-8",
        title: "Fig. 8: from 1 mm onto 4 mm".into(),
        paper: "80 ms after the boundary, says the paper, the estimate was roaming around 4 mm. It does not give the \
                speed; ours is 70 mm/s."
            .into(),
        seen: format!(
            "Our count is first within a tenth of 4 mm {} ms after the boundary, and from 80 ms on it is between \
             {low_mm:.1} and {high_mm:.1} mm; the paper's was roaming. The default estimator has settled within a tenth \
             after {} ms; the last of its five gauges comes to the boundary {:.0} ms after their middle.",
            ms(first_ms),
            ms(settled_ms),
            1e3 * LAST_GAUGE_MM / FIG_8_SPEED_MM_S,
        ),
        conclusions: vec![
            Conclusion {
                claim: "from 80 ms after the boundary on the count roams over more than a tenth of 4 mm",
                holds: high_mm - low_mm > 0.1 * FIG_8_MM[1],
            },
            Conclusion {
                claim: "the default estimator settles within a tenth",
                holds: settled_ms.is_some(),
            },
        ],
        csvs: vec![
            ("fig-8.csv".into(), csv_text_under(&header, rows)?),
            (
                "fig-8-signal.csv".into(),
                csv_text_under(&["t_s", "signal_lsb"], &signal)?,
            ),
        ],
        parts,
        shared: &[],
    })
}
