//! The simulator's core: what a scene is, the world that it describes, the engine that runs the firmware's
//! libraries in it, and what is judged of a run.
//!
//! Layers, the lowest first; imports go downwards only (`tests/tests/system/layers.rs` checks it):
//! [`scene`] (data) ← [`hjif`] (textures in the field's own format) ← [`plant`] (surface, contact, gauges, hand) ←
//! [`link`] (what happens between the boards) ← [`run`] (what a run leaves behind) ← [`scene_file`] (TOML, CSV, WAV, MCAP,
//! `.hjif`) ← [`native`] ← [`judge`].

pub mod hjif;
pub mod judge;
pub mod link;
pub mod native;
pub mod plant;
pub mod run;
pub mod scene;
pub mod scene_file;
