//! The picture: the reliability diagram, and what a level of confidence gives and costs.

use super::{BINS, Level, Reliability};
use crate::output::plot::panel::{
    AROUND, INK, MARGIN, PANEL_HEIGHT, PANEL_WIDTH, Panel, SOFT, Scale, Shape, axes, goal, line,
    look, mark, page, polyline, text,
};

const RIGHT: &str = "#009E73";
const WRONG: &str = "#D55E00";
const SILENT: &str = "#8a939c";
const PLAIN: &str = "#0072B2";
const HEAD: f64 = 52.0;
/// What may be wrong of a surface with a period, and stood by on one without.
const GOALS: [(f64, &str); 2] = [(0.2, "0.2 %"), (0.1, "0.1 %")];

/// Draws it, with a line at the level in percent that is the default.
pub fn draw(reliability: &Reliability, default: u8) -> String {
    let mut svg = page(HEAD + PANEL_HEIGHT + MARGIN);
    let soft = format!("font-size=\"12\" fill=\"{SOFT}\"");
    let error = reliability
        .error
        .map_or("–".to_owned(), |error| format!("{error:.3}"));
    let interval = reliability
        .error_interval
        .map_or(String::new(), |interval| {
            format!(" ({:.3}–{:.3})", interval.low, interval.high)
        });
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        "font-size=\"13\"",
        &format!(
            "{} surfaces drawn by strangers; expected calibration error {error}{interval}, goal 0.05",
            reliability.surfaces
        ),
    );
    text(
        &mut svg,
        MARGIN + 8.0,
        38.0,
        &soft,
        "Bars: 95 %, surfaces drawn anew. Numbers below: a bin’s share of the estimates, %. Dotted: the default level.",
    );
    let share = Scale::even(0.0, 1.0, 0.2, "");
    let percent = Scale::decades(0.01, 100.0, "confidence from which on λ is stood by");
    let said = Scale::even(0.0, 1.0, 0.2, "confidence");
    let level = Scale::even(0.0, 1.0, 0.2, "confidence from which on λ is stood by");
    let panel = |column: usize| {
        (
            MARGIN + column as f64 * PANEL_WIDTH + AROUND[0],
            HEAD + AROUND[1],
        )
    };

    let (left, top) = panel(0);
    let diagram = Panel {
        left,
        top,
        x: &said,
        y: &share,
    };
    axes(&mut svg, &diagram, "share within 5 % of the truth");
    bars(&mut svg, &diagram, reliability);

    let (left, top) = panel(1);
    let right = Panel {
        left,
        top,
        x: &level,
        y: &share,
    };
    axes(&mut svg, &right, "with a period: share of estimates");
    dotted(&mut svg, &right, default);
    curve(&mut svg, &right, reliability, RIGHT, |level| level.right);
    curve(&mut svg, &right, reliability, SILENT, |level| level.silent);
    key(&mut svg, &right, 0.52, RIGHT, "within 5 %");
    key(&mut svg, &right, 0.44, SILENT, "silent");

    let (left, top) = panel(2);
    let wrong = Panel {
        left,
        top,
        x: &level,
        y: &percent,
    };
    axes(&mut svg, &wrong, "stood by and wrong, %");
    for (value, words) in GOALS {
        goal(&mut svg, &wrong, value, words);
    }
    dotted(&mut svg, &wrong, default);
    curve(&mut svg, &wrong, reliability, WRONG, |level| {
        100.0 * level.wrong
    });
    curve(&mut svg, &wrong, reliability, PLAIN, |level| {
        100.0 * level.plain
    });
    key(
        &mut svg,
        &wrong,
        0.14,
        WRONG,
        "with a period: more than 10 % off",
    );
    key(&mut svg, &wrong, 0.06, PLAIN, "without a period: any λ");
    svg.push_str("</svg>\n");
    svg
}

fn bars(svg: &mut String, panel: &Panel<'_>, reliability: &Reliability) {
    let diagonal = format!("stroke=\"{SOFT}\" stroke-width=\"1.2\" stroke-dasharray=\"6 4\"");
    line(svg, panel.at(0.0, 0.0), panel.at(1.0, 1.0), &diagonal);
    let all: f64 = reliability
        .bars
        .iter()
        .map(|bar| f64::from(bar.bin.estimates))
        .sum();
    let look = look("", PLAIN, Shape::Circle);
    for (index, bar) in reliability.bars.iter().enumerate() {
        let Some((confidence, share)) = bar.bin.means() else {
            continue;
        };
        if let Some(interval) = bar.interval {
            let style = format!("stroke=\"{PLAIN}\" stroke-width=\"1.5\"");
            let ends = [interval.low, interval.high].map(|end| panel.at(confidence, end));
            line(svg, ends[0], ends[1], &style);
        }
        mark(svg, panel.at(confidence, share), &look, false, 1.0);
        let (x, y) = panel.at((index as f64 + 0.5) / BINS as f64, 0.0);
        let part = 100.0 * f64::from(bar.bin.estimates) / all;
        let words = if part < 9.95 {
            format!("{part:.1}")
        } else {
            format!("{part:.0}")
        };
        let style = format!("text-anchor=\"middle\" font-size=\"9\" fill=\"{INK}\"");
        text(svg, x, y - 3.0, &style, &words);
    }
}

fn curve(
    svg: &mut String,
    panel: &Panel<'_>,
    reliability: &Reliability,
    colour: &str,
    value: impl Fn(&Level) -> f64,
) {
    let points: Vec<(f64, f64)> = reliability
        .levels
        .iter()
        .map(|level| {
            // Nothing stands at the lower edge of a logarithmic axis.
            let value = value(level).max(if panel.y.logarithmic {
                panel.y.low
            } else {
                0.0
            });
            panel.at(f64::from(level.percent) / 100.0, value)
        })
        .collect();
    polyline(
        svg,
        &points,
        &format!("stroke=\"{colour}\" stroke-width=\"2\""),
    );
}

fn dotted(svg: &mut String, panel: &Panel<'_>, default: u8) {
    let (x, bottom) = panel.at(f64::from(default) / 100.0, panel.y.low);
    let style = format!("stroke=\"{SOFT}\" stroke-width=\"1.2\" stroke-dasharray=\"1 3\"");
    line(svg, (x, panel.top), (x, bottom), &style);
}

/// What a colour is, a share of the panel's height up.
fn key(svg: &mut String, panel: &Panel<'_>, up: f64, colour: &str, words: &str) {
    let (x, y) = (panel.left + 10.0, panel.top + Panel::HIGH * (1.0 - up));
    let style = format!("stroke=\"{colour}\" stroke-width=\"2\"");
    line(svg, (x, y - 4.0), (x + 18.0, y - 4.0), &style);
    text(svg, x + 23.0, y, "font-size=\"10\"", words);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimators::confidence::Tally;

    #[test]
    fn each_bin_that_holds_estimates_has_a_mark() {
        let mut tally = Tally::new("ridges", true);
        for confidence in [0.05, 0.55, 0.58, 0.95] {
            tally.heard(confidence, 0.0);
            tally.judged(Some((confidence, 0.0)));
        }
        let svg = draw(&Reliability::of(&[tally]), 90);
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(roxmltree::Document::parse(&svg).is_ok());
    }
}
