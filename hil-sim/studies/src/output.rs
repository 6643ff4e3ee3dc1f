//! What is written of runs: JSON, JUnit, annotations, golden hashes, the HTML report, plots.

pub mod annotation;
pub mod escape;
pub mod golden;
pub mod json;
pub mod junit;
pub(crate) mod plot;
pub mod report;
