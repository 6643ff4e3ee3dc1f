//! When the firmware can't go on: CLR low at once, the reason kept, the last words logged, and then
//! nothing until the watchdog restarts the board, which takes 0.4 s and leaves a probe the time to look.
//! After the restart the display is stopped, for the reason kept.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::SCB;
use protocol::Trip;

use crate::clear;

/// CFSR's flags of an access that the MPU refused: data, and the stacking and unstacking of an exception,
/// the floating-point unit's included (DDI 0403E, B3.2.15). All it refuses is the stack's end.
const REFUSED: u32 = 1 << 1 | 1 << 3 | 1 << 4 | 1 << 5;

fn end(trip: Trip) {
    clear::pull();
    nucleo::trip::latch(trip);
}

fn wait_for_the_watchdog() -> ! {
    cortex_m::interrupt::disable();
    loop {
        cortex_m::asm::wfe();
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    static PANICKED: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    end(Trip::Panic);
    // Logging may be what panicked.
    if !PANICKED.swap(true, Ordering::Relaxed) {
        defmt::error!("{}", defmt::Display2Format(info));
    }
    wait_for_the_watchdog()
}

/// Goes on with a stack that is empty, whatever became of the one there was.
#[allow(
    unsafe_code,
    reason = "an exception's entry, which sets the stack pointer"
)]
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "ldr r0, =_stack_start",
        "msr msp, r0",
        "b {fault}",
        fault = sym fault,
    )
}

/// Every fault comes here: none of the finer handlers is enabled.
extern "C" fn fault() -> ! {
    #[allow(unsafe_code, reason = "a register that is only read")]
    // SAFETY: the pointer is that of the processor's own registers.
    let flags = unsafe { (*SCB::PTR).cfsr.read() };
    end(if flags & REFUSED != 0 {
        Trip::StackOverflow
    } else {
        Trip::Fault
    });
    defmt::error!("fault, CFSR {=u32:#010x}", flags);
    wait_for_the_watchdog()
}
