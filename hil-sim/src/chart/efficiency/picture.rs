//! The picture: error over bound, and both, over frequency.

use super::{GOAL, Row};
use crate::chart::panel::{
    AROUND, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, goal, line, look,
    mark, page, text,
};

/// The bank's error over the Cramér–Rao bound, over frequency.
pub fn draw(rows: &[Row]) -> String {
    let height = 32.0 + PANEL_HEIGHT + MARGIN;
    let mut svg = page(height);
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "The bank’s RMS error over the Cramér–Rao bound for the travel that holds 99 % of its kernel; \
         steady speed, 20 dB. Circles: a sine; squares: a trapezoid.",
    );
    let frequency = Scale::decades(4.0, 125.0, "v/λ, Hz");
    let error = Scale::decades(0.02, 2.0, "");
    let ratio = Scale::even(0.0, 5.0, 1.0, "");
    let looks = [
        ("sine", look("sine", "#0072B2", Shape::Circle)),
        ("trapezoid", look("trapezoid", "#D55E00", Shape::Square)),
    ];
    type Value = fn(&Row) -> Option<f64>;
    let panels: [(&str, usize, &Scale, Value); 3] = [
        ("one gauge: error over bound", 1, &ratio, Row::ratio),
        ("five gauges: error over bound", 5, &ratio, Row::ratio),
        ("one gauge: RMS error, %", 1, &error, |row| row.rms_percent),
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
                let [from, to] = [bound[0], bound[1]]
                    .map(|row| panel.at(row.frequency_hz, row.kernel_bound_percent));
                line(
                    &mut svg,
                    from,
                    to,
                    "stroke=\"#444444\" stroke-width=\"1.2\" stroke-dasharray=\"6 4\"",
                );
            }
        } else if gauges == 1 {
            goal(&mut svg, &panel, GOAL, &format!("goal {GOAL}"));
        }
        for (profile, look) in &looks {
            for row in shown(profile) {
                if let Some(value) = value(row) {
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
