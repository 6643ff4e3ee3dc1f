//! A plot of the report with its words.

use crate::output::plot::palette::Colour;

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
