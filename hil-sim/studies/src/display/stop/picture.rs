//! The picture: the hand's speed above, the voltage below, from before the stop to after the start.

use std::ops::Range;

use super::{GOAL_MS, RESTS_S, SPEED_MM_S, Stop, WATCHED};
use crate::output::plot::axis::short;
use crate::output::plot::palette::{BLUE, SOFT, VERMILION};
use crate::output::plot::{Axis, Mark, Page, Panel, Stroke};

/// What is drawn, in s from the last count.
pub const SHOWN_S: Range<f64> = -0.06..RESTS_S + 0.12;
/// The first part, on a wider scale of time.
const CLOSE_S: Range<f64> = -0.03..0.04;
const INSTANT: Stroke = Stroke::new(SOFT, 1.2).dashed("4 3");

/// Draws the first stop.
pub fn draw(stops: &[Stop]) -> String {
    let mut page = Page::default();
    let Some(stop) = stops.first() else {
        return page.finish();
    };
    let told = match stop.watched_ms {
        Some(ms) => format!("exactly 0 V {ms:.1} ms after the last encoder count"),
        None => "never at 0 V while the hand rests".to_owned(),
    };
    page.note(&format!(
        "The hand stops dead from {SPEED_MM_S} mm/s with channel {WATCHED} at a crest of {:.2} V, rests, and \
         goes on: {told}.",
        stop.crest_v
    ));
    let times = [(CLOSE_S, 0.01), (SHOWN_S, 0.1)].map(|(shown, step)| milliseconds(&shown, step));
    let speed = Axis::even(0.0, 75.0, 25.0, "");
    let voltage = Axis::even(-6.0, 6.0, 2.0, "");
    let line = |values: &[(f64, f64)], time: &Axis, colour| {
        Mark::held(Stroke::new(colour, 1.3), values, &(time.low..time.high))
    };
    let hand = times.each_ref().map(|time| {
        let title = "hand, mm/s (encoder counts a tick)";
        Panel::new(title, &time.wordless(), &speed).with([line(&stop.speeds, time, VERMILION)])
    });
    let volts = times.each_ref().map(|time| {
        // Where time is short, there is no room for words.
        let words = |words: &str| if time.high == CLOSE_S.end { words } else { "" }.to_owned();
        Panel::new("voltage, V", time, &voltage).with([
            Mark::Upright(INSTANT, 0.0, words("last count")),
            Mark::Upright(INSTANT, 1e-3 * GOAL_MS, words("goal 20 ms")),
            line(&stop.voltages, time, BLUE),
        ])
    });
    page.panels(2, &[70.0, 190.0], &[hand, volts].concat());
    page.finish()
}

fn milliseconds(shown: &Range<f64>, step_s: f64) -> Axis {
    let first = (shown.start / step_s).ceil() as i32;
    let last = (shown.end / step_s).floor() as i32;
    let ticks = (first..=last)
        .map(|tick| f64::from(tick) * step_s)
        .map(|at_s| (at_s, short((at_s * 1e3).round())));
    Axis::named(
        "ms from the last encoder count",
        shown.clone(),
        ticks.collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn the_texts_stay_within_the_picture() {
        let stop = |watched_ms| Stop {
            rate_hz: 2_000,
            mode: protocol::Mode::Uniform,
            crest_v: 4.97,
            watched_ms,
            all_ms: watched_ms,
            starts_ms: None,
            largest_step_v: 0.1,
            natural_step_v: 0.1,
            speeds: vec![(SHOWN_S.start, SPEED_MM_S), (0.0, 0.0)],
            voltages: vec![(SHOWN_S.start, 5.0), (0.01, 0.0)],
        };
        for watched_ms in [None, Some(14.5)] {
            crate::output::plot::tests::assert_fits("stop", &draw(&[stop(watched_ms)]));
        }
    }
}
