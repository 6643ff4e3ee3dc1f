//! A page: words that wrap, legends, and panels in columns, one below the other.

use super::font::Font;
use super::panel::{Panel, Room};
use super::svg::{Frame, Stroke, Svg, Symbol};
use crate::output::plot::palette::{INK, PAPER};

/// As wide as a README shows a picture.
pub const WIDTH: f64 = 1_000.0;
/// Around everything.
const MARGIN: f64 = 12.0;
/// Height of a panel between its axes.
pub const PANEL_HEIGHT: f64 = 178.0;
/// Size of a panel's words.
const SIZE: f64 = 11.0;
/// Size of words about the whole page, and from one line of them to the next.
const NOTE_SIZE: f64 = 12.0;
const NOTE_LINE: f64 = 18.0;
/// Between two things of a legend.
const LEGEND_GAP: f64 = 18.0;

/// What stands before the words of a legend.
#[derive(Clone, Debug, PartialEq)]
pub enum Key {
    Symbol(Symbol),
    Line(Stroke),
    Fill(String),
}

impl Key {
    fn wide(&self) -> f64 {
        match self {
            Key::Symbol(_) => 10.0,
            Key::Line(_) => 26.0,
            Key::Fill(_) => 20.0,
        }
    }

    fn draw(&self, svg: &mut Svg, left: f64, middle: f64) {
        let wide = self.wide();
        match self {
            Key::Symbol(symbol) => svg.symbol((left + 0.5 * wide, middle), symbol),
            Key::Line(stroke) => svg.segments(stroke, [((left, middle), (left + wide, middle))]),
            Key::Fill(fill) => {
                let (top, high) = (middle - 6.0, 12.0);
                let (right, bottom) = (left + wide, top + high);
                let (above, below) = (
                    [(left, top), (right, top)],
                    [(right, bottom), (left, bottom)],
                );
                svg.rectangles(
                    fill,
                    [Frame {
                        left,
                        top,
                        wide,
                        high,
                    }],
                );
                let edge = [&above[..], &below, &above[..1]].concat();
                svg.line(&Stroke::new(INK, 0.6), &edge);
            }
        }
    }
}

/// Panels look alike where their labels are of about the same width.
fn least_room(panel: &Panel) -> Room {
    let labelled = panel.y.ticks.iter().any(|tick| !tick.1.is_empty());
    Room {
        left: if labelled { 42.0 } else { 18.0 },
        right: 8.0,
        ..Room::default()
    }
}

#[derive(Clone, Debug)]
pub struct Page {
    svg: Svg,
    /// Where the next thing begins.
    top: f64,
}

impl Default for Page {
    fn default() -> Self {
        Self {
            svg: Svg::default(),
            top: 6.0,
        }
    }
}

impl Page {
    pub fn title(&mut self, words: &str) {
        self.paragraph(&Font::new(15.0).bold(), 22.0, words);
    }

    pub fn note(&mut self, words: &str) {
        self.paragraph(&Font::new(NOTE_SIZE).soft(), NOTE_LINE, words);
    }

    fn paragraph(&mut self, font: &Font, line_height: f64, words: &str) {
        for line in font.wrap(words, WIDTH - 2.0 * MARGIN) {
            self.top += line_height;
            self.svg.text((MARGIN, self.top - 4.0), font, &line);
        }
    }

    /// What things on the page are, side by side, in as many lines as it takes.
    pub fn legend(&mut self, entries: &[(Key, &str)]) {
        let font = Font::new(NOTE_SIZE);
        let mut left = f64::INFINITY;
        for (key, words) in entries {
            let wide = key.wide() + 6.0 + font.width(words);
            if left + wide > WIDTH - MARGIN {
                left = MARGIN;
                self.top += NOTE_LINE;
            }
            key.draw(&mut self.svg, left, self.top - 8.0);
            let words_left = left + key.wide() + 6.0;
            self.svg.text((words_left, self.top - 4.0), &font, words);
            left += wide + LEGEND_GAP;
        }
    }

    /// Panels, so many in a row. Rows are of these heights, further ones of the last; frames are equally wide and
    /// aligned.
    pub fn panels(&mut self, columns: usize, heights: &[f64], panels: &[Panel]) {
        let rooms: Vec<Room> = (0..columns)
            .map(|column| {
                let of_column = panels.iter().skip(column).step_by(columns);
                of_column
                    .flat_map(|panel| [panel.room(SIZE, f64::INFINITY), least_room(panel)])
                    .fold(Room::default(), Room::max)
            })
            .collect();
        let taken: f64 = rooms.iter().map(|room| room.left + room.right).sum();
        let wide = (WIDTH - 2.0 * MARGIN - taken) / columns as f64;
        for (row, panels) in panels.chunks(columns).enumerate() {
            let high = heights[row.min(heights.len() - 1)];
            let needed = panels
                .iter()
                .map(|panel| panel.room(SIZE, wide))
                .fold(Room::default(), Room::max);
            let (top, mut left) = (self.top + needed.above, MARGIN);
            for (panel, of_column) in panels.iter().zip(&rooms) {
                let Room {
                    left: before,
                    right,
                    ..
                } = *of_column;
                let room = Room {
                    left: before,
                    right,
                    ..needed
                };
                left += room.left;
                let frame = Frame {
                    left,
                    top,
                    wide,
                    high,
                };
                panel.draw(&mut self.svg, &frame, &room, SIZE);
                left += wide + room.right;
            }
            self.top = top + high + needed.below;
        }
    }

    pub fn finish(self) -> String {
        let high = (self.top + MARGIN).ceil();
        self.svg.finish(WIDTH, high, Some(PAPER))
    }
}

/// A picture of three panels in a row, or more rows, under words and a legend.
pub fn in_threes(note: &str, legend: &[(Key, &str)], panels: &[Panel]) -> String {
    let mut page = Page::default();
    page.note(note);
    page.legend(legend);
    page.panels(3, &[PANEL_HEIGHT], panels);
    page.finish()
}

/// A chart by itself, for a page of HTML that says what it shows: of a width and a height, its words of a size
/// that reads well beside the page's.
pub fn chart(wide: f64, high: f64, panel: &Panel) -> String {
    const SIZE: f64 = 16.0;
    let beside = panel.room(SIZE, f64::INFINITY);
    // Charts below each other look aligned where their labels are of about the same width.
    let left = beside.left.max(0.09 * wide);
    let room = Room {
        left,
        ..panel.room(SIZE, wide - left - beside.right)
    };
    let frame = Frame {
        left: room.left,
        top: room.above,
        wide: wide - room.left - room.right,
        high: high - room.above - room.below,
    };
    let mut svg = Svg::default();
    panel.draw(&mut svg, &frame, &room, SIZE);
    svg.finish(wide, high, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::plot::palette::FIRST;
    use crate::output::plot::svg::Shape;

    #[test]
    fn a_legend_takes_as_many_lines_as_its_words_need() {
        let entry = (
            Key::Symbol(Symbol::new(FIRST, Shape::Circle)),
            "a method of the field",
        );
        let mut page = Page::default();
        page.legend(&[entry.clone(), entry.clone()]);
        let one_line = page.top;
        page.legend(&vec![entry; 9]);
        assert!(page.top >= one_line + 2.0 * NOTE_LINE);
        crate::output::plot::tests::assert_fits("legend", &page.finish());
    }
}
