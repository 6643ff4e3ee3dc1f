//! The picture: a spectrum, the worst spur over frequency, and the means.

use super::{GOAL_DBC, GOAL_MEAN_MV, Hand, Row, SHOWN_HZ, levels_dbc};
use crate::output::plot::panel::{
    AROUND, Look, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, goal, look,
    mark, page, polyline, text,
};
use protocol::Mode;

const HEAD: f64 = 52.0;

/// What rate and mode look like.
fn look_of(row: &Row) -> Look {
    match (row.rate_hz, row.mode) {
        (2_000, Mode::Uniform) => look("2 kHz, uniform", "#0072B2", Shape::Circle),
        (2_000, Mode::Travelling) => look("2 kHz, travelling", "#D55E00", Shape::Square),
        (_, Mode::Uniform) => look("4 kHz, uniform", "#009E73", Shape::Diamond),
        (_, Mode::Travelling) => look("4 kHz, travelling", "#CC79A7", Shape::Up),
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
        "From the LDAC edges of the display’s ELF. Full: the hand moves by whole encoder counts a tick; \
         hollow: between whole counts, where the encoder’s steps show.",
    );
    let mut looks: Vec<Look> = Vec::new();
    for row in rows {
        let look = look_of(row);
        if looks.iter().all(|known| known.method != look.method) {
            looks.push(look);
        }
    }
    for (index, look) in looks.iter().enumerate() {
        let x = MARGIN + 14.0 + index as f64 * 150.0;
        mark(&mut svg, (x, 35.0), look, false, 1.0);
        text(&mut svg, x + 11.0, 39.0, "font-size=\"12\"", look.method);
    }
    let at = |column: usize| {
        (
            MARGIN + column as f64 * PANEL_WIDTH + AROUND[0],
            HEAD + AROUND[1],
        )
    };
    spectra(&mut svg, at(0), rows);
    spurs(&mut svg, at(1), rows);
    means(&mut svg, at(2), rows);
    svg.push_str("</svg>\n");
    svg
}

fn spectra(svg: &mut String, (left, top): (f64, f64), rows: &[Row]) {
    let x = Scale::even(0.0, 1_000.0, 200.0, "Hz");
    let y = Scale::even(-140.0, 0.0, 20.0, "");
    let panel = Panel {
        left,
        top,
        x: &x,
        y: &y,
    };
    let title = format!("{SHOWN_HZ} Hz at the DAC, 2 kHz: dB over the stimulus");
    axes(svg, &panel, &title);
    goal(svg, &panel, GOAL_DBC, &format!("goal {GOAL_DBC} dBc"));
    for (hand, colour) in [(Hand::Between, "#E69F00"), (Hand::Whole, "#0072B2")] {
        // Uniform if it was run: fewer channels, the same words.
        let shown = rows
            .iter()
            .filter(|row| row.rate_hz == 2_000 && row.hand == hand && row.spectrum.is_some())
            .min_by_key(|row| row.mode == Mode::Travelling);
        let Some(row) = shown else { continue };
        let points: Vec<_> = levels_dbc(row)
            .into_iter()
            .map(|(frequency_hz, dbc)| panel.at(frequency_hz, dbc))
            .collect();
        polyline(
            svg,
            &points,
            &format!("stroke=\"{colour}\" stroke-width=\"0.8\""),
        );
        let (words, from_right, dbc) = match hand {
            Hand::Between => ("between counts", 4.0, -52.0),
            _ => ("whole counts", 4.0, -88.0),
        };
        let (_, y) = panel.at(0.0, dbc);
        let style = format!("text-anchor=\"end\" font-size=\"10\" fill=\"{colour}\"");
        text(svg, left + Panel::WIDE - from_right, y, &style, words);
    }
}

fn spurs(svg: &mut String, (left, top): (f64, f64), rows: &[Row]) {
    let x = Scale::decades(4.0, 250.0, "stimulus, Hz");
    let y = Scale::even(-120.0, 0.0, 20.0, "");
    let panel = Panel {
        left,
        top,
        x: &x,
        y: &y,
    };
    axes(svg, &panel, "worst spur, 0–1 kHz: dB over the stimulus");
    goal(svg, &panel, GOAL_DBC, &format!("goal {GOAL_DBC} dBc"));
    for row in rows {
        if let (Some(frequency_hz), Some((dbc, _))) = (row.frequency_hz, row.spur) {
            let point = panel.at(frequency_hz, dbc);
            mark(svg, point, &look_of(row), row.hand == Hand::Between, 0.85);
        }
    }
}

fn means(svg: &mut String, (left, top): (f64, f64), rows: &[Row]) {
    let x = Scale::decades(0.4, 250.0, "stimulus, or the hand’s strokes, Hz");
    let y = Scale::decades(0.01, 10_000.0, "");
    let panel = Panel {
        left,
        top,
        x: &x,
        y: &y,
    };
    axes(svg, &panel, "mean of the worst channel, whole cycles, mV");
    goal(
        svg,
        &panel,
        GOAL_MEAN_MV,
        &format!("goal {GOAL_MEAN_MV} mV"),
    );
    // A sine's own mean over a second that is no whole number of cycles: 5 V / πf at most.
    let own: Vec<_> = (0..=60)
        .map(|step| 4.0 * (250.0f64 / 4.0).powf(f64::from(step) / 60.0))
        .map(|f| panel.at(f, 5_000.0 / (std::f64::consts::PI * f)))
        .collect();
    polyline(
        svg,
        &own,
        "stroke=\"#444444\" stroke-width=\"1.2\" stroke-dasharray=\"6 4\"",
    );
    let (words_x, words_y) = panel.at(5.2, 1_100.0);
    text(
        svg,
        words_x,
        words_y,
        "font-size=\"10\"",
        "any second: 5 V/πf of the sine itself",
    );
    for row in rows {
        let (frequency_hz, hollow) = match row.hand {
            Hand::Stroke { frequency_hz, .. } => (frequency_hz, false),
            hand => (row.frequency_hz.unwrap_or(1.0), hand == Hand::Between),
        };
        let point = panel.at(frequency_hz, row.whole_mean_mv.max(0.01));
        mark(svg, point, &look_of(row), hollow, 0.85);
    }
}
