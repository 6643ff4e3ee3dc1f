//! Fig. 5: a sinusoidal hand in the theory of equation (8), and the boards' count of it.

use std::ops::Range;

use crate::output::plot::palette::{FIRST, QUIET, REFUSED, SECOND, SHADE};
use crate::output::plot::{Axis, Mark};
use crate::paper::PaperError;
use crate::paper::exhibit::{Exhibit, Part};
use crate::paper::plan::{
    FIG_5_HAND_HZ, FIG_5_MM, FIG_5_PEAK_MM_S, FIG_5_WINDOW_MS, Runs, estimates,
};
use crate::paper::theory::Rub;
use crate::study::{Record, csv};
use hil_sim_core::judge::JudgedEstimate;

/// A and λ, α and fᵥ, of the paper's caption.
const RUB: Rub = Rub {
    window_s: FIG_5_WINDOW_MS as f64 * 1e-3,
    wavelength_mm: FIG_5_MM,
    peak_mm_s: FIG_5_PEAK_MM_S,
    hand_hz: FIG_5_HAND_HZ,
};
/// What is shown: a period and a half.
const SHOWN_S: Range<f64> = 1.0..2.5;
/// Speed from which on fe is taken back from λe: v/λe of two numbers near 0 says nothing.
const SLOWEST_MM_S: f64 = 10.0;
/// Between two points of a line.
const POINT_S: f64 = 2e-3;
/// The upper edge of the chart.
const TOP_MM: f64 = 3.0;

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let mut counted: Vec<JudgedEstimate> = estimates(runs.fig_5, &|_| FIG_5_MM);
    counted.retain(|estimate| SHOWN_S.contains(&estimate.t_s));
    // The estimate's own range is that of the paper's window of 80 ms.
    let of_range = |t1: bool| {
        let of_range = counted.iter().filter(move |e| RUB.is_t1(e.t_s) == t1);
        of_range.filter_map(|e| Some((e.t_s, e.wavelength_mm?)))
    };
    let in_t1: Vec<f64> = of_range(true).map(|(_, mm)| mm).collect();
    if in_t1.is_empty() {
        return Err(PaperError::Empty("Fig. 5", "estimates"));
    }
    let mean_error_mm = in_t1.iter().map(|mm| mm - FIG_5_MM).sum::<f64>() / in_t1.len() as f64;
    let t1_percent = 100.0 * in_t1.len() as f64 / counted.len() as f64;

    let x = Axis::round("time in s", SHOWN_S);
    let points = ((SHOWN_S.end - SHOWN_S.start) / POINT_S) as u32;
    let line = |colour, value: &dyn Fn(f64) -> f64| {
        let instants_s = (0..=points).map(|point| SHOWN_S.start + f64::from(point) * POINT_S);
        Mark::line(colour, instants_s.map(|t_s| (t_s, value(t_s))).collect())
    };
    let shade = || Mark::Shade(SHADE, t2());
    let half_s = 0.5 * RUB.window_s;
    let top_hz = 1.1 * RUB.peak_mm_s / RUB.wavelength_mm;
    let velocity = Part::chart(
        "rubbing velocity",
        &[(FIRST, "v(t)"), (SHADE, "range T2")],
        (190.0, &x, &Axis::round("v in mm/s", -110.0..110.0)),
        [shade(), line(FIRST, &|t_s| RUB.velocity_mm_s(t_s))],
    );
    let counted_hz = counted.iter().filter_map(|e| {
        let speed_mm_s = RUB.velocity_mm_s(e.t_s - half_s).abs();
        let frequency_hz = speed_mm_s / e.wavelength_mm?;
        (speed_mm_s >= SLOWEST_MM_S).then_some((e.t_s, frequency_hz))
    });
    let frequency = Part::chart(
        "vibratory frequency",
        &[
            (SECOND, "true f(t − A/2)"),
            (FIRST, "fe(t), equation (8)"),
            (REFUSED, "fe counted by the board"),
        ],
        (250.0, &x, &Axis::round("frequency in Hz", 0.0..top_hz)),
        [
            shade(),
            line(SECOND, &|t_s| RUB.frequency_hz(t_s - half_s)),
            line(FIRST, &|t_s| RUB.estimated_hz(t_s)),
            Mark::discs(REFUSED, counted_hz.collect()),
        ],
    );
    let discs = |colour, t1| {
        let points = of_range(t1).map(|(t_s, mm)| (t_s, mm.min(TOP_MM)));
        Mark::discs(colour, points.collect())
    };
    let truth = vec![(SHOWN_S.start, FIG_5_MM), (SHOWN_S.end, FIG_5_MM)];
    let wavelength = Part::chart(
        "estimated wavelength",
        &[
            (SECOND, "λ"),
            (FIRST, "λe(t) of equation (8)"),
            (REFUSED, "λe of the board in T1"),
            (QUIET, "in T2"),
        ],
        (250.0, &x, &Axis::round("wavelength in mm", 0.0..TOP_MM)),
        [
            shade(),
            Mark::line(SECOND, truth),
            line(FIRST, &|t_s| RUB.estimated_mm(t_s).min(TOP_MM)),
            discs(QUIET, false),
            discs(REFUSED, true),
        ],
    );
    let rows = counted.iter().map(|e| {
        Record::default()
            .with("t_s", e.t_s)
            .with("velocity_mm_s", RUB.velocity_mm_s(e.t_s))
            .with(
                "true_hz_half_a_window_ago",
                RUB.frequency_hz(e.t_s - half_s),
            )
            .with("equation_8_hz", RUB.estimated_hz(e.t_s))
            .with("equation_8_mm", RUB.estimated_mm(e.t_s))
            .with("counted_mm", e.wavelength_mm)
            .with("range", if RUB.is_t1(e.t_s) { "T1" } else { "T2" })
    });
    Ok(Exhibit {
        id: "fig-5",
        title: "Fig. 5: the count of a sinusoidal hand, in theory and on the board",
        paper:
            "A = 0.2 s, λ = 2 mm, α = 100 mm/s, fᵥ = 1 Hz, X = 0: a simulation, shown as curves."
                .into(),
        seen: format!(
            "In T1, {t1_percent:.0} % of the time, λe of theory is a constant {:.4} mm too long and that of the board's \
             count {mean_error_mm:.4} mm in the mean; in T2 both fall towards 0. The board counts whole crossings, \
             2.5 Hz apart with this window, so its points step around the theory's line, which the paper drew \
             without steps.",
            RUB.approximation_mm(),
        ),
        csvs: vec![("fig-5.csv", csv(rows))],
        parts: vec![velocity, frequency, wavelength],
        ..Exhibit::default()
    })
}

/// The stretches of range T2: a window after each turn.
fn t2() -> Vec<Range<f64>> {
    let half_period_s = 0.5 / RUB.hand_hz;
    (0..)
        .map(|turn| f64::from(turn) * half_period_s)
        .take_while(|turn_s| *turn_s < SHOWN_S.end)
        .filter(|turn_s| turn_s + RUB.window_s > SHOWN_S.start)
        .map(|turn_s| turn_s.max(SHOWN_S.start)..(turn_s + RUB.window_s).min(SHOWN_S.end))
        .collect()
}
