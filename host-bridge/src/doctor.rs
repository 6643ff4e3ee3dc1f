//! What is wrong with a bench, and what to do about it.
//!
//! ```text
//! bench ─> look ─> examination: facts ─> findings ─┬─> report, for people
//!                                                  └─> json, for scripts
//! ```
//!
//! Everything behind [`look`] is pure: the same facts give the same findings.

pub mod counters;
pub mod examination;
pub mod findings;
pub mod json;
pub mod look;
pub mod permission;
pub mod report;
