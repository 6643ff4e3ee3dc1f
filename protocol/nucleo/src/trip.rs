//! Why the board was stopped for good, in RAM that a reset leaves alone: one that the watchdog had to restart
//! stays stopped.

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};

use protocol::{ResetCause, Trip};

/// Marks a word that names a trip, as opposed to what RAM holds after power came on; its complement
/// stands beside it.
const MARK: u32 = 0x5452_4900;
const NUMBER: u32 = 0xFF;

#[allow(
    unsafe_code,
    reason = "the section is cortex-m-rt's own, for RAM that is left alone"
)]
#[unsafe(link_section = ".uninit.trip")]
static mut LATCH: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

/// Keeps `trip` until power or the reset button, unless one is kept already: the first one is the
/// reason, what follows may come of it. From anywhere, also when nothing else can be relied on.
pub fn latch(trip: Trip) {
    if kept().is_none() {
        let word = MARK | trip as u32;
        store([word, !word]);
    }
}

/// The trip from before the reset whose cause is `cause`, as [`kept_after`]; a restart by the watchdog is one
/// by itself. To be called once, at start.
pub fn after(cause: ResetCause) -> Option<Trip> {
    if cause == ResetCause::Watchdog {
        latch(Trip::Watchdog);
    }
    kept_after(cause)
}

/// The trip from before the reset whose cause is `cause`; power and the reset button leave none. To be called
/// once, at start.
pub fn kept_after(cause: ResetCause) -> Option<Trip> {
    if matches!(cause, ResetCause::Power | ResetCause::Pin) {
        store([0; 2]);
    }
    kept()
}

fn kept() -> Option<Trip> {
    let [word, complement] = load();
    if word != !complement || word & !NUMBER != MARK {
        return None;
    }
    Trip::ALL
        .into_iter()
        .find(|&trip| trip as u32 == word & NUMBER)
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised"
)]
fn load() -> [u32; 2] {
    // SAFETY: every bit pattern is a valid [u32; 2]; a read torn by a write fails the complement's test.
    unsafe { addr_of!(LATCH).cast::<[u32; 2]>().read_volatile() }
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised"
)]
fn store(words: [u32; 2]) {
    // SAFETY: no reference to the static is ever made.
    unsafe { addr_of_mut!(LATCH).cast::<[u32; 2]>().write_volatile(words) }
}
