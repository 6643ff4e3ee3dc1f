//! Ridgelink's simulator: scenes, the world that a scene describes, and engines that run the firmware in it.

pub mod arm;
pub mod gauges;
pub mod motion;
pub mod recording;
pub mod scene;
pub mod surface;
pub mod weather;
pub mod world;
