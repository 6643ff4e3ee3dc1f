//! The picture: the reliability diagram, and what a level of confidence gives and costs.

use super::{BINS, Level, Reliability};
use crate::output::plot::palette::{BLUE, GREEN, GREY, SOFT, VERMILION};
use crate::output::plot::{
    Anchor, Axis, Font, Key, Mark, PANEL_HEIGHT, Page, Panel, Shape, Stroke, Symbol,
};
use crate::study::number;

const SHARE: Symbol = Symbol::new(BLUE, Shape::Circle);
const RIGHT: Stroke = Stroke::new(GREEN, 2.0);
const SILENT: Stroke = Stroke::new(GREY, 2.0);
const WRONG: Stroke = Stroke::new(VERMILION, 2.0);
const PLAIN: Stroke = Stroke::new(BLUE, 2.0);
const DEFAULT: Stroke = Stroke::new(SOFT, 1.2).dashed("1 3");
/// What may be wrong of a surface with a period, and stood by on one without.
const GOALS: [(f64, &str); 2] = [(0.2, "0.2 %"), (0.1, "0.1 %")];
/// The least share of estimates that is shown as wrong, in percent.
const LEAST_PERCENT: f64 = 0.01;

/// Draws it, with a line at the level in percent that is the default.
pub fn draw(reliability: &Reliability, default: u8) -> String {
    let mut page = Page::default();
    page.title(&format!(
        "{} surfaces drawn by strangers; expected calibration error {}{}, goal 0.05",
        reliability.surfaces,
        number(reliability.error, 3),
        reliability.told_interval(),
    ));
    page.note("Bars: 95 %, surfaces drawn anew. Numbers below: a bin’s share of the estimates, %.");
    page.legend(&[
        (Key::Line(RIGHT), "within 5 %"),
        (Key::Line(SILENT), "silent"),
        (Key::Line(WRONG), "with a period: more than 10 % off"),
        (Key::Line(PLAIN), "without a period: any λ"),
        (Key::Line(DEFAULT), "the default level"),
    ]);
    let share = Axis::even(0.0, 1.0, 0.2, "");
    let percent = Axis::decades(LEAST_PERCENT, 100.0, "");
    let said = Axis::even(0.0, 1.0, 0.2, "confidence");
    let level = Axis::even(0.0, 1.0, 0.2, "confidence from which on λ is stood by");
    let default = || Mark::Upright(DEFAULT, f64::from(default) / 100.0, String::new());
    let curve = |stroke, value: fn(&Level) -> f64| {
        let levels = reliability.levels.iter();
        let points = levels.map(|level| (f64::from(level.percent) / 100.0, value(level)));
        Mark::Line(stroke, points.collect())
    };
    let panels = [
        Panel::new("share within 5 % of the truth", &said, &share).with(bars(reliability)),
        Panel::new("with a period: share of estimates", &level, &share).with([
            default(),
            curve(RIGHT, |level| level.right),
            curve(SILENT, |level| level.silent),
        ]),
        Panel::new("stood by and wrong, %", &level, &percent)
            .with(GOALS.map(|(value, words)| Mark::Level(value, words.to_owned())))
            .with([
                default(),
                // Nothing stands at the lower edge of a logarithmic axis.
                curve(WRONG, |level| (100.0 * level.wrong).max(LEAST_PERCENT)),
                curve(PLAIN, |level| (100.0 * level.plain).max(LEAST_PERCENT)),
            ]),
    ];
    page.panels(3, &[PANEL_HEIGHT], &panels);
    page.finish()
}

fn bars(reliability: &Reliability) -> Vec<Mark> {
    let diagonal = Stroke::new(SOFT, 1.2).dashed("6 4");
    let mut marks = vec![Mark::Line(diagonal, vec![(0.0, 0.0), (1.0, 1.0)])];
    let estimates = reliability.bars.iter().map(|(bin, _)| bin.estimates);
    let all: f64 = estimates.map(f64::from).sum();
    for (index, (bin, interval)) in reliability.bars.iter().enumerate() {
        let Some((confidence, share)) = bin.means() else {
            continue;
        };
        if let Some(interval) = interval {
            let ends = ((confidence, interval.low), (confidence, interval.high));
            marks.push(Mark::Segments(Stroke::new(BLUE, 1.5), vec![ends]));
        }
        marks.push(Mark::symbol(SHARE, (confidence, share)));
        let part = 100.0 * f64::from(bin.estimates) / all;
        let words = number(part, if part < 9.95 { 1 } else { 0 });
        let middle = ((index as f64 + 0.5) / BINS as f64, 0.0);
        let font = Font::new(9.0).at(Anchor::Middle);
        marks.push(Mark::Words(font, middle, (0.0, -3.0), words));
    }
    marks
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
        crate::output::plot::tests::assert_fits("confidence", &svg);
    }
}
