//! The picture: cycles and ms over the delay, and both voltages about a reversal.

use super::{Row, SHOWN_MS, SHOWN_S, stimulus_v};
use crate::output::plot::panel::{
    AROUND, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, look, mark, page,
    polyline, text,
};

const HEAD: f64 = 52.0;
const OURS: &str = "#0072B2";
const RELAYED: &str = "#D55E00";

/// Draws it.
pub fn draw(rows: &[Row]) -> String {
    let mut svg = page(HEAD + PANEL_HEIGHT + MARGIN);
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "Stimulus against the motion it belongs to: v = 70 sin(2π 0.83 t) mm/s, λ = 2 mm. \
         Ours: the display’s ELF. Relayed: what the remote finger feels, sent back, with no other fault.",
    );
    let (ours, relayed) = (
        look("ours", OURS, Shape::Circle),
        look("relayed", RELAYED, Shape::Square),
    );
    let legend = [
        (&ours, false, "ours (measured)"),
        (&ours, true, "ours with 20 % loss and 50 ms jitter"),
        (&relayed, false, "relayed over the network (model)"),
    ];
    for (index, (look, hollow, words)) in legend.into_iter().enumerate() {
        let x = MARGIN + 14.0 + index as f64 * 240.0;
        mark(&mut svg, (x, 35.0), look, hollow, 1.0);
        text(&mut svg, x + 11.0, 39.0, "font-size=\"12\"", words);
    }
    let at = |column: usize| {
        (
            MARGIN + column as f64 * PANEL_WIDTH + AROUND[0],
            HEAD + AROUND[1],
        )
    };

    type Value = fn(&Row) -> (Option<f64>, f64);
    let cycles: Value = |row| (row.ours_cycles, row.relayed_cycles);
    let ms: Value = |row| (row.ours_ms, row.relayed_ms);
    let scales = [
        (
            "phase error, RMS, cycles",
            Scale::decades(0.0001, 20.0, ""),
            cycles,
        ),
        (
            "stimulus behind its motion, ms",
            Scale::decades(0.1, 2_000.0, ""),
            ms,
        ),
    ];
    let x = Scale::even(0.0, 500.0, 100.0, "the link’s one-way delay, ms");
    for (column, (title, y, value)) in scales.into_iter().enumerate() {
        let (left, top) = at(column);
        let panel = Panel {
            left,
            top,
            x: &x,
            y: &y,
        };
        axes(&mut svg, &panel, title);
        let points: Vec<_> = rows
            .iter()
            .filter(|row| row.link.loss == 0.0 && value(row).1 > 0.0)
            .map(|row| panel.at(row.link.delay_ms, value(row).1))
            .collect();
        polyline(
            &mut svg,
            &points,
            &format!("stroke=\"{RELAYED}\" stroke-width=\"1.2\""),
        );
        for row in rows {
            let (ours_value, relayed_value) = value(row);
            let delay_ms = row.link.delay_ms;
            if let Some(ours_value) = ours_value {
                let point = panel.at(delay_ms, ours_value);
                mark(&mut svg, point, &ours, row.link.loss > 0.0, 0.9);
            }
            if row.link.loss == 0.0 && relayed_value > 0.0 {
                mark(
                    &mut svg,
                    panel.at(delay_ms, relayed_value),
                    &relayed,
                    false,
                    0.9,
                );
            }
        }
    }
    voltages(&mut svg, at(2), rows);
    svg.push_str("</svg>\n");
    svg
}

fn voltages(svg: &mut String, (left, top): (f64, f64), rows: &[Row]) {
    let x = Scale::even(SHOWN_S.start, SHOWN_S.end, 0.1, "s");
    let y = Scale::even(-6.0, 6.0, 3.0, "");
    let panel = Panel {
        left,
        top,
        x: &x,
        y: &y,
    };
    axes(
        svg,
        &panel,
        &format!("V, at {SHOWN_MS} ms each way, about a reversal"),
    );
    let shown = rows.iter().find(|row| !row.drawn.is_empty());
    let begins = shown.map_or(0.0, |row| row.begins_cycles);
    let drawn = |late_s: f64| -> Vec<_> {
        (0..=1_100)
            .map(|step| SHOWN_S.start + (SHOWN_S.end - SHOWN_S.start) * f64::from(step) / 1_100.0)
            .map(|t_s| panel.at(t_s, stimulus_v(t_s, late_s, begins)))
            .collect()
    };
    let late_s = 2e-3 * SHOWN_MS;
    polyline(
        svg,
        &drawn(late_s),
        &format!("stroke=\"{RELAYED}\" stroke-width=\"1.2\""),
    );
    polyline(
        svg,
        &drawn(0.0),
        "stroke=\"#24292f\" stroke-width=\"0.8\" stroke-dasharray=\"3 2\"",
    );
    if let Some(row) = shown {
        // The converter holds each voltage up to the next edge.
        let mut points = Vec::new();
        for pair in row.drawn.windows(2) {
            points.push(panel.at(pair[0].0, pair[0].1));
            points.push(panel.at(pair[1].0, pair[0].1));
        }
        polyline(
            svg,
            &points,
            &format!("stroke=\"{OURS}\" stroke-width=\"1.2\""),
        );
    }
    let style = "text-anchor=\"end\" font-size=\"10\"";
    text(
        svg,
        left + Panel::WIDE - 3.0,
        top + 9.0,
        style,
        "dashed: due",
    );
}
