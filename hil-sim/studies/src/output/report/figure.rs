//! A plot of the report with its words.

use crate::output::plot::axis::Axis;
use crate::output::plot::mark::Mark;
use crate::output::plot::page::{WIDTH, chart};
use crate::output::plot::palette::Colour;
use crate::output::plot::panel::Panel;

/// A chart with what is to be said beside it.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its heading.
    pub title: String,
    /// What each colour means.
    pub legend: Vec<(Colour, &'static str)>,
    /// The chart.
    pub svg: String,
    /// What else the reader must know.
    pub note: String,
}

/// A chart as wide as the page, of a height.
pub(super) fn draw(height: f64, x: &Axis, y: &Axis, marks: Vec<Mark>) -> String {
    chart(WIDTH, height, &Panel::new("", x, y).with(marks))
}
