//! What is measured over many runs: estimators, display, contact models, the paper, people, faults.

pub mod bench;
pub mod campaign;
pub mod contact;
pub mod display;
pub mod estimators;
pub mod fuzz;
pub mod jury;
pub mod map;
pub mod output;
pub mod paper;
pub mod psychophysics;
pub mod study;
