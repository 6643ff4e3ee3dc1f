//! The picture: error over bound, and both, over frequency.

use super::{Cell, MEAN_GOAL, Row, WORST_GOAL};
use crate::output::plot::panel::{
    AROUND, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, goal, line, look,
    mark, page, text,
};

/// The estimator's error over the Cramér–Rao bound, over frequency.
pub fn draw(rows: &[Row]) -> String {
    let height = 32.0 + PANEL_HEIGHT + MARGIN;
    let mut svg = page(height);
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"11\" fill=\"{SOFT}\""),
        "The default estimator’s RMS error over the Cramér–Rao bound for the 8 λ that it fits; steady \
         speed, 20 dB, a minute or more a mark. Circles: sines; squares: trapezoids.",
    );
    let frequency = Scale::decades(4.0, 125.0, "v/λ, Hz");
    let error = Scale::decades(0.005, 0.2, "");
    let ratio = Scale::even(0.8, 2.0, 0.2, "");
    let looks = [
        ("sine", look("sine", "#0072B2", Shape::Circle)),
        ("trapezoid", look("trapezoid", "#D55E00", Shape::Square)),
    ];
    type Value = fn(&Cell) -> Option<f64>;
    let panels: [(&str, usize, &Scale, Value); 3] = [
        ("one gauge: error over bound", 1, &ratio, Cell::ratio),
        ("five gauges: error over bound", 5, &ratio, Cell::ratio),
        ("five gauges: RMS error, %", 5, &error, |cell| {
            cell.rms_percent
        }),
    ];
    for (column, (title, gauges, y, value)) in panels.into_iter().enumerate() {
        let left = MARGIN + column as f64 * PANEL_WIDTH + AROUND[0];
        let panel = Panel {
            left,
            top: 32.0 + AROUND[1],
            x: &frequency,
            y,
        };
        axes(&mut svg, &panel, title);
        let shown = |profile| {
            rows.iter()
                .filter(move |row| row.gauges == gauges && row.profile == profile)
        };
        if y.logarithmic {
            for bound in shown("sine").collect::<Vec<_>>().windows(2) {
                let [from, to] =
                    [bound[0], bound[1]].map(|row| panel.at(row.frequency_hz, row.bound_percent()));
                line(
                    &mut svg,
                    from,
                    to,
                    "stroke=\"#444444\" stroke-width=\"1.2\" stroke-dasharray=\"6 4\"",
                );
            }
        } else if gauges == 5 {
            goal(&mut svg, &panel, MEAN_GOAL, &format!("mean {MEAN_GOAL:.2}"));
            goal(
                &mut svg,
                &panel,
                WORST_GOAL,
                &format!("worst {WORST_GOAL:.2}"),
            );
        }
        for (profile, look) in &looks {
            for row in shown(profile) {
                for value in row.cells.iter().filter_map(value) {
                    mark(
                        &mut svg,
                        panel.at(row.frequency_hz, value),
                        look,
                        false,
                        1.0,
                    );
                }
            }
        }
    }
    svg.push_str("</svg>\n");
    svg
}
