//! A panel of a picture: axes, even or logarithmic, and marks on them, as SVG text.
//!
//! By hand, since its coordinates are fractions of a pixel and its marks of five shapes, full or hollow: the
//! report's charts know neither.

use std::fmt::Write;

pub(crate) const WIDTH: f64 = 1_000.0;
pub(crate) const COLUMNS: usize = 3;
pub(crate) const MARGIN: f64 = 8.0;
pub(crate) const PANEL_HEIGHT: f64 = 236.0;
pub(crate) const PANEL_WIDTH: f64 = (WIDTH - 2.0 * MARGIN) / COLUMNS as f64;
/// Around a panel's axes: left, top, right, below.
pub(crate) const AROUND: [f64; 4] = [40.0, 24.0, 8.0, 34.0];
pub(crate) const INK: &str = "#24292f";
pub(crate) const FAINT: &str = "#d9dde2";
pub(crate) const SOFT: &str = "#6a737d";

/// What a method looks like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) method: &'static str,
    pub(crate) colour: &'static str,
    pub(crate) shape: Shape,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Circle,
    Square,
    Up,
    Down,
    Diamond,
}

pub(crate) const fn look(method: &'static str, colour: &'static str, shape: Shape) -> Look {
    Look {
        method,
        colour,
        shape,
    }
}

/// An axis.
pub(crate) struct Scale {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) logarithmic: bool,
    pub(crate) ticks: Vec<(f64, String)>,
    pub(crate) label: String,
}

impl Scale {
    pub(crate) fn decades(low: f64, high: f64, label: &str) -> Self {
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

    pub(crate) fn even(low: f64, high: f64, step: f64, label: &str) -> Self {
        let count = ((high - low) / step + 1e-9).floor() as u32;
        Self {
            low,
            high,
            logarithmic: false,
            ticks: (0..=count)
                // To a billionth: a sum of tenths is not to show what binary makes of them.
                .map(|index| ((low + f64::from(index) * step) * 1e9).round() / 1e9)
                .map(|tick| (tick, short(tick)))
                .collect(),
            label: label.to_owned(),
        }
    }

    /// Where a value is on it, 0 to 1; what lies beyond is put at the end.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let share = if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        share.clamp(0.0, 1.0)
    }
}

pub(crate) fn short(value: f64) -> String {
    if value >= 1_000.0 {
        format!("{}k", value / 1_000.0)
    } else {
        format!("{value}")
    }
}

/// A panel's axes on the page.
pub(crate) struct Panel<'a> {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) x: &'a Scale,
    pub(crate) y: &'a Scale,
}

impl Panel<'_> {
    pub(crate) const WIDE: f64 = PANEL_WIDTH - AROUND[0] - AROUND[2];
    pub(crate) const HIGH: f64 = PANEL_HEIGHT - AROUND[1] - AROUND[3];

    pub(crate) fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + Self::WIDE * self.x.place(x),
            self.top + Self::HIGH * (1.0 - self.y.place(y)),
        )
    }
}

/// The beginning of a page.
pub(crate) fn page(height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
         viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" font-size=\"11\" fill=\"{INK}\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    )
}

pub(crate) fn text(svg: &mut String, x: f64, y: f64, style: &str, words: &str) {
    // A white edge keeps it legible over lines.
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" stroke=\"#ffffff\" stroke-width=\"3\" \
         paint-order=\"stroke\" {style}>{words}</text>"
    );
}

pub(crate) fn line(svg: &mut String, from: (f64, f64), to: (f64, f64), style: &str) {
    let _ = writeln!(
        svg,
        "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" fill=\"none\" {style}/>",
        from.0, from.1, to.0, to.1
    );
}

/// A line through points on the page.
pub(crate) fn polyline(svg: &mut String, points: &[(f64, f64)], style: &str) {
    let mut path = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
    }
    let _ = writeln!(
        svg,
        "<path d=\"{path}\" fill=\"none\" stroke-linejoin=\"round\" {style}/>"
    );
}

pub(crate) fn axes(svg: &mut String, panel: &Panel<'_>, title: &str) {
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

pub(crate) fn goal(svg: &mut String, panel: &Panel<'_>, value: f64, words: &str) {
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

pub(crate) fn mark(svg: &mut String, (x, y): (f64, f64), look: &Look, hollow: bool, opacity: f64) {
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

pub(crate) fn polygon(x: f64, y: f64, corners: &[(f64, f64)]) -> String {
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
}
