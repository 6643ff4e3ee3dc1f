//! The world: surface, contact, gauges, arm, hand, and the faults that are theirs.

pub mod arm;
pub mod contact;
pub mod fault;
pub mod gauges;
pub mod motion;
pub mod patch;
pub mod skew;
pub mod surface;
pub mod world;
