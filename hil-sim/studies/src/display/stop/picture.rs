//! The picture: the hand's speed above, the voltage below, from before the stop to after the start.

use super::{GOAL_MS, RESTS_S, SPEED_MM_S, Stop};
use crate::output::plot::panel::{
    AROUND, FAINT, MARGIN, SOFT, Scale, WIDTH, line, page, polyline, short, text,
};

/// What is drawn, in s from the last count.
pub const SHOWN_S: std::ops::Range<f64> = -0.06..RESTS_S + 0.12;
/// The first part, on a wider scale of time.
const CLOSE_S: std::ops::Range<f64> = -0.03..0.04;
const HEAD: f64 = 46.0;
const SPEED_HIGH: f64 = 70.0;
const VOLTS_HIGH: f64 = 190.0;
const INK: &str = "#0072B2";
const HAND: &str = "#D55E00";

/// A plot of any size: the panels have only one.
struct Plot<'a> {
    left: f64,
    top: f64,
    wide: f64,
    high: f64,
    x: &'a Scale,
    y: &'a Scale,
}

impl Plot<'_> {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + self.wide * self.x.place(x),
            self.top + self.high * (1.0 - self.y.place(y)),
        )
    }

    fn axes(&self, svg: &mut String, title: &str, named: bool) {
        let (right, bottom) = (self.left + self.wide, self.top + self.high);
        let style = "font-size=\"12\" font-weight=\"600\"";
        text(svg, self.left, self.top - 6.0, style, title);
        for (value, label) in &self.x.ticks {
            let (x, _) = self.at(*value, 0.0);
            line(
                svg,
                (x, self.top),
                (x, bottom),
                &format!("stroke=\"{FAINT}\""),
            );
            if named {
                text(svg, x, bottom + 14.0, "text-anchor=\"middle\"", label);
            }
        }
        for (value, label) in &self.y.ticks {
            let (_, y) = self.at(self.x.low, *value);
            line(
                svg,
                (self.left, y),
                (right, y),
                &format!("stroke=\"{FAINT}\""),
            );
            text(svg, self.left - 5.0, y + 4.0, "text-anchor=\"end\"", label);
        }
        if named {
            let style = format!("text-anchor=\"middle\" fill=\"{SOFT}\"");
            let middle = (self.left + right) / 2.0;
            text(svg, middle, bottom + 27.0, &style, &self.x.label);
        }
    }
}

/// Draws the first stop.
pub fn draw(stops: &[Stop]) -> String {
    let top = HEAD + 14.0;
    let below = top + SPEED_HIGH + 30.0;
    let mut svg = page(below + VOLTS_HIGH + AROUND[3] + MARGIN);
    let Some(stop) = stops.first() else {
        svg.push_str("</svg>\n");
        return svg;
    };
    let told = match stop.watched_ms {
        Some(ms) => format!("exactly 0 V {ms:.1} ms after the last encoder count"),
        None => "never at 0 V while the hand rests".to_owned(),
    };
    text(
        &mut svg,
        MARGIN + 8.0,
        20.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        &format!(
            "The hand stops dead from {SPEED_MM_S} mm/s with channel {} at a crest of {:.2} V, rests, and \
             goes on: {told}.",
            super::WATCHED,
            stop.crest_v
        ),
    );
    let gap = 56.0;
    let wide = (WIDTH - 2.0 * MARGIN - 2.0 * gap) / 2.0;
    let columns = [
        (MARGIN + 40.0, CLOSE_S, 0.01),
        (MARGIN + 40.0 + wide + gap, SHOWN_S, 0.1),
    ];
    for (left, shown, step) in columns {
        let x = milliseconds(&shown, step);
        let speed = Scale::even(0.0, 75.0, 25.0, "");
        let plot = Plot {
            left,
            top,
            wide,
            high: SPEED_HIGH,
            x: &x,
            y: &speed,
        };
        plot.axes(&mut svg, "hand, mm/s (encoder counts a tick)", false);
        plot.steps(&mut svg, &stop.speeds, &shown, HAND);
        let voltage = Scale::even(-6.0, 6.0, 2.0, "");
        let plot = Plot {
            left,
            top: below,
            wide,
            high: VOLTS_HIGH,
            x: &x,
            y: &voltage,
        };
        plot.axes(&mut svg, "voltage, V", true);
        for (at_s, words) in [(0.0, "last count"), (1e-3 * GOAL_MS, "goal 20 ms")] {
            let (x, low) = plot.at(at_s, -6.0);
            let style = format!("stroke=\"{SOFT}\" stroke-width=\"1.2\" stroke-dasharray=\"4 3\"");
            line(&mut svg, (x, below), (x, low), &style);
            if shown == CLOSE_S {
                let style = format!("font-size=\"10\" fill=\"{SOFT}\"");
                text(&mut svg, x + 3.0, below + VOLTS_HIGH - 5.0, &style, words);
            }
        }
        plot.steps(&mut svg, &stop.voltages, &shown, INK);
    }
    svg.push_str("</svg>\n");
    svg
}

impl Plot<'_> {
    /// A line that holds each value up to the next.
    fn steps(
        &self,
        svg: &mut String,
        values: &[(f64, f64)],
        shown: &std::ops::Range<f64>,
        colour: &str,
    ) {
        let mut points = Vec::new();
        let mut held = None;
        for &(t_s, value) in values {
            if t_s < shown.start {
                held = Some(value);
                continue;
            }
            if let Some(held) = held {
                points.push(self.at(t_s.min(shown.end), held));
            }
            held = Some(value);
            if t_s > shown.end {
                break;
            }
            points.push(self.at(t_s, value));
        }
        if let Some(held) = held {
            points.push(self.at(shown.end, held));
        }
        polyline(
            svg,
            &points,
            &format!("stroke=\"{colour}\" stroke-width=\"1.3\""),
        );
    }
}

/// An axis of s that is labelled in ms.
fn milliseconds(shown: &std::ops::Range<f64>, step_s: f64) -> Scale {
    let first = (shown.start / step_s).ceil() as i32;
    let last = (shown.end / step_s).floor() as i32;
    Scale {
        low: shown.start,
        high: shown.end,
        logarithmic: false,
        ticks: (first..=last)
            .map(|tick| f64::from(tick) * step_s)
            .map(|at_s| (at_s, short((at_s * 1e3).round())))
            .collect(),
        label: "ms from the last encoder count".to_owned(),
    }
}
