//! The configuration in force, in RAM that a reset leaves alone: a board that the watchdog had to restart goes on as
//! it was set.

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};

use protocol::{Configuration, ConfigurationReport, MAX_FRAME, Message, ResetCause, frame};

/// A frame with its end, of which the checksum says whether it is whole.
type Bytes = [u8; MAX_FRAME];

#[allow(
    unsafe_code,
    reason = "the section is cortex-m-rt's own, for RAM that is left alone"
)]
#[unsafe(link_section = ".uninit.configuration")]
static mut KEPT: MaybeUninit<Bytes> = MaybeUninit::uninit();

/// Keeps what is in force until power, the reset button or a debugger. To be called from one thread only.
pub fn keep(in_force: &ConfigurationReport) {
    let mut bytes = [0; MAX_FRAME];
    // One that did not fit would leave none kept.
    let _ = frame::encode(0, &Message::Configuration(*in_force), &mut bytes);
    store(bytes);
}

/// What was in force before the reset whose cause is `cause`, if that was the watchdog; any other leaves none, for the
/// firmware may be another one. To be called once, at start.
pub fn after(cause: ResetCause) -> Option<Configuration> {
    if cause != ResetCause::Watchdog {
        store([0; MAX_FRAME]);
    }
    let mut bytes = load();
    let kept = bytes.split_mut(|&byte| byte == 0).next()?;
    let (_, payload) = frame::decode(kept).ok()?;
    match frame::message(payload)? {
        Message::Configuration(report) => Some(report.configuration),
        _ => None,
    }
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised"
)]
fn load() -> Bytes {
    // SAFETY: every bit pattern is a valid array of bytes; a read torn by a write fails the checksum.
    unsafe { addr_of!(KEPT).cast::<Bytes>().read_volatile() }
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised"
)]
fn store(bytes: Bytes) {
    // SAFETY: no reference to the static is ever made.
    unsafe { addr_of_mut!(KEPT).cast::<Bytes>().write_volatile(bytes) }
}
