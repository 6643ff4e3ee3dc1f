//! Brings a bench up, one step at a time: what to wire, what is measured then, what it has to be, and what to
//! try if it is not.
//!
//! ```text
//! steps.toml ──> step: what to do, quantities with their limits
//!             ^
//! look ─> sight ─> judged ─> progress: the state file, JSON ─> report: HTML
//! ```
//!
//! The steps are data. What they measure is what the boards say of themselves, as `doctor` hears it, and what a
//! person reads off an instrument.

pub(crate) mod progress;
pub(crate) mod quantity;
pub(crate) mod report;
pub(crate) mod sight;
pub(crate) mod step;
