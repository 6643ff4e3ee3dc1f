//! The display as a whole, through its public face.

mod any_events;
mod rig;
mod supervisor;
