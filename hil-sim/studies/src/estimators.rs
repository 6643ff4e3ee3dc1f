//! What every estimator gives and what it costs.

pub mod bank;
pub mod baselines;
pub mod benchmark;
pub mod bound;
pub mod confidence;
pub mod costs;
pub mod efficiency;
pub mod family;
pub mod fourier;
pub mod parts;
pub mod picture;
pub mod pitch;
pub mod result;
pub mod score;
pub mod settings;
pub mod tally;
