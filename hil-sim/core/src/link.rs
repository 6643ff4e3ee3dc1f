//! What the way between the boards does to frames: delay, jitter, loss, reordering, corruption, forged frames.

pub mod channel;
pub mod forger;
pub mod impairments;
