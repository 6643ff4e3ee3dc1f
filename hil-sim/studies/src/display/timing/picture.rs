//! The picture: how the edges are spread about their median, and hand to output over the link's delay.

use super::{GOAL_MS, Row};
use crate::output::plot::panel::{
    AROUND, Look, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, goal, look,
    mark, page, polyline, text,
};

const HEAD: f64 = 32.0;
/// Bars of the histogram.
const BARS: usize = 80;
/// The jitter that is shown on either side, in µs, at least.
const SIDE_US: f64 = 0.5;

fn look_of(rate_hz: u32) -> Look {
    if rate_hz == 2_000 {
        look("2 kHz", "#0072B2", Shape::Circle)
    } else {
        look("4 kHz", "#D55E00", Shape::Square)
    }
}

/// Draws it.
pub fn draw(rows: &[Row]) -> String {
    let mut svg = page(HEAD + PANEL_HEIGHT + MARGIN);
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "From the LDAC edges of the display’s ELF, fifty distinct channels, the hand at up to 70 mm/s. \
         Circles: 2 kHz; squares: 4 kHz; hollow: 20 % loss and 50 ms jitter on the link.",
    );
    let at = |column: usize| {
        (
            MARGIN + column as f64 * PANEL_WIDTH + AROUND[0],
            HEAD + AROUND[1],
        )
    };
    histogram(&mut svg, at(0), rows);
    type Value = fn(&Row) -> f64;
    let panels: [(&str, Value); 2] = [
        ("hand to output, p99, ms", |row| row.reaction.p99_ms),
        ("hand to output, p50 and longest, ms", |row| {
            row.reaction.max_ms
        }),
    ];
    for (column, (title, value)) in (1..).zip(panels) {
        let (left, top) = at(column);
        let x = Scale::even(0.0, 500.0, 100.0, "the link’s one-way delay, ms");
        let highest = rows
            .iter()
            .map(|row| row.reaction.max_ms)
            .fold(1.0, f64::max);
        let step = if highest > 2.0 { 1.0 } else { 0.2 };
        let y = Scale::even(0.0, (highest / step).ceil() * step, step, "");
        let panel = Panel {
            left,
            top,
            x: &x,
            y: &y,
        };
        axes(&mut svg, &panel, title);
        if column == 1 {
            goal(
                &mut svg,
                &panel,
                GOAL_MS,
                &format!("goal at 2 kHz: {GOAL_MS} ms"),
            );
        }
        for row in rows {
            let hollow = row.link.loss > 0.0;
            let look = look_of(row.rate_hz);
            let mut values = vec![value(row)];
            if column == 2 {
                values.push(row.reaction.p50_ms);
            }
            for value in values {
                mark(
                    &mut svg,
                    panel.at(row.link.delay_ms, value),
                    &look,
                    hollow,
                    0.85,
                );
            }
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// Shares of the edges over their distance from the median one, the fair link's of each rate.
fn histogram(svg: &mut String, (left, top): (f64, f64), rows: &[Row]) {
    let shown: Vec<&Row> = [2_000, 4_000]
        .iter()
        .filter_map(|&rate_hz| {
            rows.iter()
                .find(|row| row.rate_hz == rate_hz && row.link.delay_ms == 0.0)
        })
        .collect();
    let farthest = shown
        .iter()
        .map(|row| row.edges.jitter.max_us)
        .fold(SIDE_US, f64::max);
    let (side, step) = [
        (0.5, 0.25),
        (1.0, 0.5),
        (2.0, 1.0),
        (5.0, 2.5),
        (10.0, 5.0),
        (50.0, 25.0),
    ]
    .into_iter()
    .find(|(side, _)| *side >= farthest)
    .unwrap_or((farthest.ceil(), farthest.ceil() / 2.0));
    let x = Scale::even(-side, side, step, "LDAC edge, µs from the median one");
    let y = Scale::decades(0.01, 100.0, "");
    let panel = Panel {
        left,
        top,
        x: &x,
        y: &y,
    };
    axes(svg, &panel, "share of edges, %");
    for row in shown {
        let edges = &row.edges;
        let mut bars = [0usize; BARS];
        for after_us in &edges.after_us {
            let place = (after_us - edges.after.p50_us + side) / (2.0 * side);
            bars[((place * BARS as f64) as usize).min(BARS - 1)] += 1;
        }
        let mut points = Vec::new();
        for (bar, &count) in bars.iter().enumerate() {
            let share = 100.0 * count as f64 / edges.after_us.len() as f64;
            for end in [bar, bar + 1] {
                let from_median = 2.0 * side * end as f64 / BARS as f64 - side;
                points.push(panel.at(from_median, share.max(0.01)));
            }
        }
        let look = look_of(row.rate_hz);
        polyline(
            svg,
            &points,
            &format!("stroke=\"{}\" stroke-width=\"1.3\"", look.colour),
        );
    }
}
