//! The display as a whole, through its public face: what it does when something is missing, late or
//! wrong.

mod any_events;
mod estimates;
mod finger;
mod link;
mod rig;
mod stimulus;
mod strokes;
mod supervisor;
mod textures;
mod zero_volt;
