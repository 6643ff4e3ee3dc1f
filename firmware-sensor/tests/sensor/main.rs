//! The sensor library, from scans to estimates.

mod alignment;
mod estimates;
mod faults;
mod felt;
mod garbage;
mod methods;
mod paper;
mod rubbing;
mod texture;
