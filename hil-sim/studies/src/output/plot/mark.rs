//! What is drawn on a panel, in the values of its axes.

use std::ops::Range;

use super::font::Font;
use super::svg::{Point, Stroke, Symbol};
use crate::output::plot::palette::Colour;

/// Something on a panel. A point is a value of x and one of y.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    Line(Stroke, Vec<Point>),
    Segments(Stroke, Vec<(Point, Point)>),
    /// Dots without an edge, of the stroke's width.
    Dots(Stroke, Vec<Point>),
    Symbols(Symbol, Vec<Point>),
    Ring(Stroke, Point),
    /// Rectangles: stretches of x and of y.
    Bars(Colour, Vec<(Range<f64>, Range<f64>)>),
    /// Stretches of x over the whole height, behind the grid.
    Shade(Colour, Vec<Range<f64>>),
    Cells(Cells),
    /// A line across, with words on it.
    Level(f64, String),
    /// A line upright, with words at its upper end.
    Upright(Stroke, f64, String),
    /// Words at a point, so far to the right and down of it on the page. They stay within the panel.
    Words(Font, Point, Point, String),
}

/// A panel in equal cells. Where a cell has no fill there is a hatch.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    pub columns: usize,
    /// Each cell's fill by its place in `fills`: row by row, from the bottom up.
    pub cells: Vec<Option<usize>>,
    pub fills: Vec<String>,
}

impl Mark {
    pub fn line(colour: Colour, points: Vec<Point>) -> Self {
        Self::Line(Stroke::new(colour, 2.0), points)
    }

    pub fn thin(colour: Colour, points: Vec<Point>) -> Self {
        Self::Line(Stroke::new(colour, 1.0), points)
    }

    pub fn dots(colour: Colour, points: Vec<Point>) -> Self {
        Self::Dots(Stroke::new(colour, 5.0), points)
    }

    /// A disc at each point, where there are few.
    pub fn discs(colour: Colour, points: Vec<Point>) -> Self {
        Self::Dots(Stroke::new(colour, 11.0), points)
    }

    /// Upright strokes at x, from one y to another.
    pub fn strokes(colour: Colour, places: &[f64], height: Range<f64>) -> Self {
        let stroke = |&x| ((x, height.start), (x, height.end));
        let segments = places.iter().map(stroke).collect();
        Self::Segments(Stroke::new(colour, 1.5), segments)
    }

    /// A line that holds each value up to the next, within a stretch of x.
    pub fn held(stroke: Stroke, values: &[Point], shown: &Range<f64>) -> Self {
        let before = values.partition_point(|value| value.0 < shown.start);
        let until = values.partition_point(|value| value.0 <= shown.end);
        let last = values[..before].last();
        let mut line: Vec<Point> = last.map(|last| (shown.start, last.1)).into_iter().collect();
        for &(x, value) in &values[before..until] {
            line.extend(line.last().map(|last| (x, last.1)));
            line.push((x, value));
        }
        line.extend(line.last().map(|last| (shown.end, last.1)));
        Self::Line(stroke, line)
    }

    pub fn symbol(symbol: Symbol, point: Point) -> Self {
        Self::Symbols(symbol, vec![point])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::plot::palette::FIRST;

    #[test]
    fn a_held_value_is_a_step_at_the_next_one() {
        let stroke = Stroke::new(FIRST, 1.0);
        let values = [(0.0, 1.0), (2.0, 3.0), (9.0, 4.0)];
        let steps = vec![(1.0, 1.0), (2.0, 1.0), (2.0, 3.0), (5.0, 3.0)];
        let held = |values| Mark::held(stroke, values, &(1.0..5.0));
        assert_eq!(held(&values), Mark::Line(stroke, steps));
        assert_eq!(held(&[]), Mark::Line(stroke, Vec::new()));
    }
}
