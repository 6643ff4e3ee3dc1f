//! The command `hil-sim`, as a user runs it.

mod ci;
mod display;
mod elf;
mod faults;
mod jury;
mod map;
mod paper;
mod people;
mod run;
mod serve;
