//! Shapes and words as SVG text.

use std::fmt::Write;

use super::font::Font;
use crate::output::escape::escape;
use crate::output::plot::palette::{Colour, PAPER};

/// A point of a picture: right and down from its upper left corner.
pub type Point = (f64, f64);

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    pub colour: Colour,
    pub width: f64,
    /// Lengths of dashes and gaps, as SVG has them; nothing for a line without gaps.
    pub dash: &'static str,
}

impl Stroke {
    pub const fn new(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dash: "",
        }
    }

    pub const fn dashed(self, dash: &'static str) -> Self {
        Self { dash, ..self }
    }

    fn attributes(&self) -> String {
        let dash = match self.dash {
            "" => String::new(),
            dash => format!(" stroke-dasharray=\"{dash}\""),
        };
        format!(
            "fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{dash}",
            self.colour.light, self.width
        )
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Circle,
    Square,
    Up,
    Down,
    Diamond,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symbol {
    pub colour: Colour,
    pub shape: Shape,
    /// Whether only its edge is coloured.
    pub hollow: bool,
    /// From 0, not to be seen, to 1.
    pub opacity: f64,
}

impl Symbol {
    pub const fn new(colour: Colour, shape: Shape) -> Self {
        Self {
            colour,
            shape,
            hollow: false,
            opacity: 1.0,
        }
    }

    pub const fn hollow(self, hollow: bool) -> Self {
        Self { hollow, ..self }
    }

    pub const fn faded(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame {
    pub left: f64,
    pub top: f64,
    pub wide: f64,
    pub high: f64,
}

impl Frame {
    pub fn right(&self) -> f64 {
        self.left + self.wide
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.high
    }
}

/// A picture's elements. Writing to a String cannot fail.
#[derive(Clone, Debug, Default)]
pub struct Svg {
    elements: String,
}

impl Svg {
    pub fn text(&mut self, (x, y): Point, font: &Font, words: &str) {
        self.words(&format!("x=\"{x:.1}\" y=\"{y:.1}\""), font, words);
    }

    /// A line of text over other things: an edge of the paper's colour below it keeps it legible.
    pub fn text_over(&mut self, (x, y): Point, font: &Font, words: &str) {
        let place = format!("x=\"{x:.1}\" y=\"{y:.1}\"");
        let edge = format!(
            "{place} stroke=\"{}\" stroke-width=\"3\" stroke-linejoin=\"round\" aria-hidden=\"true\"",
            PAPER.light
        );
        self.words(&edge, font, words);
        self.words(&place, font, words);
    }

    pub fn text_upwards(&mut self, (x, y): Point, font: &Font, words: &str) {
        let place = format!("transform=\"translate({x:.1} {y:.1}) rotate(-90)\"");
        self.words(&place, font, words);
    }

    fn words(&mut self, attributes: &str, font: &Font, words: &str) {
        if words.is_empty() {
            return;
        }
        let attribute = |is_set, text: &'static str| if is_set { text } else { "" };
        let bold = attribute(font.bold, " font-weight=\"bold\"");
        let italic = attribute(font.italic, " font-style=\"italic\"");
        let _ = writeln!(
            self.elements,
            "<text {attributes} text-anchor=\"{}\" font-size=\"{}\"{bold}{italic} fill=\"{}\">{}</text>",
            font.anchor.told().0,
            font.size,
            font.colour.light,
            escape(words)
        );
    }

    pub fn line(&mut self, stroke: &Stroke, points: &[Point]) {
        let mut path = String::new();
        for (index, (x, y)) in points.iter().enumerate() {
            let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' });
        }
        self.path(
            &path,
            &format!("stroke-linejoin=\"round\" {}", stroke.attributes()),
        );
    }

    pub fn segments(
        &mut self,
        stroke: &Stroke,
        segments: impl IntoIterator<Item = (Point, Point)>,
    ) {
        let mut path = String::new();
        for (from, to) in segments {
            let _ = write!(path, "M{:.1} {:.1}L{:.1} {:.1}", from.0, from.1, to.0, to.1);
        }
        self.path(
            &path,
            &format!("stroke-linecap=\"square\" {}", stroke.attributes()),
        );
    }

    /// Dots of a diameter: as one path, which is a tenth of as many circles.
    pub fn dots(&mut self, stroke: &Stroke, points: impl IntoIterator<Item = Point>) {
        let mut path = String::new();
        for (x, y) in points {
            let _ = write!(path, "M{x:.1} {y:.1}h0");
        }
        self.path(
            &path,
            &format!("stroke-linecap=\"round\" {}", stroke.attributes()),
        );
    }

    /// Filled rectangles: the fill as SVG has it.
    pub fn rectangles(&mut self, fill: &str, frames: impl IntoIterator<Item = Frame>) {
        let mut path = String::new();
        for of in frames {
            let Frame {
                left,
                top,
                wide,
                high,
            } = of;
            let _ = write!(path, "M{left:.2} {top:.2}h{wide:.2}v{high:.2}h-{wide:.2}z");
        }
        self.path(&path, &format!("fill=\"{fill}\""));
    }

    pub fn symbol(&mut self, (x, y): Point, symbol: &Symbol) {
        let shape = match symbol.shape {
            Shape::Circle => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\""),
            Shape::Square => polygon(x, y, &[(-3.6, -3.6), (3.6, -3.6), (3.6, 3.6), (-3.6, 3.6)]),
            Shape::Up => polygon(x, y, &[(0.0, -5.0), (4.6, 3.4), (-4.6, 3.4)]),
            Shape::Down => polygon(x, y, &[(0.0, 5.0), (4.6, -3.4), (-4.6, -3.4)]),
            Shape::Diamond => polygon(x, y, &[(0.0, -5.2), (5.2, 0.0), (0.0, 5.2), (-5.2, 0.0)]),
        };
        let (fill, stroke, width) = if symbol.hollow {
            (PAPER, symbol.colour, 1.8)
        } else {
            (symbol.colour, PAPER, 0.8)
        };
        let _ = writeln!(
            self.elements,
            "{shape} fill=\"{}\" stroke=\"{}\" stroke-width=\"{width}\" opacity=\"{}\"/>",
            fill.light, stroke.light, symbol.opacity
        );
    }

    pub fn ring(&mut self, (x, y): Point, stroke: &Stroke) {
        let _ = writeln!(
            self.elements,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" {}/>",
            stroke.attributes()
        );
    }

    /// A path by its commands, if there are any, and further attributes.
    pub fn path(&mut self, commands: &str, attributes: &str) {
        if commands.is_empty() {
            return;
        }
        let _ = writeln!(self.elements, "<path {attributes} d=\"{commands}\"/>");
    }

    pub fn group(&mut self, attributes: &str, inner: impl FnOnce(&mut Self)) {
        let _ = writeln!(self.elements, "<g {attributes}>");
        inner(self);
        self.elements.push_str("</g>\n");
    }

    /// The picture: of a size, on a ground of a colour or on none.
    pub fn finish(self, wide: f64, high: f64, ground: Option<Colour>) -> String {
        let ground = ground.map_or(String::new(), |colour| {
            format!(
                "<rect width=\"{wide:.0}\" height=\"{high:.0}\" fill=\"{}\"/>\n",
                colour.light
            )
        });
        let hatched = self.elements.contains(HATCH);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide:.0}\" height=\"{high:.0}\" \
             viewBox=\"0 0 {wide:.0} {high:.0}\" font-family=\"sans-serif\">\n{}{ground}{}</svg>\n",
            if hatched { HATCH_PATTERN } else { "" },
            self.elements
        )
    }
}

/// The fill of what has no value.
pub const HATCH: &str = "url(#hatch)";
const HATCH_PATTERN: &str = "<defs><pattern id=\"hatch\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" \
    patternTransform=\"rotate(45)\"><rect width=\"6\" height=\"6\" fill=\"#d4d7db\"/>\
    <rect width=\"1.5\" height=\"6\" fill=\"#9aa1a9\"/></pattern></defs>\n";

fn polygon(x: f64, y: f64, corners: &[Point]) -> String {
    let corner = |(across, down): &Point| format!("{:.1},{:.1}", x + across, y + down);
    let points: Vec<String> = corners.iter().map(corner).collect();
    format!("<polygon points=\"{}\"", points.join(" "))
}
