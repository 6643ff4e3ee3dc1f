//! One chart: axes with units, and marks on them, as SVG text.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::output::plot::palette::{Colour, GRID, INK};

/// Size of the drawing area. Coordinates are whole, so it is drawn large and shown smaller.
const WIDTH: u32 = 2_000;
const FONT: u32 = 33;

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The quantity and its unit.
    pub label: &'static str,
    /// What it spans; a span of nothing is widened.
    pub range: Range<f64>,
    /// Values with a label, other than the round ones.
    pub named: Option<Vec<(f64, String)>>,
}

/// Something on a chart.
#[derive(Clone, Debug)]
pub enum Mark {
    /// A line through points.
    Line(Colour, Vec<(f64, f64)>),
    /// A thinner line through points.
    Thin(Colour, Vec<(f64, f64)>),
    /// A dot at each point.
    Dots(Colour, Vec<(f64, f64)>),
    /// A disc at each point, where there are few.
    Discs(Colour, Vec<(f64, f64)>),
    /// Upright strokes at x, from one y to another.
    Strokes(Colour, Vec<f64>, Range<f64>),
    /// Rectangles: stretches of x, each from one y to another.
    Bars(Colour, Vec<(Range<f64>, Range<f64>)>),
    /// Stretches of x over the whole height.
    Shade(Colour, Vec<Range<f64>>),
}

impl Axis {
    /// An axis with round labels.
    pub fn new(label: &'static str, range: Range<f64>) -> Self {
        let finite = range.start.is_finite() && range.end.is_finite();
        let range = match range {
            _ if !finite => 0.0..1.0,
            range if range.end > range.start => range,
            range => range.start - 0.5..range.start + 0.5,
        };
        Self {
            label,
            range,
            named: None,
        }
    }

    /// The labelled values.
    fn ticks(&self) -> Vec<(f64, String)> {
        self.named
            .clone()
            .unwrap_or_else(|| round_ticks(&self.range))
    }
}

/// Draws a chart of a height (of 2 000 wide) as one SVG element. The error is plotters' text.
pub fn draw(height: u32, x: &Axis, y: &Axis, marks: &[Mark]) -> Result<String, String> {
    draw_at((WIDTH, height), x, y, marks)
}

/// The same of a width and a height. What is shown narrower than 2 000 is drawn narrower, for its text to
/// stay as large.
pub fn draw_at(size: (u32, u32), x: &Axis, y: &Axis, marks: &[Mark]) -> Result<String, String> {
    let mut svg = String::new();
    draw_into(&mut svg, size, x, y, marks).map_err(|error| error.to_string())?;
    Ok(svg)
}

type DrawingError = Box<dyn std::error::Error>;

fn draw_into(
    svg: &mut String,
    size: (u32, u32),
    x: &Axis,
    y: &Axis,
    marks: &[Mark],
) -> Result<(), DrawingError> {
    let area = SVGBackend::with_string(svg, size).into_drawing_area();
    let (x_ticks, y_ticks) = (x.ticks(), y.ticks());
    let text = ("sans-serif", FONT).into_font().color(&INK.drawn());
    let mut chart = ChartBuilder::on(&area)
        .margin(FONT / 2)
        .margin_right(FONT * 2)
        .x_label_area_size(FONT * 5 / 2)
        .y_label_area_size(FONT * 4)
        .build_cartesian_2d(Labelled::new(x, &x_ticks), Labelled::new(y, &y_ticks))?;
    // Shades lie below the grid, everything else above it.
    for mark in marks {
        if let Mark::Shade(colour, stretches) = mark {
            chart.draw_series(stretches.iter().map(|stretch| {
                let corners = [(stretch.start, y.range.start), (stretch.end, y.range.end)];
                Rectangle::new(corners, colour.drawn().filled())
            }))?;
        }
    }
    let name = |ticks: &[(f64, String)], value: f64| {
        let nearest = ticks
            .iter()
            .min_by(|one, other| (one.0 - value).abs().total_cmp(&(other.0 - value).abs()));
        nearest.map(|tick| tick.1.clone()).unwrap_or_default()
    };
    chart
        .configure_mesh()
        .x_desc(x.label)
        .y_desc(y.label)
        .x_labels(x_ticks.len())
        .y_labels(y_ticks.len())
        .x_label_formatter(&|value| name(&x_ticks, *value))
        .y_label_formatter(&|value| name(&y_ticks, *value))
        .label_style(text.clone())
        .axis_desc_style(text.pos(Pos::new(HPos::Center, VPos::Top)))
        .axis_style(INK.drawn())
        .bold_line_style(GRID.drawn().stroke_width(2))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for mark in marks {
        match mark {
            Mark::Line(colour, points) => {
                let style = colour.drawn().stroke_width(4);
                chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
            }
            Mark::Thin(colour, points) => {
                let style = colour.drawn().stroke_width(2);
                chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
            }
            Mark::Bars(colour, bars) => {
                let style = colour.drawn().filled();
                chart
                    .draw_series(bars.iter().map(|(x, y)| {
                        Rectangle::new([(x.start, y.start), (x.end, y.end)], style)
                    }))?;
            }
            Mark::Dots(colour, points) => {
                let style = colour.drawn().filled();
                let dots = points.iter().map(|&point| Circle::new(point, 5, style));
                chart.draw_series(dots)?;
            }
            Mark::Discs(colour, points) => {
                let style = colour.drawn().filled();
                let discs = points.iter().map(|&point| Circle::new(point, 11, style));
                chart.draw_series(discs)?;
            }
            Mark::Strokes(colour, places, height) => {
                let style = colour.drawn().stroke_width(3);
                chart.draw_series(places.iter().map(|&place| {
                    PathElement::new([(place, height.start), (place, height.end)], style)
                }))?;
            }
            Mark::Shade(..) => {}
        }
    }
    drop(chart);
    area.present()?;
    Ok(())
}

/// A coordinate that labels its axis' values and no others.
struct Labelled {
    coordinate: RangedCoordf64,
    values: Vec<f64>,
}

impl Labelled {
    fn new(axis: &Axis, ticks: &[(f64, String)]) -> Self {
        Self {
            coordinate: axis.range.clone().into(),
            values: ticks.iter().map(|tick| tick.0).collect(),
        }
    }
}

impl Ranged for Labelled {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.coordinate.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            Vec::new()
        } else {
            self.values.clone()
        }
    }

    fn range(&self) -> Range<f64> {
        self.coordinate.range()
    }
}

/// Three to nine round values in a range, with their text.
fn round_ticks(range: &Range<f64>) -> Vec<(f64, String)> {
    let least = (range.end - range.start) / 8.0;
    let decade = 10f64.powf(least.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].map(|round| round * decade);
    let step = round
        .into_iter()
        .find(|step| *step >= least)
        .unwrap_or(least);
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let first = (range.start / step - 1e-9).ceil();
    let last = (range.end / step + 1e-9).floor();
    (0..=(last - first).clamp(0.0, 20.0) as u32)
        .map(|index| (first + f64::from(index)) * step)
        // Adding 0 takes the sign off −0.
        .map(|value| {
            (
                value,
                format!("{:.decimals$}", value + 0.0).replace('-', "−"),
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::plot::palette::FIRST;

    fn texts(range: Range<f64>) -> Vec<String> {
        round_ticks(&range).into_iter().map(|tick| tick.1).collect()
    }

    #[test]
    fn labels_are_round_and_within_the_range() {
        assert_eq!(
            texts(0.0..3.0),
            ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]
        );
        assert_eq!(
            texts(-70.0..70.0),
            ["−60", "−40", "−20", "0", "20", "40", "60"]
        );
        assert_eq!(texts(1.40..1.60), ["1.40", "1.45", "1.50", "1.55", "1.60"]);
    }

    #[test]
    fn a_chart_is_one_svg_with_its_labels_as_text() {
        let x = Axis::new("time in s", 0.0..1.0);
        let y = Axis::new("height in mm", 0.0..2.0);
        let svg = draw(
            500,
            &x,
            &y,
            &[Mark::Line(FIRST, vec![(0.0, 0.0), (1.0, 2.0)])],
        )
        .unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("time in s") && svg.contains("height in mm"));
        assert!(svg.contains("<polyline") && svg.contains("stroke=\"#1F6FC9\""));
    }

    #[test]
    fn a_range_of_nothing_is_drawn_all_the_same() {
        for range in [
            0.0..0.0,
            5.0..5.0,
            1.0..0.0,
            f64::NAN..1.0,
            0.0..f64::INFINITY,
        ] {
            let axis = Axis::new("", range);
            assert!(draw(500, &axis, &axis, &[Mark::Dots(FIRST, vec![(0.0, 0.0)])]).is_ok());
        }
    }
}
