//! Faults of the plant: gauges, hand, clock.

pub mod clock;
pub mod encoder;
pub mod gauges;
