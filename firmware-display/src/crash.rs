//! When the firmware can't go on: CLR low at once, the reason kept, the last words logged, and then
//! nothing until the watchdog restarts the board, which takes 0.4 s and leaves a probe the time to look.
//! After the restart the display is stopped, for the reason kept.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::ptr::addr_of;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::SCB;
use protocol::Trip;

use crate::clear;

/// The last that a push takes of the stack before it faults, and the frame of the fault itself.
const LAST_BYTES: u32 = 128;

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

/// Goes on with a stack that is empty, whatever became of the one there was, and tells where it ended.
#[allow(
    unsafe_code,
    reason = "an exception's entry, which sets the stack pointer"
)]
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "b {fault}",
        fault = sym fault,
    )
}

/// Every fault comes here: none of the finer handlers is enabled. See memory.x for what becomes of a
/// stack that is full.
extern "C" fn fault(stack: u32) -> ! {
    #[allow(unsafe_code, reason = "a symbol of the linker's")]
    let stack_end = {
        unsafe extern "C" {
            static _stack_end: u8;
        }
        addr_of!(_stack_end) as u32
    };
    end(if stack < stack_end + LAST_BYTES {
        Trip::StackOverflow
    } else {
        Trip::Fault
    });
    #[allow(unsafe_code, reason = "a register that is only read")]
    // SAFETY: the pointer is that of the processor's own registers.
    let flags = unsafe { (*SCB::PTR).cfsr.read() };
    defmt::error!("fault, CFSR {=u32:#010x}, stack {=u32:#010x}", flags, stack);
    wait_for_the_watchdog()
}
