//! The picture: error over bound, and both, over frequency.

use super::{Cell, MEAN_GOAL, Row, WORST_GOAL};
use crate::output::plot::palette::{BLUE, INK, VERMILION};
use crate::output::plot::{Axis, Key, Mark, Panel, Shape, Stroke, Symbol, in_threes};

/// The profiles, their looks and what a legend calls them.
const PROFILES: [(&str, Symbol, &str); 2] = [
    ("sine", Symbol::new(BLUE, Shape::Circle), "sines"),
    (
        "trapezoid",
        Symbol::new(VERMILION, Shape::Square),
        "trapezoids",
    ),
];
const BOUND: Stroke = Stroke::new(INK, 1.2).dashed("6 4");

pub fn draw(rows: &[Row]) -> String {
    let note = "The default estimator’s RMS error over the Cramér–Rao bound for the 8 λ that it fits; steady \
         speed, 20 dB, a minute or more a mark.";
    let profiles = PROFILES.map(|(_, symbol, words)| (Key::Symbol(symbol), words));
    let legend = [&profiles[..], &[(Key::Line(BOUND), "the bound")]].concat();
    let frequency = Axis::decades(4.0, 125.0, "v/λ, Hz");
    let error = Axis::decades(0.005, 0.2, "");
    let ratio = Axis::even(0.8, 2.0, 0.2, "");
    let of = |gauges| move |row: &&Row| row.gauges == gauges;
    let symbols = |gauges: usize, value: fn(&Cell) -> Option<f64>| {
        PROFILES.map(|(profile, symbol, _)| {
            let shown = rows.iter().filter(of(gauges));
            let points = shown.filter(|row| row.profile == profile).flat_map(|row| {
                let values = row.cells.iter().filter_map(value);
                values.map(|value| (row.frequency_hz, value))
            });
            Mark::Symbols(symbol, points.collect())
        })
    };
    let sines = rows
        .iter()
        .filter(of(5))
        .filter(|row| row.profile == "sine");
    let bound = sines.map(|row| (row.frequency_hz, row.bound_percent()));
    let goals = [("mean", MEAN_GOAL), ("worst", WORST_GOAL)]
        .map(|(of, goal)| Mark::Level(goal, format!("{of} {goal:.2}")));
    let panels = [
        Panel::new("one gauge: error over bound", &frequency, &ratio).with(symbols(1, Cell::ratio)),
        Panel::new("five gauges: error over bound", &frequency, &ratio)
            .with(goals)
            .with(symbols(5, Cell::ratio)),
        Panel::new("five gauges: RMS error, %", &frequency, &error)
            .with([Mark::Line(BOUND, bound.collect())])
            .with(symbols(5, |cell| cell.rms_percent)),
    ];
    in_threes(note, &legend, &panels)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn the_texts_stay_within_the_picture() {
        let rows = [("sine", 1), ("sine", 5), ("trapezoid", 5)].map(|(profile, gauges)| Row {
            profile,
            gauges,
            frequency_hz: 20.0,
            cells: vec![Cell {
                wavelength_mm: 1.0,
                duration_s: 60.0,
                rms_percent: Some(0.06),
                bias_percent: None,
                valid_share: 1.0,
                bound_percent: 0.05,
            }],
        });
        crate::output::plot::tests::assert_fits("bound", &draw(&rows));
    }
}
