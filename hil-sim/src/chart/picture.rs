//! The picture of a contest: a panel for each family, error over instructions, both axes logarithmic.
//!
//! Written as SVG by hand: its coordinates are fractions of a pixel and its marks of ten shapes, which the
//! report's charts have no use for.

use std::fmt::Write;

use super::efficiency::{GOAL, Row};
use super::result::{ContestResult, Entry, WINDOWS, Window};

const WIDTH: f64 = 1_000.0;
const COLUMNS: usize = 3;
const MARGIN: f64 = 8.0;
const HEAD: f64 = 96.0;
const PANEL_HEIGHT: f64 = 236.0;
const PANEL_WIDTH: f64 = (WIDTH - 2.0 * MARGIN) / COLUMNS as f64;
/// Around a panel's axes: left, top, right, below.
const AROUND: [f64; 4] = [40.0, 24.0, 8.0, 34.0];
const INK: &str = "#24292f";
const FAINT: &str = "#d9dde2";
const SOFT: &str = "#6a737d";

/// What a method looks like.
#[derive(Clone, Copy, Debug)]
struct Look {
    method: &'static str,
    colour: &'static str,
    shape: Shape,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Circle,
    Square,
    Up,
    Down,
    Diamond,
}

const fn look(method: &'static str, colour: &'static str, shape: Shape) -> Look {
    Look {
        method,
        colour,
        shape,
    }
}

/// Okabe and Ito's colours, which the colour-blind tell apart; no two methods share shape and colour.
const LOOKS: [Look; 10] = [
    look("bank", "#0072B2", Shape::Circle),
    look("crossings", "#D55E00", Shape::Square),
    look("counting", "#000000", Shape::Up),
    look("adapted count", "#000000", Shape::Down),
    look("Goertzel", "#009E73", Shape::Diamond),
    look("FFT", "#009E73", Shape::Square),
    look("AR(2)", "#CC79A7", Shape::Up),
    look("PLL", "#CC79A7", Shape::Down),
    look("YIN", "#B58900", Shape::Circle),
    look("McLeod", "#B58900", Shape::Diamond),
];

/// An axis.
struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
    ticks: Vec<(f64, String)>,
    label: String,
}

impl Scale {
    fn decades(low: f64, high: f64, label: &str) -> Self {
        // Where there is room, 2 and 5 are labelled too.
        let steps: &[f64] = if high / low < 1e3 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0]
        };
        let decades = low.log10().floor() as i32..=high.log10().floor() as i32;
        let ticks = decades
            .flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)))
            .filter(|tick| (low..=high * 1.001).contains(tick))
            .map(|tick| (tick, short(tick)))
            .collect();
        Self {
            low,
            high,
            logarithmic: true,
            ticks,
            label: label.to_owned(),
        }
    }

    fn even(low: f64, high: f64, step: f64, label: &str) -> Self {
        let count = ((high - low) / step).floor() as u32;
        Self {
            low,
            high,
            logarithmic: false,
            ticks: (0..=count)
                .map(|index| low + f64::from(index) * step)
                .map(|tick| (tick, short(tick)))
                .collect(),
            label: label.to_owned(),
        }
    }

    /// Where a value is on it, 0 to 1; what lies beyond is put at the end.
    fn place(&self, value: f64) -> f64 {
        let share = if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        share.clamp(0.0, 1.0)
    }
}

fn short(value: f64) -> String {
    if value >= 1_000.0 {
        format!("{}k", value / 1_000.0)
    } else {
        format!("{value}")
    }
}

/// A panel's axes on the page.
struct Panel<'a> {
    left: f64,
    top: f64,
    x: &'a Scale,
    y: &'a Scale,
}

impl Panel<'_> {
    const WIDE: f64 = PANEL_WIDTH - AROUND[0] - AROUND[2];
    const HIGH: f64 = PANEL_HEIGHT - AROUND[1] - AROUND[3];

    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + Self::WIDE * self.x.place(x),
            self.top + Self::HIGH * (1.0 - self.y.place(y)),
        )
    }
}

/// Draws it.
pub fn draw(result: &ContestResult) -> String {
    let panels = result.families.len() + 1;
    let rows = panels.div_ceil(COLUMNS);
    let height = HEAD + rows as f64 * PANEL_HEIGHT + MARGIN;
    let mut svg = page(height);
    legend(&mut svg);
    let cost = Scale::decades(700.0, 30_000.0, "instructions a ms");
    let error = Scale::decades(0.03, 300.0, "");
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

/// The bank's error over the Cramér–Rao bound, over frequency.
pub fn draw_bound(rows: &[Row]) -> String {
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

/// The beginning of a page.
fn page(height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
         viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"11\" fill=\"{INK}\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    )
}

fn goals_ms(family: &super::family::Family) -> Vec<f64> {
    let mut goals: Vec<f64> = family
        .scenes
        .iter()
        .filter_map(|scene| scene.expect.settling_ms)
        .collect();
    goals.sort_by(f64::total_cmp);
    goals.dedup();
    goals
}

fn text(svg: &mut String, x: f64, y: f64, style: &str, words: &str) {
    // A white edge keeps it legible over lines.
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" stroke=\"#ffffff\" stroke-width=\"3\" \
         paint-order=\"stroke\" {style}>{words}</text>"
    );
}

fn line(svg: &mut String, from: (f64, f64), to: (f64, f64), style: &str) {
    let _ = writeln!(
        svg,
        "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" fill=\"none\" {style}/>",
        from.0, from.1, to.0, to.1
    );
}

fn legend(svg: &mut String) {
    for (index, look) in LOOKS.iter().enumerate() {
        let x = MARGIN + 14.0 + (index % 5) as f64 * 150.0;
        let y = 20.0 + (index / 5) as f64 * 20.0;
        mark(svg, (x, y - 4.0), look, estimated(look.method), 1.0);
        text(svg, x + 11.0, y, "font-size=\"13\"", look.method);
    }
    let y = 66.0;
    let mut x = MARGIN + 8.0;
    for (dash, words) in [
        (knob_dash("travel_percent"), "bank: travel 50–150 % of λ"),
        (knob_dash("candidates"), "bank: 12–24 candidates"),
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
        86.0,
        &format!("font-size=\"12\" fill=\"{SOFT}\""),
        "Down and to the left is better. Cost: ADC scans to λ, counted in the ELF on an emulated \
         Cortex-M4F. Dashed: Cramér–Rao bound for the bank’s travel, 80 ms and 160 ms.",
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

fn axes(svg: &mut String, panel: &Panel<'_>, title: &str) {
    let (left, top) = (panel.left, panel.top);
    let (right, bottom) = (left + Panel::WIDE, top + Panel::HIGH);
    text(
        svg,
        left - 30.0,
        top - 9.0,
        "font-size=\"13\" font-weight=\"600\"",
        title,
    );
    for (value, label) in &panel.x.ticks {
        let (x, _) = panel.at(*value, panel.y.low);
        line(svg, (x, top), (x, bottom), &format!("stroke=\"{FAINT}\""));
        text(svg, x, bottom + 14.0, "text-anchor=\"middle\"", label);
    }
    for (value, label) in &panel.y.ticks {
        let (_, y) = panel.at(panel.x.low, *value);
        line(svg, (left, y), (right, y), &format!("stroke=\"{FAINT}\""));
        text(svg, left - 5.0, y + 4.0, "text-anchor=\"end\"", label);
    }
    let style = format!("text-anchor=\"middle\" fill=\"{SOFT}\"");
    text(
        svg,
        (left + right) / 2.0,
        bottom + 27.0,
        &style,
        &panel.x.label,
    );
    let _ = writeln!(
        svg,
        "<path d=\"M{left:.1} {top:.1}V{bottom:.1}H{right:.1}\" fill=\"none\" stroke=\"{SOFT}\"/>"
    );
}

fn goal(svg: &mut String, panel: &Panel<'_>, value: f64, words: &str) {
    let (left, y) = panel.at(panel.x.low, value);
    let style = format!("stroke=\"{SOFT}\" stroke-width=\"1.2\"");
    line(svg, (left, y), (left + Panel::WIDE, y), &style);
    text(
        svg,
        left + 3.0,
        y - 3.0,
        &format!("font-size=\"10\" fill=\"{SOFT}\""),
        words,
    );
}

fn bounds(svg: &mut String, panel: &Panel<'_>, family: &super::family::Family) {
    for window in WINDOWS {
        let Some(percent) = window.bound_percent(family) else {
            continue;
        };
        let (left, y) = panel.at(panel.x.low, percent);
        let right = left + Panel::WIDE;
        let words = match window {
            Window::BankTravel => "bound, travel".to_owned(),
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

/// The values of the bank's travel beside their marks.
fn travels(
    svg: &mut String,
    panel: &Panel<'_>,
    result: &ContestResult,
    place: impl Fn(&Entry) -> Option<(f64, f64)>,
) {
    for entry in &result.entries {
        if entry.knob == "travel_percent"
            && let Some((x, y)) = place(entry)
        {
            let (x, y) = panel.at(x, y);
            let style = "text-anchor=\"middle\" font-size=\"10\"";
            text(svg, x, y + 19.0, style, &format!("{} %", entry.value));
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

fn mark(svg: &mut String, (x, y): (f64, f64), look: &Look, hollow: bool, opacity: f64) {
    let shape = match look.shape {
        Shape::Circle => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\""),
        Shape::Square => polygon(x, y, &[(-3.6, -3.6), (3.6, -3.6), (3.6, 3.6), (-3.6, 3.6)]),
        Shape::Up => polygon(x, y, &[(0.0, -5.0), (4.6, 3.4), (-4.6, 3.4)]),
        Shape::Down => polygon(x, y, &[(0.0, 5.0), (4.6, -3.4), (-4.6, -3.4)]),
        Shape::Diamond => polygon(x, y, &[(0.0, -5.2), (5.2, 0.0), (0.0, 5.2), (-5.2, 0.0)]),
    };
    let (fill, stroke) = if hollow {
        ("#ffffff", look.colour)
    } else {
        (look.colour, "#ffffff")
    };
    let width = if hollow { 1.8 } else { 0.8 };
    let _ = writeln!(
        svg,
        "{shape} fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"{width}\" opacity=\"{opacity}\"/>"
    );
}

fn polygon(x: f64, y: f64, corners: &[(f64, f64)]) -> String {
    let mut points = String::new();
    for (across, down) in corners {
        let _ = write!(points, "{:.1},{:.1} ", x + across, y + down);
    }
    format!("<polygon points=\"{}\"", points.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_puts_its_ends_and_what_lies_beyond_at_0_and_1() {
        let scale = Scale::decades(0.1, 1_000.0, "");
        assert_eq!(scale.place(0.1), 0.0);
        assert_eq!(scale.place(1e9), 1.0);
        assert!((scale.place(1.0) - 0.25).abs() < 1e-12);
        let ticks: Vec<&str> = scale.ticks.iter().map(|tick| &*tick.1).collect();
        assert_eq!(ticks, ["0.1", "1", "10", "100", "1k"]);
    }

    #[test]
    fn every_method_of_the_contest_has_a_look() {
        for contestant in crate::chart::contest::contestants() {
            assert!(
                look_of(contestant.method()).is_some(),
                "{}",
                contestant.method()
            );
        }
    }
}
