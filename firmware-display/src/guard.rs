//! The stack's end: a page that nothing may touch, so that a stack that is full faults instead of
//! growing into what lies below it.
//!
//! cortex-m-rt starts the stack at RAM's end and lets it grow down, towards the statics.

use core::ptr::addr_of;

use cortex_m::peripheral::MPU;

/// Larger than any stack frame that is touched only at its far end.
const SIZE: u32 = 4_096;
/// MPU_RASR (DDI 0403E, B3.5.9): nothing may be executed or accessed, 2ⁿ⁺¹ bytes, enabled.
const NEVER_EXECUTED: u32 = 1 << 28;
const SIZE_FIELD: u32 = (SIZE.trailing_zeros() - 1) << 1;
const ENABLED: u32 = 1;
/// MPU_CTRL: on, everything else as without it; off while a hard fault is handled.
const PRIVILEGED_DEFAULT: u32 = 1 << 2;

/// Puts the page in place.
pub fn install(mpu: &MPU) {
    #[allow(unsafe_code, reason = "a symbol of the linker's")]
    let base = {
        unsafe extern "C" {
            static _stack_end: u8;
        }
        (addr_of!(_stack_end) as u32).next_multiple_of(SIZE)
    };
    #[allow(unsafe_code, reason = "registers that decide what may be accessed")]
    // SAFETY: nothing lives between the statics' end and the stack, which is far from there yet.
    unsafe {
        mpu.rnr.write(0);
        mpu.rbar.write(base);
        mpu.rasr.write(NEVER_EXECUTED | SIZE_FIELD | ENABLED);
        mpu.ctrl.write(PRIVILEGED_DEFAULT | ENABLED);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
