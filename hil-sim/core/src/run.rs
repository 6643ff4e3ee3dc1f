//! What a run leaves behind, and who listens while it goes on.

pub mod batch;
pub mod decoder;
pub mod digest;
pub mod fault_evidence;
pub mod observer;
pub mod recording;
