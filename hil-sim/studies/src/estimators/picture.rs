//! The picture of a contest: a panel for each family, error over instructions, both axes logarithmic.

use std::fmt::Write;

use super::bank;
use super::family::Family;
use super::result::{ContestResult, Entry, WINDOWS, Window};
use crate::output::plot::panel::{
    AROUND, COLUMNS, Look, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes,
    goal, line, look, mark, page, text,
};

/// Above the panels, for the legend.
const HEAD: f64 = 136.0;

/// Okabe and Ito's colours, which the colour-blind tell apart; no two methods share shape and colour.
const LOOKS: [Look; 13] = [
    look("spectrum", "#0072B2", Shape::Circle),
    look("crossings", "#D55E00", Shape::Square),
    look("counting", "#000000", Shape::Up),
    // At the end of the legend's first line, where there is room for it.
    look(bank::METHOD, "#8a939c", Shape::Circle),
    look("adapted count", "#000000", Shape::Down),
    look("Goertzel", "#009E73", Shape::Diamond),
    look("FFT", "#009E73", Shape::Square),
    look("harmonic NLS", "#009E73", Shape::Up),
    look("AR(2)", "#CC79A7", Shape::Up),
    look("PLL", "#CC79A7", Shape::Down),
    look("Pei–Tseng notch", "#CC79A7", Shape::Diamond),
    look("YIN", "#B58900", Shape::Circle),
    look("McLeod", "#B58900", Shape::Diamond),
];

/// Draws it.
pub fn draw(result: &ContestResult) -> String {
    let panels = result.families.len() + 1;
    let rows = panels.div_ceil(COLUMNS);
    let height = HEAD + rows as f64 * PANEL_HEIGHT + MARGIN;
    let mut svg = page(height);
    legend(&mut svg);
    let cost = Scale::decades(700.0, 60_000.0, "instructions a ms");
    let error = Scale::decades(0.01, 300.0, "");
    let settling = Scale::even(0.0, 400.0, 100.0, "");
    for index in 0..panels {
        let (column, row) = (index % COLUMNS, index / COLUMNS);
        let left = MARGIN + column as f64 * PANEL_WIDTH + AROUND[0];
        let top = HEAD + row as f64 * PANEL_HEIGHT + AROUND[1];
        let boundary = result
            .families
            .iter()
            .position(|family| family.folder == "boundary");
        match result.families.get(index) {
            Some(family) if Some(index) == boundary => {
                let panel = Panel {
                    left,
                    top,
                    x: &cost,
                    y: &settling,
                };
                let title = format!("{}: settled within 10 %, ms", family.title);
                axes(&mut svg, &panel, &title);
                budget(&mut svg, &panel);
                for goal_ms in goals_ms(family) {
                    goal(&mut svg, &panel, goal_ms, &format!("goal {goal_ms} ms"));
                }
                marks(
                    &mut svg,
                    &panel,
                    result,
                    |entry| Some((entry.cost?.mean, entry.scores[index].settling_ms?)),
                    index,
                );
            }
            Some(family) => {
                let panel = Panel {
                    left,
                    top,
                    x: &cost,
                    y: &error,
                };
                axes(&mut svg, &panel, &format!("{}: RMS error, %", family.title));
                budget(&mut svg, &panel);
                bounds(&mut svg, &panel, family);
                if let Some(percent) = family.goal_percent() {
                    goal(&mut svg, &panel, percent, &format!("goal {percent} %"));
                }
                marks(
                    &mut svg,
                    &panel,
                    result,
                    |entry| Some((entry.cost?.mean, entry.scores[index].rms_percent?)),
                    index,
                );
            }
            None => {
                let time = Scale::even(0.0, 400.0, 100.0, "ms to settle after the boundary");
                let panel = Panel {
                    left,
                    top,
                    x: &time,
                    y: &error,
                };
                axes(&mut svg, &panel, "Table I, 20 dB: RMS error, %");
                if let Some(boundary) = boundary {
                    let place = |entry: &Entry| {
                        let settling_ms = entry.scores[boundary].settling_ms?;
                        Some((settling_ms, entry.scores[0].rms_percent?))
                    };
                    marks(&mut svg, &panel, result, place, 0);
                    travels(&mut svg, &panel, result, place);
                }
            }
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn goals_ms(family: &Family) -> Vec<f64> {
    let mut goals: Vec<f64> = family
        .scenes
        .iter()
        .filter_map(|scene| scene.expect.settling_ms)
        .collect();
    goals.sort_by(f64::total_cmp);
    goals.dedup();
    goals
}

fn legend(svg: &mut String) {
    for (index, look) in LOOKS.iter().enumerate() {
        let x = MARGIN + 14.0 + (index % 4) as f64 * 235.0;
        let y = 20.0 + (index / 4) as f64 * 20.0;
        mark(svg, (x, y - 4.0), look, estimated(look.method), 1.0);
        text(svg, x + 11.0, y, "font-size=\"13\"", look.method);
    }
    let y = 106.0;
    let mut x = MARGIN + 8.0;
    for (dash, words) in [
        (knob_dash("waves"), "spectrum: fits of 2–8 λ"),
        (knob_dash("gauges"), "1, 3, 5 gauges"),
    ] {
        let style = format!("stroke=\"#0072B2\" stroke-width=\"1.5\" stroke-dasharray=\"{dash}\"");
        line(svg, (x, y - 4.0), (x + 26.0, y - 4.0), &style);
        text(svg, x + 31.0, y, "font-size=\"12\"", words);
        x += 210.0;
    }
    text(
        svg,
        x,
        y,
        "font-size=\"12\"",
        "ring: default; hollow: cost estimated; faint: valid share below ½",
    );
    text(
        svg,
        MARGIN + 8.0,
        126.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "Down and to the left is better. Cost: ADC scans to λ, counted in the ELF on an emulated \
         Cortex-M4F. Dashed: Cramér–Rao bound over 8 λ, 80 ms and 160 ms.",
    );
}

/// The most that the default estimator may cost, in instructions a ms: 5 % of 168 MHz.
const BUDGET: f64 = 8_000.0;

fn budget(svg: &mut String, panel: &Panel<'_>) {
    let (x, bottom) = panel.at(BUDGET, panel.y.low);
    let style = format!("stroke=\"{SOFT}\" stroke-width=\"1.2\" stroke-dasharray=\"1 3\"");
    line(svg, (x, panel.top), (x, bottom), &style);
    let style = format!("font-size=\"10\" fill=\"{SOFT}\"");
    text(svg, x + 3.0, panel.top + 9.0, &style, "5 % of the M4F");
}

fn bounds(svg: &mut String, panel: &Panel<'_>, family: &Family) {
    for window in WINDOWS {
        let Some(percent) = window.bound_percent(family) else {
            continue;
        };
        let (left, y) = panel.at(panel.x.low, percent);
        let right = left + Panel::WIDE;
        let words = match window {
            Window::Waves(waves) => format!("bound, {waves} λ"),
            Window::Ms(ms) => format!("bound, {ms} ms"),
        };
        line(
            svg,
            (left, y),
            (right, y),
            "stroke=\"#444444\" stroke-width=\"1.2\" stroke-dasharray=\"6 4\"",
        );
        text(
            svg,
            right - 2.0,
            y - 3.0,
            "text-anchor=\"end\" font-size=\"10\"",
            &words,
        );
    }
}

/// Lines along the knobs, then every mark; `family` is whose valid share makes one faint.
fn marks(
    svg: &mut String,
    panel: &Panel<'_>,
    result: &ContestResult,
    place: impl Fn(&Entry) -> Option<(f64, f64)>,
    family: usize,
) {
    let at = |entry: &Entry| {
        let (x, y) = place(entry)?;
        // What takes longer than a panel shows is left out; an error beyond its edge stands at it.
        let shown = (panel.x.logarithmic || x <= panel.x.high)
            && (panel.y.logarithmic || y <= panel.y.high);
        shown.then(|| panel.at(x, y))
    };
    for pair in result.entries.windows(2) {
        let [from, to] = [&pair[0], &pair[1]];
        if (from.method, from.knob) != (to.method, to.knob) {
            continue;
        }
        if let (Some(start), Some(end), Some(look)) = (at(from), at(to), look_of(from.method)) {
            let dash = knob_dash(from.knob);
            let style = format!(
                "stroke=\"{}\" stroke-width=\"1.3\" stroke-dasharray=\"{dash}\" opacity=\"0.8\"",
                look.colour
            );
            line(svg, start, end, &style);
        }
    }
    for entry in &result.entries {
        let (Some(point), Some(look)) = (at(entry), look_of(entry.method)) else {
            continue;
        };
        if entry.is_default() {
            ring(svg, point, look);
        }
        let hollow = entry.cost.is_some_and(|cost| cost.worst.is_none());
        let rarely = entry.scores[family]
            .valid_share
            .is_some_and(|share| share < 0.5);
        mark(svg, point, look, hollow, if rarely { 0.3 } else { 1.0 });
        if entry.method == "counting" && entry.value == 80 {
            // Below if there is no room above.
            let aside = if point.1 < panel.top + 10.0 {
                14.0
            } else {
                -5.0
            };
            let style = "font-size=\"10\" font-style=\"italic\"";
            text(
                svg,
                point.0 + 6.0,
                point.1 + aside,
                style,
                "the paper’s count",
            );
        }
    }
}

/// The fits' lengths beside their marks.
fn travels(
    svg: &mut String,
    panel: &Panel<'_>,
    result: &ContestResult,
    place: impl Fn(&Entry) -> Option<(f64, f64)>,
) {
    for entry in &result.entries {
        if entry.knob == "waves"
            && let Some((x, y)) = place(entry)
            && x <= panel.x.high
        {
            let (x, y) = panel.at(x, y);
            let style = "text-anchor=\"middle\" font-size=\"10\"";
            text(svg, x, y + 19.0, style, &format!("{} λ", entry.value));
        }
    }
}

/// Around the default setting's mark.
fn ring(svg: &mut String, (x, y): (f64, f64), look: &Look) {
    let _ = writeln!(
        svg,
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>",
        look.colour
    );
}

fn look_of(method: &str) -> Option<&'static Look> {
    LOOKS.iter().find(|look| look.method == method)
}

fn estimated(method: &str) -> bool {
    matches!(method, "YIN" | "McLeod")
}

fn knob_dash(knob: &str) -> &'static str {
    match knob {
        "candidates" => "1.5 2.5",
        "gauges" => "6 3",
        _ => "none",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_of_the_contest_has_a_look() {
        for contestant in crate::estimators::contest::contestants() {
            assert!(
                look_of(contestant.method()).is_some(),
                "{}",
                contestant.method()
            );
        }
    }
}
