//! Faults of the plant: gauges, hand, clock.

pub mod clock;
pub mod gauges;
pub mod hand;
