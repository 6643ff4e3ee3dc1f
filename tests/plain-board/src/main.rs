//! Both boards' logic on one core that is neither of them, without a HAL: gauges and hand in, fifty DAC
//! words out, and the protocol between. `./test` links it for two cores and runs it on two emulators of
//! the Cortex-M4F, which have no code in common: QEMU's mps2-an386, and that of the boards.
//!
//! By hand, from this folder (RUSTFLAGS put the boards' linker scripts aside, which cargo finds further up):
//!
//! ```sh
//! RUSTFLAGS= cargo build --locked --target thumbv7em-none-eabihf
//! qemu-system-arm -M mps2-an386 -nographic -semihosting -kernel target/thumbv7em-none-eabihf/debug/plain-board
//! ```
#![no_std]
#![no_main]

#[path = "program.rs"]
mod program;
