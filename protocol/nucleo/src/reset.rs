//! Why the board started, and how often the watchdog had to start it.

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};

use embassy_stm32::pac::RCC;
use protocol::ResetCause;

/// Marks a count that survived a reset, as opposed to what RAM holds after power came on.
const KEPT: u32 = 0x5244_474C;

/// In RAM that neither the start-up code nor a reset touches.
#[allow(
    unsafe_code,
    reason = "the section is cortex-m-rt's own, for RAM that is left alone"
)]
#[unsafe(link_section = ".uninit.watchdog_resets")]
static mut WATCHDOG_RESETS: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

/// Why the board started, and the watchdog resets since power came on. To be called once, at start:
/// it clears the flags (RM0090, 6.3.21).
pub fn cause() -> (ResetCause, u32) {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    let cause = if flags.porrstf() || flags.borrstf() {
        ResetCause::Power
    } else if flags.wdgrstf() || flags.wwdgrstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else {
        ResetCause::Pin
    };
    (cause, count(cause))
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised; it is only touched here, once, before any task runs"
)]
fn count(cause: ResetCause) -> u32 {
    // SAFETY: every bit pattern is a valid [u32; 2], and nothing else refers to the static.
    let [mark, resets] = unsafe { addr_of!(WATCHDOG_RESETS).cast::<[u32; 2]>().read_volatile() };
    let before = if mark == KEPT && cause != ResetCause::Power {
        resets
    } else {
        0
    };
    let resets = before.wrapping_add(u32::from(cause == ResetCause::Watchdog));
    // SAFETY: as above.
    unsafe {
        addr_of_mut!(WATCHDOG_RESETS)
            .cast::<[u32; 2]>()
            .write_volatile([KEPT, resets])
    };
    resets
}
