//! A map's picture: for each method a row of heat maps, one for each quantity, as SVG text.

use std::fmt::Write;

use super::axis::{Axis, Scale};
use super::journal::Rows;
use super::measurement::Measurement;
use super::ramp::{LEVELS, Ramp, level};
use super::{DURATION_S, Map};

/// As wide as a README shows a picture.
const WIDTH: f64 = 1_000.0;
const RIGHT: f64 = 14.0;
const GAP: f64 = 26.0;
/// Top edge of the first row's name.
const TOP: f64 = 126.0;
/// Room for a row's name above its panels.
const NAME: f64 = 22.0;
const BELOW_ROW: f64 = 14.0;
const PANEL_HEIGHT: f64 = 190.0;
/// A named axis needs room for its words.
const NAMED_STEP: f64 = 13.0;
const INK: &str = "#242930";
const FAINT: &str = "#5c6570";

/// Something shown of every cell.
struct Quantity {
    title: &'static str,
    ramp: Ramp,
    /// In the unit of the colour bar.
    value: fn(&Measurement) -> Option<f64>,
    /// Share of the way along the ramp.
    share: fn(f64) -> f64,
    /// Labels of the colour bar.
    ticks: &'static [(f64, &'static str)],
    /// Cells above it are set off by a line.
    line: Option<f64>,
    /// Whether 0 is a case of its own, drawn white.
    white_zero: bool,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        title: "rms error of the valid estimates",
        ramp: Ramp::Ember,
        value: |measured| measured.rms_percent,
        share: |percent| decades_above(0.1, percent),
        ticks: &[(0.1, "0.1"), (1.0, "1"), (10.0, "10"), (100.0, "100 %")],
        line: Some(10.0),
        white_zero: false,
    },
    Quantity {
        title: "valid share of the time in motion",
        ramp: Ramp::Meadow,
        value: |measured| measured.valid_share.map(|share| 100.0 * share),
        share: |percent| percent / 100.0,
        ticks: &[
            (0.0, "0"),
            (25.0, "25"),
            (50.0, "50"),
            (75.0, "75"),
            (100.0, "100 %"),
        ],
        line: None,
        white_zero: false,
    },
    Quantity {
        title: "valid, yet more than 10 % off",
        ramp: Ramp::Ember,
        value: |measured| measured.wrong_share().map(|share| 100.0 * share),
        share: |percent| decades_above(0.1, percent),
        ticks: &[(0.1, "0.1"), (1.0, "1"), (10.0, "10"), (100.0, "100 %")],
        line: Some(0.1),
        white_zero: true,
    },
];

/// Thirds of three decades.
fn decades_above(least: f64, value: f64) -> f64 {
    (value / least).log10() / 3.0
}

/// Where the panels are.
struct Layout {
    left: f64,
    width: f64,
    height: f64,
}

impl Layout {
    fn new(map: &Map) -> Self {
        let named = map.y.scale == Scale::Named;
        let left = if named { 176.0 } else { 62.0 };
        Self {
            left,
            width: (WIDTH - left - RIGHT - 2.0 * GAP) / QUANTITIES.len() as f64,
            height: if named {
                NAMED_STEP * map.y.steps.len() as f64
            } else {
                PANEL_HEIGHT
            },
        }
    }

    fn x(&self, column: usize) -> f64 {
        self.left + column as f64 * (self.width + GAP)
    }

    fn y(&self, row: usize) -> f64 {
        TOP + NAME + row as f64 * (self.height + NAME + BELOW_ROW)
    }
}

/// Draws these methods' rows of a map; each must have every cell.
pub fn draw(map: &Map, methods: &[&str], rows: &Rows) -> String {
    let layout = Layout::new(map);
    let bottom = layout.y(methods.len()) - NAME - BELOW_ROW;
    let height = bottom + 84.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\" fill=\"{INK}\">\n\
         <defs><pattern id=\"silent\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">\
         <rect width=\"6\" height=\"6\" fill=\"#d4d7db\"/><rect width=\"1.5\" height=\"6\" fill=\"#9aa1a9\"/></pattern></defs>\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    );
    text(
        &mut svg,
        (14.0, 28.0),
        "start",
        "font-size=\"19\" font-weight=\"bold\"",
        map.title,
    );
    let conditions = format!(
        "{}; {DURATION_S:.0} s a cell, native engine",
        map.conditions
    );
    text(
        &mut svg,
        (14.0, 49.0),
        "start",
        &format!("font-size=\"13\" fill=\"{FAINT}\""),
        &conditions,
    );
    for (column, quantity) in QUANTITIES.iter().enumerate() {
        colour_bar(&mut svg, quantity, layout.x(column), layout.width);
    }
    for (row, method) in methods.iter().enumerate() {
        let top = layout.y(row);
        text(
            &mut svg,
            (layout.left, top - 7.0),
            "start",
            "font-size=\"14\" font-weight=\"bold\"",
            method,
        );
        y_axis(&mut svg, &map.y, &layout, top);
        for (column, quantity) in QUANTITIES.iter().enumerate() {
            let values: Vec<Option<f64>> = (0..map.len())
                .map(|cell| (quantity.value)(&rows.get(&((*method).to_owned(), cell))?.measurement))
                .collect();
            let place = (layout.x(column), top);
            panel(&mut svg, map, quantity, &values, place, &layout);
            let last = row + 1 == methods.len();
            x_axis(
                &mut svg,
                &map.x,
                place.0,
                layout.width,
                top + layout.height,
                last,
            );
        }
    }
    legend(&mut svg, layout.left, bottom + 62.0);
    svg + "</svg>\n"
}

fn text(svg: &mut String, (x, y): (f64, f64), anchor: &str, style: &str, text: &str) {
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {style}>{text}</text>"
    );
}

fn stroke(svg: &mut String, from: (f64, f64), to: (f64, f64), style: &str) {
    let _ = writeln!(
        svg,
        "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" {style}/>",
        from.0, from.1, to.0, to.1
    );
}

/// The quantity's name, its colours and their values.
fn colour_bar(svg: &mut String, quantity: &Quantity, left: f64, width: f64) {
    let (top, height) = (90.0, 11.0);
    text(
        svg,
        (left, top - 9.0),
        "start",
        "font-size=\"13\"",
        quantity.title,
    );
    let step = width / LEVELS as f64;
    for level in 0..LEVELS {
        let _ = writeln!(
            svg,
            "<rect x=\"{:.2}\" y=\"{top}\" width=\"{:.2}\" height=\"{height}\" fill=\"{}\"/>",
            left + level as f64 * step,
            // Overlapping, so that no background shines through.
            if level + 1 < LEVELS { step + 0.5 } else { step },
            quantity.ramp.colour(level)
        );
    }
    let last = quantity.ticks.len() - 1;
    for (index, (value, label)) in quantity.ticks.iter().enumerate() {
        let x = left + (quantity.share)(*value) * width;
        let anchor = match index {
            0 => "start",
            _ if index == last => "end",
            _ => "middle",
        };
        text(
            svg,
            (x, top + height + 14.0),
            anchor,
            &format!("fill=\"{FAINT}\""),
            label,
        );
        if quantity.line == Some(*value) {
            let ends = ((x, top - 3.0), (x, top + height + 3.0));
            stroke(svg, ends.0, ends.1, "stroke=\"#ffffff\" stroke-width=\"4\"");
            stroke(
                svg,
                ends.0,
                ends.1,
                &format!("stroke=\"{INK}\" stroke-width=\"1.6\""),
            );
        }
    }
}

/// The cells of one method and quantity.
fn panel(
    svg: &mut String,
    map: &Map,
    quantity: &Quantity,
    values: &[Option<f64>],
    (left, top): (f64, f64),
    layout: &Layout,
) {
    let (columns, rows) = (map.x.steps.len(), map.y.steps.len());
    let (wide, high) = (layout.width / columns as f64, layout.height / rows as f64);
    let _ = writeln!(
        svg,
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"url(#silent)\"/>",
        layout.width, layout.height
    );
    // The panel's own rows count from its upper edge.
    let shown = |column: usize, line: usize| {
        let row = match map.y.scale {
            Scale::Named => line,
            Scale::Linear | Scale::Log => rows - 1 - line,
        };
        values[map.cell(column, row)]
    };
    // One path for each colour, its cells joined along x: the file stays small.
    let mut paths = vec![String::new(); LEVELS + 1];
    for line in 0..rows {
        let mut column = 0;
        while column < columns {
            let colour = |column| shown(column, line).map(|value| shade(quantity, value));
            let from = column;
            while column < columns && colour(column) == colour(from) {
                column += 1;
            }
            if let Some(colour) = colour(from) {
                let length = column - from;
                let _ = write!(paths[colour], "M{from} {line}h{length}v1h-{length}z");
            }
        }
    }
    let _ = writeln!(
        svg,
        "<g transform=\"translate({left:.2} {top:.2}) scale({wide:.5} {high:.5})\" shape-rendering=\"crispEdges\">"
    );
    for (colour, path) in paths
        .iter()
        .enumerate()
        .filter(|(_, path)| !path.is_empty())
    {
        let fill = match colour {
            NOTHING => "#ffffff".to_owned(),
            colour => quantity.ramp.colour(colour),
        };
        let _ = writeln!(svg, "<path fill=\"{fill}\" d=\"{path}\"/>");
    }
    svg.push_str("</g>\n");
    if let Some(limit) = quantity.line {
        let border = border(columns, rows, |column, line| {
            shown(column, line).map(|value| value > limit)
        });
        for style in [
            "stroke=\"#ffffff\" stroke-width=\"2.6\"",
            "stroke=\"#242930\" stroke-width=\"1.2\"",
        ] {
            let mut path = String::new();
            for &((x0, y0), (x1, y1)) in &border {
                let at = |x: usize, y: usize| (left + x as f64 * wide, top + y as f64 * high);
                let (from, to) = (at(x0, y0), at(x1, y1));
                let _ = write!(path, "M{:.1} {:.1}L{:.1} {:.1}", from.0, from.1, to.0, to.1);
            }
            let _ = writeln!(
                svg,
                "<path fill=\"none\" stroke-linecap=\"square\" {style} d=\"{path}\"/>"
            );
        }
    }
    let mut line = 0;
    for (_, steps) in &map.y.groups {
        line += steps;
        if line < rows {
            let y = top + line as f64 * high;
            stroke(
                svg,
                (left, y),
                (left + layout.width, y),
                "stroke=\"#ffffff\" stroke-width=\"3\"",
            );
        }
    }
    let _ = writeln!(
        svg,
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"0.8\"/>",
        layout.width, layout.height
    );
}

/// The colour of what is nothing at all, behind the ramp's levels.
const NOTHING: usize = LEVELS;

fn shade(quantity: &Quantity, value: f64) -> usize {
    if value == 0.0 && quantity.white_zero {
        NOTHING
    } else {
        level((quantity.share)(value))
    }
}

type Edge = ((usize, usize), (usize, usize));

/// The edges between neighbouring cells of which one is above and the other is not.
fn border(columns: usize, rows: usize, above: impl Fn(usize, usize) -> Option<bool>) -> Vec<Edge> {
    let parts = |one: Option<bool>, other: Option<bool>| {
        one.zip(other).is_some_and(|(one, other)| one != other)
    };
    let mut edges = Vec::new();
    for line in 0..rows {
        for column in 0..columns {
            let here = above(column, line);
            if column + 1 < columns && parts(here, above(column + 1, line)) {
                edges.push(((column + 1, line), (column + 1, line + 1)));
            }
            if line + 1 < rows && parts(here, above(column, line + 1)) {
                edges.push(((column, line + 1), (column + 1, line + 1)));
            }
        }
    }
    edges
}

fn x_axis(svg: &mut String, axis: &Axis, left: f64, width: f64, y: f64, labelled: bool) {
    for (value, label) in axis.ticks() {
        let Some(along) = axis.along(value) else {
            continue;
        };
        let x = left + (along + 0.5) / axis.steps.len() as f64 * width;
        stroke(svg, (x, y), (x, y + 4.0), &format!("stroke=\"{INK}\""));
        if labelled {
            text(svg, (x, y + 17.0), "middle", "", &label);
        }
    }
    if labelled {
        text(
            svg,
            (left + width / 2.0, y + 35.0),
            "middle",
            "",
            axis.label,
        );
    }
}

fn y_axis(svg: &mut String, axis: &Axis, layout: &Layout, top: f64) {
    let (left, steps) = (layout.left, axis.steps.len() as f64);
    for (value, label) in axis.ticks() {
        let Some(along) = axis.along(value) else {
            continue;
        };
        let up = (along + 0.5) / steps;
        let (y, size) = match axis.scale {
            Scale::Named => (top + up * layout.height, 10),
            Scale::Linear | Scale::Log => (top + (1.0 - up) * layout.height, 12),
        };
        stroke(
            svg,
            (left - 4.0, y),
            (left, y),
            &format!("stroke=\"{INK}\""),
        );
        text(
            svg,
            (left - 7.0, y + 4.0),
            "end",
            &format!("font-size=\"{size}\""),
            &label,
        );
    }
    let mut line = 0;
    for (name, count) in &axis.groups {
        let middle = (line as f64 + *count as f64 / 2.0) / steps;
        text(
            svg,
            (left - 52.0, top + middle * layout.height + 4.0),
            "end",
            "",
            name,
        );
        line += count;
    }
    if axis.groups.is_empty() {
        let (x, y) = (18.0, top + layout.height / 2.0);
        let _ = writeln!(
            svg,
            "<text transform=\"translate({x} {y:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            axis.label
        );
    }
}

fn legend(svg: &mut String, left: f64, y: f64) {
    let mut x = left;
    let box_at = |svg: &mut String, x: f64, fill: &str| {
        let _ = writeln!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"20\" height=\"12\" fill=\"{fill}\" stroke=\"{INK}\" stroke-width=\"0.6\"/>",
            y - 10.0
        );
    };
    box_at(svg, x, "url(#silent)");
    text(
        svg,
        (x + 26.0, y),
        "start",
        "",
        "nothing to show: never valid, or no faster than 5 mm/s",
    );
    x += 360.0;
    box_at(svg, x, "#ffffff");
    text(svg, (x + 26.0, y), "start", "", "none wrong");
    x += 120.0;
    let ends = ((x, y - 4.0), (x + 20.0, y - 4.0));
    stroke(
        svg,
        ends.0,
        ends.1,
        &format!("stroke=\"{INK}\" stroke-width=\"1.6\""),
    );
    text(
        svg,
        (x + 26.0, y),
        "start",
        "",
        "10 % of error; 0.1 % wrong, the most allowed",
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_border_runs_between_what_is_above_and_what_is_not() {
        // Three columns, two lines: only the upper middle one is above; lower right has no value.
        let above = |column, line| match (column, line) {
            (1, 0) => Some(true),
            (2, 1) => None,
            _ => Some(false),
        };
        let edges = border(3, 2, above);
        assert_eq!(
            edges,
            [((1, 0), (1, 1)), ((2, 0), (2, 1)), ((1, 1), (2, 1)),]
        );
    }

    #[test]
    fn nothing_wrong_is_white_and_a_tenth_of_a_percent_is_not() {
        let wrong = &QUANTITIES[2];
        assert_eq!(shade(wrong, 0.0), NOTHING);
        assert_eq!(shade(wrong, 0.1), 0);
        assert_eq!(shade(wrong, 100.0), LEVELS - 1);
        // No error at all and no valid time at all are ends of their ramps.
        assert_eq!(shade(&QUANTITIES[0], 0.0), 0);
        assert_eq!(shade(&QUANTITIES[1], 0.0), 0);
    }
}
