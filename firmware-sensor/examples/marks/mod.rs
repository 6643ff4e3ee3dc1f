//! Marks that an emulator can see: 32-bit writes to the CRC unit's data register, which nothing else uses.

/// The CRC unit's data register.
const MARKS: *mut u32 = 0x4002_3000 as *mut u32;
/// RCC_AHB1ENR and the bit that gives the CRC unit its clock.
const AHB1_CLOCKS: *mut u32 = 0x4002_3830 as *mut u32;
const CRC_CLOCK: u32 = 1 << 12;
/// The mark after the last part.
pub const DONE: u32 = 999;

/// Gives the CRC unit its clock; before the first mark.
#[allow(
    unsafe_code,
    reason = "a volatile access to registers that nothing else here uses"
)]
pub fn enable_marks() {
    // SAFETY: RCC_AHB1ENR exists on every STM32F4, and nothing else has been set up yet.
    unsafe { AHB1_CLOCKS.write_volatile(AHB1_CLOCKS.read_volatile() | CRC_CLOCK) };
}

/// Leaves a mark.
#[allow(
    unsafe_code,
    reason = "a volatile access to registers that nothing else here uses"
)]
pub fn mark(number: u32) {
    // SAFETY: the CRC unit has its clock, takes any word and touches no memory.
    unsafe { MARKS.write_volatile(number) };
}
