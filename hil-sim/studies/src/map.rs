//! Maps of where the estimators fail: error, valid share and valid-but-wrong share over grids of scenes.
//!
//! ```text
//! catalogue ─> grid of cells ─> scene text ─> native engine, all cores ─> journal (CSV) ─> picture (SVG), words
//! ```
//!
//! Every cell is an ordinary scene ([`Map::scene_text`]); `hil-sim run` gives the same numbers for it.

pub mod axis;
pub mod catalogue;
pub mod error;
pub mod fingerprint;
pub mod journal;
pub mod knob;
pub mod measurement;
pub mod picture;
pub mod ramp;
pub mod row;
pub mod shard;
pub mod summary;
pub mod survey;
#[cfg(test)]
mod tests;
pub mod words;

use std::fmt::Write;
use std::hash::Hasher;
use std::path::Path;

use twox_hash::XxHash3_64;

use axis::Axis;
use hil_sim_core::scene::{Scene, SceneError};
use knob::Setting;

pub use catalogue::{catalogue, find};
pub use error::MapError;
pub use survey::{Plan, Survey};

/// Methods that a map compares if none are asked for, in the order of the pictures' rows.
pub const METHODS: [&str; 3] = ["spectrum", "crossings", "counting"];
/// Virtual time of a cell's scene, in s: a thousand estimates, one of which is the 0.1 % that may be
/// wrong.
pub const DURATION_S: f64 = 10.0;

/// A named grid of scenes.
#[derive(Clone, Debug)]
pub struct Map {
    /// Names the map and its files.
    pub name: &'static str,
    /// What is compared with what, for the picture's title.
    pub title: &'static str,
    /// What all cells have in common, in words.
    pub conditions: &'static str,
    /// What changes from left to right.
    pub x: Axis,
    /// What changes from the bottom up.
    pub y: Axis,
    /// What all cells have in common. An axis' setting of the same knob stands above it.
    pub base: Vec<Setting>,
}

impl Map {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.x.steps.len() * self.y.steps.len()
    }

    /// Whether the map has no cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Column and row of a cell below [`Map::len`]: cells are counted along x first.
    pub fn place(&self, cell: usize) -> (usize, usize) {
        (cell % self.x.steps.len(), cell / self.x.steps.len())
    }

    /// The cell at a column and a row.
    pub fn cell(&self, column: usize, row: usize) -> usize {
        row * self.x.steps.len() + column
    }

    /// The names of the CSV's columns that say what a cell is: x's, then y's.
    pub fn columns(&self) -> Vec<&'static str> {
        self.x.columns().chain(self.y.columns()).collect()
    }

    /// What stands in these columns for a cell.
    pub fn parameters(&self, cell: usize) -> Vec<&str> {
        let (column, row) = self.place(cell);
        let steps = [&self.x.steps[column], &self.y.steps[row]];
        steps
            .into_iter()
            .flat_map(|step| step.settings.iter().map(|setting| setting.value.as_str()))
            .collect()
    }

    /// A cell's name: the map's and the cell's number.
    pub fn scene_name(&self, cell: usize) -> String {
        format!("{}-{cell:04}", self.name)
    }

    /// A cell's scene file. Its seed depends on the map and on what the cell is, not on the method: all
    /// methods get the same samples.
    pub fn scene_text(&self, cell: usize, method: &str) -> String {
        let (column, row) = self.place(cell);
        let own = [&self.x.steps[column], &self.y.steps[row]].map(|step| &step.settings);
        let own: Vec<&Setting> = own.into_iter().flatten().collect();
        let common = self
            .base
            .iter()
            .filter(|base| own.iter().all(|setting| setting.knob != base.knob));
        let settings: Vec<&Setting> = common.chain(own.iter().copied()).collect();

        let mut sections = String::new();
        for section in knob::SECTIONS {
            let mut entries = settings
                .iter()
                .filter(|setting| setting.knob.section() == section)
                .map(|setting| setting.knob.entries(&setting.value))
                .peekable();
            if entries.peek().is_some() {
                let _ = write!(sections, "\n[{section}]\n");
            }
            sections.extend(entries);
        }
        let mut seed = XxHash3_64::with_seed(0);
        seed.write(self.name.as_bytes());
        seed.write(sections.as_bytes());
        format!(
            "name = \"{}\"\nseed = {}\nduration_s = {DURATION_S:.1}\n{sections}\n[estimator]\nmethod = \"{method}\"\n",
            self.scene_name(cell),
            // A scene's seed is at most an i64; a short one is easier to read.
            seed.finish() >> 32,
        )
    }

    /// A cell's scene, checked.
    ///
    /// # Errors
    /// If this version cannot run the cell, or does not know the method.
    pub fn scene(&self, cell: usize, method: &str) -> Result<Scene, SceneError> {
        let path = format!("{}.toml", self.scene_name(cell));
        Scene::parse(Path::new(&path), &self.scene_text(cell, method))
    }

    /// The cell nearest to what is written on the axes.
    ///
    /// # Errors
    /// If either is neither a number nor a label of its axis.
    pub fn nearest(&self, x: &str, y: &str) -> Result<usize, MapError> {
        let step = |axis: &Axis, text: &str| {
            axis.nearest(text).ok_or_else(|| MapError::NoSuchPlace {
                map: self.name,
                text: text.to_owned(),
                axis: axis.label.to_owned(),
                places: axis.places(),
            })
        };
        Ok(self.cell(step(&self.x, x)?, step(&self.y, y)?))
    }
}
