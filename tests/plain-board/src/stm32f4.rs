//! The program in the memory of the boards' own chip, for their emulator.
#![no_std]
#![no_main]

#[path = "program.rs"]
mod program;
