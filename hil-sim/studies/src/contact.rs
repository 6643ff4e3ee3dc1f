//! What the contact models are worth.

pub mod models;
pub mod stability;
