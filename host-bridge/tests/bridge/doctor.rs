//! What the doctor makes of the facts: nothing of a bench that is well, and of each fault one finding.

mod bench;
mod boards;
mod counting;
mod ports;
mod reports;
