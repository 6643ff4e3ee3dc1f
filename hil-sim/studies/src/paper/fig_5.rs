//! Fig. 5: a sinusoidal hand in the theory of equation (8), and the boards' count of it.

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::palette::{FIRST, QUIET, REFUSED, SECOND, SHADE};
use crate::paper::PaperError;
use crate::paper::exhibit::{Exhibit, Part};
use crate::paper::plan::{
    FIG_5_HAND_HZ, FIG_5_MM, FIG_5_PEAK_MM_S, FIG_5_WINDOW_MS, Runs, estimates,
};
use crate::paper::theory::Rub;
use crate::study::csv_text_under;
use hil_sim_core::judge::JudgedEstimate;

const EXHIBIT: &str = "Fig. 5";
/// A and λ, α and fᵥ, of the paper's caption.
const RUB: Rub = Rub {
    window_s: FIG_5_WINDOW_MS as f64 * 1e-3,
    wavelength_mm: FIG_5_MM,
    peak_mm_s: FIG_5_PEAK_MM_S,
    hand_hz: FIG_5_HAND_HZ,
};
/// What is shown, in s: a period and a half.
const SHOWN_S: std::ops::Range<f64> = 1.0..2.5;
/// Speed from which on fe is taken back from λe, in mm/s: v/λe of two numbers near 0 says nothing.
const SLOWEST_MM_S: f64 = 10.0;
/// Between two points of a line, in s.
const POINT_S: f64 = 2e-3;

pub(super) fn exhibit(runs: &Runs) -> Result<Exhibit, PaperError> {
    let counted: Vec<JudgedEstimate> = estimates(runs.fig_5, &|_| FIG_5_MM)
        .into_iter()
        .filter(|estimate| SHOWN_S.contains(&estimate.t_s))
        .collect();
    // The estimate's own range is that of the paper's window of 80 ms.
    let of_t1 = counted.iter().filter(|estimate| RUB.is_t1(estimate.t_s));
    let in_t1: Vec<f64> = of_t1
        .filter_map(|estimate| estimate.wavelength_mm)
        .collect();
    if in_t1.is_empty() {
        return Err(PaperError::Empty {
            exhibit: EXHIBIT,
            missing: "estimates",
        });
    }
    let mean_error_mm = in_t1.iter().map(|mm| mm - FIG_5_MM).sum::<f64>() / in_t1.len() as f64;
    let t1_percent = 100.0 * in_t1.len() as f64 / counted.len() as f64;

    let x = Axis::round("time in s", SHOWN_S);
    let points = ((SHOWN_S.end - SHOWN_S.start) / POINT_S) as u32;
    let line = |value: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        (0..=points)
            .map(|point| SHOWN_S.start + f64::from(point) * POINT_S)
            .map(|t_s| (t_s, value(t_s)))
            .collect()
    };
    let shade = || Mark::Shade(SHADE, t2());
    let half_s = 0.5 * RUB.window_s;
    let top_hz = 1.1 * RUB.peak_mm_s / RUB.wavelength_mm;
    let velocity = Part::chart(
        "rubbing velocity",
        &[(FIRST, "v(t)"), (SHADE, "range T2")],
        (190.0, &x, &Axis::round("v in mm/s", -110.0..110.0)),
        [
            shade(),
            Mark::line(FIRST, line(&|t_s| RUB.velocity_mm_s(t_s))),
        ],
    );
    let counted_hz: Vec<(f64, f64)> = counted
        .iter()
        .filter_map(|e| {
            let speed_mm_s = RUB.velocity_mm_s(e.t_s - half_s).abs();
            let frequency_hz = speed_mm_s / e.wavelength_mm?;
            (speed_mm_s >= SLOWEST_MM_S).then_some((e.t_s, frequency_hz))
        })
        .collect();
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
            Mark::line(SECOND, line(&|t_s| RUB.frequency_hz(t_s - half_s))),
            Mark::line(FIRST, line(&|t_s| RUB.estimated_hz(t_s))),
            Mark::discs(REFUSED, counted_hz),
        ],
    );
    let dots = |t1: bool| -> Vec<(f64, f64)> {
        counted
            .iter()
            .filter(|e| RUB.is_t1(e.t_s) == t1)
            .filter_map(|e| Some((e.t_s, e.wavelength_mm?.min(3.0))))
            .collect()
    };
    let wavelength = Part::chart(
        "estimated wavelength",
        &[
            (SECOND, "λ"),
            (FIRST, "λe(t) of equation (8)"),
            (REFUSED, "λe of the board in T1"),
            (QUIET, "in T2"),
        ],
        (250.0, &x, &Axis::round("wavelength in mm", 0.0..3.0)),
        [
            shade(),
            Mark::line(
                SECOND,
                vec![(SHOWN_S.start, FIG_5_MM), (SHOWN_S.end, FIG_5_MM)],
            ),
            Mark::line(FIRST, line(&|t_s| RUB.estimated_mm(t_s).min(3.0))),
            Mark::discs(QUIET, dots(false)),
            Mark::discs(REFUSED, dots(true)),
        ],
    );
    let rows = counted.iter().map(|e| {
        let truth = (RUB.velocity_mm_s(e.t_s), RUB.frequency_hz(e.t_s - half_s));
        let theory = (RUB.estimated_hz(e.t_s), RUB.estimated_mm(e.t_s));
        let range = if RUB.is_t1(e.t_s) { "T1" } else { "T2" };
        (e.t_s, truth, theory, e.wavelength_mm, range)
    });
    let header = [
        "t_s",
        "velocity_mm_s",
        "true_hz_half_a_window_ago",
        "equation_8_hz",
        "equation_8_mm",
        "counted_mm",
        "range",
    ];
    Ok(Exhibit {
        id: "fig-5",
        title: "Fig. 5: the count of a sinusoidal hand, in theory and on the board".into(),
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
        conclusions: Vec::new(),
        csvs: vec![("fig-5.csv".into(), csv_text_under(&header, rows)?)],
        parts: vec![velocity, frequency, wavelength],
        shared: &[],
    })
}

/// The stretches of range T2: a window after each turn.
fn t2() -> Vec<std::ops::Range<f64>> {
    let half_period_s = 0.5 / RUB.hand_hz;
    (0..)
        .map(|turn| f64::from(turn) * half_period_s)
        .take_while(|turn_s| *turn_s < SHOWN_S.end)
        .filter(|turn_s| turn_s + RUB.window_s > SHOWN_S.start)
        .map(|turn_s| turn_s.max(SHOWN_S.start)..(turn_s + RUB.window_s).min(SHOWN_S.end))
        .collect()
}
