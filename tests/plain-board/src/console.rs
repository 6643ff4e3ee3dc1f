//! The console of whoever debugs the board: an emulator or a probe, by Arm's semihosting. Without one of
//! them a call is a breakpoint that nobody answers, and the board stops there.

use core::arch::asm;
use core::fmt::{Result, Write};

/// The operations (Arm, "Semihosting for AArch32 and AArch64").
const WRITE_CHARACTER: u32 = 0x03;
const EXIT: u32 = 0x18;
/// Why it exits: all is done, or something went wrong.
const DONE: u32 = 0x2_0026;
const FAILED: u32 = 0x2_0023;

/// Where text goes.
pub struct Console;

impl Write for Console {
    fn write_str(&mut self, text: &str) -> Result {
        for byte in text.bytes() {
            ask(WRITE_CHARACTER, &raw const byte as u32);
        }
        Ok(())
    }
}

/// Ends the run.
pub fn exit(is_done: bool) -> ! {
    loop {
        ask(EXIT, if is_done { DONE } else { FAILED });
    }
}

#[allow(unsafe_code, reason = "the host is called by an instruction")]
fn ask(operation: u32, parameter: u32) {
    // SAFETY: neither operation writes to memory; the host gives its answer in r0.
    unsafe {
        asm!("bkpt #0xAB", inout("r0") operation => _, in("r1") parameter, options(nostack, preserves_flags));
    }
}
