//! Pictures, for studies and reports alike, as SVG text: axes, marks, legends, and room for every word.
//!
//! By hand, not by a crate: coordinates are fractions of a pixel, symbols are of five shapes, full or hollow, and
//! text is measured, so that it stays within its picture in whatever font a viewer has.

pub mod axis;
mod font;
mod mark;
mod page;
pub mod palette;
mod panel;
mod svg;
#[cfg(test)]
pub(crate) mod tests;

pub use axis::Axis;
pub use font::{Anchor, Font};
pub use mark::{Cells, Mark};
pub use page::{Key, PANEL_HEIGHT, Page, WIDTH, chart, in_threes};
pub use panel::Panel;
pub use svg::{HATCH, Point, Shape, Stroke, Symbol};
