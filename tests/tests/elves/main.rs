//! The ELFs on emulated boards, by their pins, links, consoles and logs alone: no wall clock has a part in it,
//! so that as many may run at once as a machine likes.

mod arm;
mod bit_for_bit;
mod configuration;
mod console;
mod determinism;
mod estimation;
mod faults;
mod link;
mod log;
mod reversal;
mod silence;
mod table_1;
mod travelling;
