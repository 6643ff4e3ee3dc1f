//! What a run leaves behind, and who listens while it goes on.

pub mod batch;
pub mod digest;
pub mod listener;
pub mod observer;
pub mod recording;
pub mod signs;
