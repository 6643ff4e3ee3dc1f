//! Maps of where the estimators fail: error, valid share and valid-but-wrong share over grids of scenes.
//!
//! ```text
//! catalogue ─> grid of cells ─> scene text ─> native engine, all cores ─> journal (CSV) ─> picture (SVG), words
//! ```
//!
//! Every cell is an ordinary scene ([`Map::scene_text`]); `hil-sim run` gives the same numbers for it.

mod axis;
mod catalogue;
mod error;
mod fingerprint;
mod journal;
mod knob;
mod measurement;
mod picture;
mod ramp;
mod row;
mod shard;
mod summary;
mod survey;
#[cfg(test)]
mod tests;
mod words;

use std::hash::Hasher;
use std::path::Path;

use twox_hash::XxHash3_64;

use hil_sim_core::scene::{Scene, SceneError};
use knob::Setting;

pub use axis::Axis;
pub use catalogue::{catalogue, find};
pub use error::MapError;
pub use shard::Shard;
pub use survey::{Made, Plan, Survey};

/// Methods that a map compares if none are asked for, in the order of the pictures' rows.
pub const METHODS: [&str; 3] = ["spectrum", "crossings", "counting"];
/// Virtual time of a cell's scene: a thousand estimates, one of which is the 0.1 % that may be
/// wrong.
const DURATION_S: f64 = 10.0;

/// A named grid of scenes.
#[derive(Clone, Debug)]
pub struct Map {
    /// Names the map and its files.
    pub name: &'static str,
    /// What is compared with what, for the picture's title.
    title: &'static str,
    /// What all cells have in common, in words.
    pub conditions: &'static str,
    /// What changes from left to right.
    pub x: Axis,
    /// What changes from the bottom up.
    pub y: Axis,
    /// What all cells have in common. An axis' setting of the same knob stands above it.
    base: Vec<Setting>,
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
    fn place(&self, cell: usize) -> (usize, usize) {
        (cell % self.x.steps.len(), cell / self.x.steps.len())
    }

    fn cell(&self, column: usize, row: usize) -> usize {
        row * self.x.steps.len() + column
    }

    /// The names of the CSV's columns that say what a cell is: x's, then y's.
    fn columns(&self) -> Vec<&'static str> {
        self.x.columns().chain(self.y.columns()).collect()
    }

    /// What a cell changes in its scene.
    fn own(&self, cell: usize) -> impl Iterator<Item = &Setting> {
        let (column, row) = self.place(cell);
        let steps = [&self.x.steps[column], &self.y.steps[row]];
        steps.into_iter().flat_map(|step| &step.settings)
    }

    /// What stands in these columns for a cell.
    fn parameters(&self, cell: usize) -> Vec<&str> {
        self.own(cell).map(|setting| &*setting.value).collect()
    }

    /// A cell's name: the map's and the cell's number.
    fn scene_name(&self, cell: usize) -> String {
        format!("{}-{cell:04}", self.name)
    }

    /// A cell's scene file. Its seed depends on the map and on what the cell is, not on the method: all
    /// methods get the same samples.
    pub fn scene_text(&self, cell: usize, method: &str) -> String {
        let is_own = |base: &Setting| self.own(cell).any(|setting| setting.knob == base.knob);
        let common = self.base.iter().filter(|base| !is_own(base));
        let settings: Vec<&Setting> = common.chain(self.own(cell)).collect();
        let mut sections = String::new();
        for section in knob::SECTIONS {
            let of_section = settings.iter().filter(|of| of.knob.section == section);
            let entries: String = of_section.map(|setting| setting.entries()).collect();
            if !entries.is_empty() {
                sections += &format!("\n[{section}]\n{entries}");
            }
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
                axis: axis.label,
                places: axis.places(),
            })
        };
        Ok(self.cell(step(&self.x, x)?, step(&self.y, y)?))
    }
}
