//! Pictures, for studies and reports alike, as SVG text: axes, marks, legends, and room for every word.
//!
//! | file | what |
//! | --- | --- |
//! | [`axis`] | axes and their ticks |
//! | [`mark`] | what stands on a panel, in the values of its axes |
//! | [`panel`] | a title, two axes, and the marks between them |
//! | [`page`] | panels in columns under words and a legend; a chart by itself |
//! | [`font`] | how wide text is, and where it breaks |
//! | [`svg`] | shapes and words as SVG has them |
//!
//! By hand, not by a crate: coordinates are fractions of a pixel, symbols are of five shapes, full or hollow, and
//! text is measured, so that it stays within its picture in whatever font a viewer has.

pub mod axis;
#[cfg(test)]
pub(crate) mod fits;
pub mod font;
pub mod mark;
pub mod page;
pub mod palette;
pub mod panel;
pub mod svg;
