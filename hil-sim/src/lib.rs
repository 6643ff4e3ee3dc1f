//! Ridgelink's simulator: scenes, the world that a scene describes, and engines that run the firmware in it.

pub mod analysis;
pub mod annotation;
pub mod arm;
pub mod batch;
pub mod chart;
pub mod contact;
pub mod dac81416;
pub mod digest;
pub mod elf;
pub mod event;
pub mod expectation;
pub mod fault;
pub mod gauges;
pub mod golden;
pub mod json;
pub mod junit;
pub mod listener;
pub mod map;
pub mod motion;
pub mod native;
pub mod onlooker;
pub mod outcome;
pub mod paper;
pub mod patch;
pub mod people;
pub mod recording;
pub mod report;
pub mod scene;
pub mod skew;
pub mod surface;
pub mod truth;
pub mod weather;
pub mod world;

#[cfg(target_os = "linux")]
pub use elf::serve;
