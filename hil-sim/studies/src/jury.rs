//! The jury: is λ right, wrong or not stood by, on surfaces that the simulator has not made?
//!
//! ```text
//! seed ──> stranger::Trial ──> Record ───┐
//!          (ground, hand, pickup, force) ├─> counts::Counts ──> table::Table
//! folder ──> scenes ──> an engine ───────┘
//! ```
//!
//! Strangers are drawn at random by [`stranger`], which shares nothing with the simulator's plant; a
//! [`folder`] holds whoever's recordings.

pub mod counts;
pub(crate) mod dice;
pub mod evidence;
pub mod folder;
pub mod force;
pub mod ground;
pub mod hand;
pub mod pickup;
pub mod play;
pub mod seeds;
pub mod stranger;
pub mod table;
#[cfg(test)]
mod tests;
