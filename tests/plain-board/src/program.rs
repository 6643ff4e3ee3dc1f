//! The program itself: every second of the rehearsal, and what was computed in it, to the debugger's console.

mod console;
mod rehearsal;

use core::fmt::Write as _;

use console::{Console, exit};
use rehearsal::{Rehearsal, SECONDS};

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut rehearsal = Rehearsal::new();
    for _ in 0..SECONDS {
        if writeln!(Console, "{}", rehearsal.second()).is_err() {
            exit(false);
        }
    }
    exit(true)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    // There is nothing left to be done about a console that takes no text.
    let _ = writeln!(Console, "{info}");
    exit(false)
}
