//! The picture: a map for each integrator, clinging above, swinging below.

use std::fmt::Write;

use super::{
    BRISTLES_N_PER_M, CLINGING_STEPS_S, FINGERTIP_N_PER_M, Map, Outcome, SWINGING_STEPS_S, Test,
};
use crate::output::plot::panel::{INK, MARGIN, SOFT, Scale, WIDTH, page, polyline, text};

const HEAD: f64 = 62.0;
const COLUMNS: f64 = 4.0;
const COLUMN: f64 = (WIDTH - 2.0 * MARGIN) / COLUMNS;
const ROW: f64 = 216.0;
/// Around a map: left, top, right, below.
const AROUND: [f64; 4] = [38.0, 24.0, 8.0, 36.0];
const WIDE: f64 = COLUMN - AROUND[0] - AROUND[2];
const HIGH: f64 = ROW - AROUND[1] - AROUND[3];

fn colour(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Sound => "#cfe8d5",
        Outcome::Creeps => "#f2e2a0",
        Outcome::Chatters => "#e8935a",
        Outcome::Diverges => "#7a1f3d",
    }
}

/// Draws it.
pub fn draw(maps: &[Map]) -> String {
    let mut svg = page(HEAD + 2.0 * ROW + MARGIN);
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "Above: bristles of a stiffness; the arm rubs at 70 mm/s and stops, the fingertip should rest. \
         Below: a spring without friction; the fingertip should swing.",
    );
    let legend = [
        (Outcome::Sound, "as the equations say"),
        (Outcome::Creeps, "creeps, or its swing dies too soon"),
        (Outcome::Chatters, "chatters, or its swing grows"),
        (Outcome::Diverges, "diverges"),
    ];
    let mut x = MARGIN + 10.0;
    for (outcome, words) in legend {
        // Writing to a String cannot fail.
        let _ = writeln!(
            svg,
            "<rect x=\"{x:.1}\" y=\"32\" width=\"14\" height=\"14\" fill=\"{}\"/>",
            colour(outcome)
        );
        text(&mut svg, x + 19.0, 43.0, "font-size=\"12\"", words);
        x += 44.0 + 5.6 * words.len() as f64;
    }
    text(
        &mut svg,
        x,
        43.0,
        "font-size=\"12\"",
        "line: longest step allowed",
    );
    for map in maps {
        let column = super::integrators()
            .position(|integrator| integrator == map.integrator)
            .unwrap_or(0) as f64;
        let row = if map.test == Test::Clinging { 0.0 } else { 1.0 };
        draw_map(
            &mut svg,
            (
                MARGIN + column * COLUMN + AROUND[0],
                HEAD + row * ROW + AROUND[1],
            ),
            map,
        );
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw_map(svg: &mut String, (left, top): (f64, f64), map: &Map) {
    let (steps, stiffnesses, title) = match map.test {
        Test::Clinging => (CLINGING_STEPS_S, BRISTLES_N_PER_M, "bristles, N/m"),
        Test::Swinging => (SWINGING_STEPS_S, FINGERTIP_N_PER_M, "spring, N/m"),
    };
    let across = Scale::decades(steps.0 * 1e6, steps.1 * 1e6, "");
    let up = Scale::decades(stiffnesses.0, stiffnesses.1, "");
    text(
        svg,
        left - 30.0,
        top - 8.0,
        "font-size=\"13\" font-weight=\"600\"",
        &format!("{}: {title}", map.integrator.name()),
    );
    let high = HIGH / map.rows.len() as f64;
    for (index, row) in map.rows.iter().enumerate() {
        let wide = WIDE / row.cells.len() as f64;
        let y = top + HIGH - (index + 1) as f64 * high;
        // Cells that are alike are drawn as one.
        let mut from = 0;
        while from < row.cells.len() {
            let outcome = row.cells[from].1;
            let until = (from..row.cells.len())
                .find(|&cell| row.cells[cell].1 != outcome)
                .unwrap_or(row.cells.len());
            let _ = writeln!(
                svg,
                "<rect x=\"{:.2}\" y=\"{y:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"/>",
                left + from as f64 * wide,
                (until - from) as f64 * wide + 0.3,
                high + 0.3,
                colour(outcome),
            );
            from = until;
        }
    }
    let limit: Vec<(f64, f64)> = map
        .rows
        .iter()
        .filter(|row| (steps.0..=steps.1).contains(&row.allowed_s))
        .map(|row| {
            (
                left + WIDE * across.place(row.allowed_s * 1e6),
                top + HIGH * (1.0 - up.place(row.stiffness_n_per_m)),
            )
        })
        .collect();
    if !limit.is_empty() {
        polyline(
            svg,
            &limit,
            &format!("stroke=\"{INK}\" stroke-width=\"1.6\""),
        );
    }
    for decade in decades(steps.0 * 1e6, steps.1 * 1e6) {
        let x = left + WIDE * across.place(decade);
        text(
            svg,
            x,
            top + HIGH + 13.0,
            "text-anchor=\"middle\"",
            &format!("{decade}"),
        );
    }
    for decade in decades(stiffnesses.0, stiffnesses.1) {
        let y = top + HIGH * (1.0 - up.place(decade));
        text(
            svg,
            left - 4.0,
            y + 4.0,
            "text-anchor=\"end\"",
            &format!("10{}", superscript(decade.log10().round() as u32)),
        );
    }
    text(
        svg,
        left + WIDE / 2.0,
        top + HIGH + 26.0,
        &format!("text-anchor=\"middle\" fill=\"{SOFT}\""),
        "step, µs",
    );
}

fn decades(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (low.log10().round() as i32, high.log10().round() as i32);
    (first..=last).map(|decade| 10f64.powi(decade))
}

fn superscript(number: u32) -> char {
    ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][number as usize % 10]
}
