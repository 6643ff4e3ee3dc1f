//! x
pub mod analysis;
pub mod json;
pub mod recording;
pub mod report;
pub mod truth;
