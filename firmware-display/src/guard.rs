//! What memory may be used for: code is only executed, data never, and the page at the stack's end is
//! not touched at all, so that a stack that is full faults instead of growing into what lies below it.
//!
//! cortex-m-rt starts the stack at RAM's end and lets it grow down, towards the statics.

use core::ptr::addr_of;

use cortex_m::peripheral::MPU;

/// A region of the memory protection unit (DDI 0403E, B3.5.9).
struct Region {
    base: u32,
    /// A power of two; `base` is a multiple of it.
    size: u32,
    use_for: Use,
}

/// MPU_RASR's access permissions, execute-never bit and memory type.
#[derive(Clone, Copy)]
#[repr(u32)]
enum Use {
    /// Read, executed; normal memory, written through.
    Code = 0b110 << 24 | 1 << 17,
    /// Read and written; normal memory, shared with the DMA.
    Data = 1 << 28 | 0b011 << 24 | 1 << 18 | 1 << 17,
    /// Read and written; device.
    Registers = 1 << 28 | 0b011 << 24 | 1 << 18 | 1 << 16,
    Nothing = 1 << 28,
}

const ENABLED: u32 = 1;
/// MPU_CTRL: what is in no region is as without a memory protection unit; off while a hard fault is
/// handled.
const DEFAULT_MAP_BEHIND: u32 = 1 << 2;
/// Larger than any stack frame that is touched only at its far end.
const GUARD: u32 = 4_096;

/// Puts the rules in force.
pub fn install(mpu: &MPU) {
    #[allow(unsafe_code, reason = "a symbol of the linker's")]
    let statics_end = {
        unsafe extern "C" {
            static _stack_end: u8;
        }
        addr_of!(_stack_end) as u32
    };
    // Where two overlap, the later one counts.
    let regions = [
        Region {
            base: 0x0800_0000,
            size: 2 << 20,
            use_for: Use::Code,
        },
        Region {
            base: 0x2000_0000,
            size: 256 << 10,
            use_for: Use::Data,
        },
        Region {
            base: 0x4000_0000,
            size: 512 << 20,
            use_for: Use::Registers,
        },
        Region {
            base: statics_end.next_multiple_of(GUARD),
            size: GUARD,
            use_for: Use::Nothing,
        },
    ];
    for (number, region) in (0..).zip(&regions) {
        let size = (region.size.trailing_zeros() - 1) << 1;
        #[allow(unsafe_code, reason = "registers that decide what may be accessed")]
        // SAFETY: code, data and registers are where the regions allow them; nothing lives between the
        // statics' end and the stack, which is far from there yet.
        unsafe {
            mpu.rnr.write(number);
            mpu.rbar.write(region.base);
            mpu.rasr.write(region.use_for as u32 | size | ENABLED);
        }
    }
    #[allow(unsafe_code, reason = "a register that decides what may be accessed")]
    // SAFETY: as above.
    unsafe {
        mpu.ctrl.write(DEFAULT_MAP_BEHIND | ENABLED);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
