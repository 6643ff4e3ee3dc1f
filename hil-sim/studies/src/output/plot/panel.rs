//! A panel: a title, two axes, and marks between them.

use std::fmt::Write;
use std::ops::Range;

use super::axis::Axis;
use super::font::{Anchor, Font};
use super::mark::{Cells, Mark};
use super::svg::{Frame, HATCH, Point, Stroke, Svg};
use crate::output::plot::palette::{Colour, GRID, INK, SOFT};

/// How far to the left of its frame a title begins, and a label of x may.
const OUTDENT: f64 = 8.0;

#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What is shown, above it; nothing if a heading says it.
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub marks: Vec<Mark>,
}

/// The room that a panel's words take around its axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Room {
    pub left: f64,
    pub above: f64,
    pub right: f64,
    pub below: f64,
}

impl Room {
    pub fn max(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            above: self.above.max(other.above),
            right: self.right.max(other.right),
            below: self.below.max(other.below),
        }
    }
}

impl Panel {
    pub fn new(title: impl Into<String>, x: &Axis, y: &Axis) -> Self {
        Self {
            title: title.into(),
            x: x.clone(),
            y: y.clone(),
            marks: Vec::new(),
        }
    }

    pub fn with(mut self, marks: impl IntoIterator<Item = Mark>) -> Self {
        self.marks.extend(marks);
        self
    }

    /// The room that its words of a size need around a frame of a width; the width matters only above and below.
    pub fn room(&self, size: f64, wide: f64) -> Room {
        let upwards = if self.y.label.is_empty() {
            0.0
        } else {
            1.6 * size
        };
        let labelled = self.x.ticks.iter().any(|tick| !tick.1.is_empty());
        let x_lines = f64::from(u8::from(labelled)) + self.x_label(size, wide).len() as f64;
        Room {
            left: self.labels(size) + 0.8 * size + widest(&self.y.groups, size) + upwards,
            above: 1.3 * title_font(size).size * self.titled(size, wide).len() as f64 + 0.7 * size,
            // At most half of a label stands out, if it stands at the end.
            right: 0.5 * widest(&self.x.ticks, size) + 0.2 * size,
            below: 1.25 * size * x_lines + 0.5 * size,
        }
    }

    /// The room for labels of y, and what sets them off from names of several.
    fn labels(&self, size: f64) -> f64 {
        let gap = if self.y.groups.is_empty() { 0.0 } else { size };
        widest(&self.y.ticks, size) + gap
    }

    fn titled(&self, size: f64, wide: f64) -> Vec<String> {
        title_font(size).wrap(&self.title, wide + OUTDENT)
    }

    fn x_label(&self, size: f64, wide: f64) -> Vec<String> {
        Font::new(size).wrap(&self.x.label, wide + 2.0 * OUTDENT)
    }

    /// Draws it with its axes in a frame, words of a size around them in a room.
    pub fn draw(&self, svg: &mut Svg, frame: &Frame, room: &Room, size: f64) {
        let on_page = OnPage {
            panel: self,
            frame,
            size,
        };
        let mut baseline = frame.top - 0.7 * size;
        for line in self.titled(size, frame.wide).iter().rev() {
            svg.text((frame.left - OUTDENT, baseline), &title_font(size), line);
            baseline -= 1.3 * title_font(size).size;
        }
        let in_cells = self.marks.iter().any(|mark| matches!(mark, Mark::Cells(_)));
        let is_behind = |mark: &&Mark| matches!(mark, Mark::Shade(..));
        let (behind, before): (Vec<&Mark>, Vec<&Mark>) = self.marks.iter().partition(is_behind);
        for mark in behind {
            on_page.mark(svg, mark);
        }
        if !in_cells {
            on_page.grid(svg);
        }
        for mark in before {
            on_page.mark(svg, mark);
        }
        on_page.axes(svg, room, in_cells);
    }
}

fn widest(labels: &[(f64, String)], size: f64) -> f64 {
    let font = Font::new(size);
    let widths = labels.iter().map(|label| font.width(&label.1));
    widths.fold(0.0, f64::max)
}

fn title_font(size: f64) -> Font {
    Font::new(size + 1.0).bold()
}

struct OnPage<'a> {
    panel: &'a Panel,
    frame: &'a Frame,
    size: f64,
}

impl OnPage<'_> {
    fn x(&self, value: f64) -> f64 {
        self.frame.left + self.frame.wide * self.panel.x.place(value)
    }

    fn y(&self, value: f64) -> f64 {
        self.frame.top + self.frame.high * (1.0 - self.panel.y.place(value))
    }

    fn at(&self, (x, y): Point) -> Point {
        (self.x(x), self.y(y))
    }

    fn points(&self, points: &[Point]) -> Vec<Point> {
        points.iter().map(|&point| self.at(point)).collect()
    }

    fn grid(&self, svg: &mut Svg) {
        let Frame { left, top, .. } = *self.frame;
        let (right, bottom) = (self.frame.right(), self.frame.bottom());
        let upright = self.panel.x.ticks.iter().map(|tick| self.x(tick.0));
        let across = self.panel.y.ticks.iter().map(|tick| self.y(tick.0));
        let lines = upright
            .map(|x| ((x, top), (x, bottom)))
            .chain(across.map(|y| ((left, y), (right, y))));
        svg.segments(&Stroke::new(GRID, 1.0), lines);
    }

    fn axes(&self, svg: &mut Svg, room: &Room, in_cells: bool) {
        let Frame {
            left,
            top,
            wide,
            high,
        } = *self.frame;
        let (right, bottom, size) = (self.frame.right(), self.frame.bottom(), self.size);
        let Panel { x, y, .. } = self.panel;
        let font = Font::new(size);
        if in_cells {
            // Cells hide a grid: ticks stand outside.
            let (on_left, on_right) = (
                [(left, top), (left, bottom)],
                [(right, bottom), (right, top)],
            );
            let corners = [&on_left[..], &on_right, &on_left[..1]].concat();
            svg.line(&Stroke::new(INK, 0.8), &corners);
            let below = x.ticks.iter().map(|tick| self.x(tick.0));
            let beside = y.ticks.iter().map(|tick| self.y(tick.0));
            let ticks = below
                .map(|x| ((x, bottom), (x, bottom + 4.0)))
                .chain(beside.map(|y| ((left - 4.0, y), (left, y))));
            svg.segments(&Stroke::new(INK, 1.0), ticks);
        } else {
            let corners = [(left, top), (left, bottom), (right, bottom)];
            svg.line(&Stroke::new(SOFT, 1.0), &corners);
        }
        for (value, label) in &x.ticks {
            let place = (self.x(*value), bottom + 1.3 * size);
            svg.text(place, &font.at(Anchor::Middle), label);
        }
        let beside = left - 0.6 * size;
        let labels = y.ticks.iter().map(|tick| (beside, tick));
        let further = beside - self.panel.labels(size);
        let groups = y.groups.iter().map(|group| (further, group));
        for (right, (value, label)) in labels.chain(groups) {
            let place = (right, self.y(*value) + 0.36 * size);
            svg.text(place, &font.at(Anchor::End), label);
        }
        let centred = font.soft().at(Anchor::Middle);
        let lines = self.panel.x_label(size, wide);
        let first = bottom + room.below - 0.5 * size - 1.25 * size * (lines.len() as f64 - 1.0);
        for (index, line) in lines.iter().enumerate() {
            let baseline = first + 1.25 * size * index as f64;
            svg.text((left + 0.5 * wide, baseline), &centred, line);
        }
        let beside = (left - room.left + size, top + 0.5 * high);
        svg.text_upwards(beside, &centred, &y.label);
    }

    fn mark(&self, svg: &mut Svg, mark: &Mark) {
        match mark {
            Mark::Line(stroke, points) => svg.line(stroke, &self.points(points)),
            Mark::Segments(stroke, segments) => {
                let segments = segments.iter();
                svg.segments(
                    stroke,
                    segments.map(|&(from, to)| (self.at(from), self.at(to))),
                );
            }
            Mark::Dots(stroke, points) => svg.dots(stroke, self.points(points)),
            Mark::Symbols(symbol, points) => {
                for point in self.points(points) {
                    svg.symbol(point, symbol);
                }
            }
            Mark::Ring(stroke, point) => svg.ring(self.at(*point), stroke),
            Mark::Bars(colour, bars) => self.bars(svg, *colour, bars.iter().cloned()),
            Mark::Shade(colour, stretches) => {
                let height = self.panel.y.low..self.panel.y.high;
                let bars = stretches.iter().cloned();
                self.bars(svg, *colour, bars.map(|bar| (bar, height.clone())));
            }
            Mark::Cells(cells) => self.cells(svg, cells),
            Mark::Level(value, words) => {
                let (left, y) = (self.frame.left, self.y(*value));
                let ends = ((left, y), (self.frame.right(), y));
                svg.segments(&Stroke::new(SOFT, 1.2), [ends]);
                let font = Font::new(self.size - 1.0).soft();
                // Below where there is no room above.
                let above = y - self.frame.top > 1.2 * font.size;
                let baseline = if above { y - 3.0 } else { y + font.size };
                self.words(svg, &font, (left + 3.0, baseline), words);
            }
            Mark::Upright(stroke, value, words) => {
                let (x, top) = (self.x(*value), self.frame.top);
                svg.segments(stroke, [((x, top), (x, self.frame.bottom()))]);
                let font = Font::new(self.size - 1.0).soft();
                self.words(svg, &font, (x + 3.0, top + font.size), words);
            }
            Mark::Words(font, point, (right, down), words) => {
                let (x, y) = self.at(*point);
                self.words(svg, font, (x + right, y + down), words);
            }
        }
    }

    fn words(&self, svg: &mut Svg, font: &Font, (x, baseline): Point, words: &str) {
        let width = font.width(words);
        let before = font.anchor.told().1 * width;
        let first = (x - before)
            .min(self.frame.right() - 2.0 - width)
            .max(self.frame.left + 2.0);
        svg.text_over((first + before, baseline), font, words);
    }

    fn bars(
        &self,
        svg: &mut Svg,
        colour: Colour,
        bars: impl Iterator<Item = (Range<f64>, Range<f64>)>,
    ) {
        let frames = bars.map(|(across, up)| {
            let (left, bottom) = self.at((across.start, up.start));
            let (right, top) = self.at((across.end, up.end));
            Frame {
                left,
                top,
                wide: right - left,
                high: bottom - top,
            }
        });
        svg.rectangles(colour.light, frames);
    }

    /// One path for each fill, its cells joined along x: the file stays small.
    fn cells(&self, svg: &mut Svg, cells: &Cells) {
        let Frame {
            left, wide, high, ..
        } = *self.frame;
        if cells.cells.iter().any(Option::is_none) {
            svg.rectangles(HATCH, [*self.frame]);
        }
        let rows = cells.cells.len() / cells.columns;
        let mut paths = vec![String::new(); cells.fills.len()];
        for (row, of_row) in cells.cells.chunks(cells.columns).enumerate() {
            let mut column = 0;
            for alike in of_row.chunk_by(|one, next| one == next) {
                if let Some(path) = alike[0].and_then(|fill| paths.get_mut(fill)) {
                    let (line, length) = (rows - 1 - row, alike.len());
                    // Writing to a String cannot fail.
                    let _ = write!(path, "M{column} {line}h{length}v1h-{length}z");
                }
                column += alike.len();
            }
        }
        let (across, down) = (wide / cells.columns as f64, high / rows as f64);
        let scaled = format!(
            "transform=\"translate({left:.2} {:.2}) scale({across:.5} {down:.5})\" shape-rendering=\"crispEdges\"",
            self.frame.top
        );
        svg.group(&scaled, |svg| {
            for (path, fill) in paths.iter().zip(&cells.fills) {
                svg.path(path, &format!("fill=\"{fill}\""));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::plot::palette::FIRST;

    fn drawn(panel: &Panel) -> String {
        let frame = Frame {
            left: 50.0,
            top: 30.0,
            wide: 200.0,
            high: 100.0,
        };
        let mut svg = Svg::default();
        panel.draw(&mut svg, &frame, &panel.room(11.0, 260.0), 11.0);
        svg.finish(300.0, 160.0, None)
    }

    #[test]
    fn a_mark_stands_at_its_values() {
        let (x, y) = (
            Axis::even(0.0, 10.0, 5.0, ""),
            Axis::decades(1.0, 100.0, ""),
        );
        let panel = Panel::new("", &x, &y).with([Mark::line(FIRST, vec![(0.0, 1.0), (5.0, 10.0)])]);
        assert!(drawn(&panel).contains("M50.0 130.0L150.0 80.0"));
    }

    #[test]
    fn cells_alike_are_one_shape_and_those_without_a_fill_are_hatched() {
        let axis = Axis::even(0.0, 1.0, 1.0, "");
        let cells = Cells {
            columns: 3,
            cells: vec![Some(0), Some(0), None, Some(1), Some(0), Some(0)],
            fills: vec!["#111111".into(), "#222222".into()],
        };
        let svg = drawn(&Panel::new("", &axis, &axis).with([Mark::Cells(cells)]));
        // The first row is the lowest.
        assert!(svg.contains("M0 1h2v1h-2zM1 0h2v1h-2z") && svg.contains("M0 0h1v1h-1z"));
        assert!(svg.contains("<pattern") && svg.contains("fill=\"url(#hatch)\""));
    }

    #[test]
    fn words_at_an_edge_stay_within_the_panel() {
        let axis = Axis::even(0.0, 1.0, 1.0, "");
        let font = Font::new(10.0);
        let words = "a few words";
        let mark = Mark::Words(font, (1.0, 0.5), (5.0, 0.0), words.into());
        let left = 250.0 - 2.0 - font.width(words);
        let svg = drawn(&Panel::new("", &axis, &axis).with([mark]));
        assert!(svg.contains(&format!("x=\"{left:.1}\"")), "{svg}");
    }
}
