//! `hil-sim chart`: what every estimator gives, and what it costs.
pub mod bound;
pub mod fourier;
pub mod parts;
pub mod pitch;
pub mod rivals;
pub mod settings;
pub mod tally;
