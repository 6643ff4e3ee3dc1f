//! Fig. 8: from one specimen onto another.

use crate::output::plot::palette::{FIRST, INK, REFUSED, SECOND};
use crate::output::plot::{Axis, Mark};
use crate::output::report::crossings::banded;
use crate::paper::PaperError;
use crate::paper::exhibit::{Conclusion, Exhibit, Part, number};
use crate::paper::plan::{
    COUNTED_GAUGE, FIG_8_BOUNDARY_MM, FIG_8_MM, FIG_8_SPEED_MM_S, Runs, estimates, valid_mm,
};
use crate::paper::theory::WINDOW_S;
use crate::study::{Record, csv};
use hil_sim_core::judge::JudgedEstimate;

/// When the fingertip's middle is at the boundary.
const BOUNDARY_S: f64 = FIG_8_BOUNDARY_MM / FIG_8_SPEED_MM_S;
const SHOWN_S: std::ops::Range<f64> = BOUNDARY_S - 0.3..BOUNDARY_S + 0.7;
/// How far behind the middle the last gauge is.
const LAST_GAUGE_MM: f64 = 3.0;
/// Within how much of λ an estimate has arrived.
const ARRIVED: f64 = 0.1;
/// The upper edge of the chart.
const TOP_MM: f64 = 9.0;

/// How long after the boundary the first of these is within a tenth of λ, and from when on all are, in ms.
fn arrival(values: &[(f64, f64)]) -> (Option<f64>, Option<f64>) {
    let boundary = values.partition_point(|value| value.0 < BOUNDARY_S);
    let after = &values[boundary..];
    let near = |value: &&(f64, f64)| (value.1 / FIG_8_MM[1] - 1.0).abs() <= ARRIVED;
    let ms = |value: &(f64, f64)| 1e3 * (value.0 - BOUNDARY_S);
    let last_off = after.iter().rposition(|value| !near(&value));
    let settled = after.get(last_off.map_or(0, |last_off| last_off + 1));
    (after.iter().find(near).map(ms), settled.map(ms))
}

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let truth_mm = |x_mm: f64| FIG_8_MM[usize::from(x_mm >= FIG_8_BOUNDARY_MM)];
    let mut estimates: Vec<JudgedEstimate> = estimates(runs.fig_8, &truth_mm);
    estimates.retain(|estimate| SHOWN_S.contains(&estimate.t_s));
    let values = |value: fn(&JudgedEstimate) -> Option<f64>| -> Vec<(f64, f64)> {
        let all = estimates.iter();
        all.filter_map(|e| Some((e.t_s, value(e)?))).collect()
    };
    let counted = values(|e| e.counted_mm);
    let default = values(valid_mm);
    if counted.is_empty() || default.is_empty() {
        return Err(PaperError::Empty("Fig. 8", "estimates"));
    }
    let signal = banded(&runs.fig_8.scans, COUNTED_GAUGE, &SHOWN_S).samples;
    let peak = 1.15 * signal.iter().map(|s| s.1.abs()).fold(1.0, f64::max);
    let (first_ms, _) = arrival(&counted);
    let (_, settled_ms) = arrival(&default);
    let full_s = BOUNDARY_S + WINDOW_S;
    let later = counted.iter().filter(|value| value.0 > full_s);
    let later = later.map(|value| value.1);
    let low_mm = later.clone().fold(f64::INFINITY, f64::min);
    let high_mm = later.fold(0.0, f64::max);

    let x = Axis::round("time in s", SHOWN_S);
    let edge = |points: &[(f64, f64)]| {
        let points = points.iter().map(|&(t_s, mm)| (t_s, mm.min(TOP_MM)));
        points.collect::<Vec<_>>()
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
        Record::default()
            .with("t_s", e.t_s)
            .with("truth_mm", e.truth_mm)
            .with("counted_mm", e.counted_mm)
            .with("default_mm", valid_mm(e))
    });
    let of_signal = |&(t_s, signal): &(f64, f64)| {
        Record::default()
            .with("t_s", t_s)
            .with("signal_lsb", signal)
    };
    Ok(Exhibit {
        id: "fig-8",
        title: "Fig. 8: from 1 mm onto 4 mm",
        paper: "80 ms after the boundary, says the paper, the estimate was roaming around 4 mm. It does not give the \
                speed; ours is 70 mm/s."
            .into(),
        seen: format!(
            "Our count is first within a tenth of 4 mm {} ms after the boundary, and from 80 ms on it is between \
             {low_mm:.1} and {high_mm:.1} mm; the paper's was roaming. The default estimator has settled within a tenth \
             after {} ms; the last of its five gauges comes to the boundary {:.0} ms after their middle.",
            number(first_ms, 0),
            number(settled_ms, 0),
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
            ("fig-8.csv", csv(rows)),
            ("fig-8-signal.csv", csv(signal.iter().map(of_signal))),
        ],
        parts,
        ..Exhibit::default()
    })
}
