//! What the processor has instructions for, but core on it has not, or only as calls.

/// √x, rounded to nearest as IEEE 754 has it: the same bits everywhere. NaN for a negative x.
///
/// `libm` computes it in software on the boards, whose processor takes 14 cycles for it.
pub fn sqrt(x: f32) -> f32 {
    // The ABI that passes floats in registers says that there is a unit with single precision.
    #[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
    #[allow(
        unsafe_code,
        reason = "core has no function that becomes this instruction"
    )]
    {
        let mut bits = x.to_bits();
        // SAFETY: it changes one register, which it says; at most it raises a flag of inexactness. The detour
        // by a general one is for the compiler, which lends no other on this target.
        unsafe {
            core::arch::asm!(
                "vmov s0, {bits}",
                "vsqrt.f32 s0, s0",
                "vmov {bits}, s0",
                bits = inout(reg) bits,
                out("s0") _,
                options(pure, nomem, nostack),
            );
        }
        f32::from_bits(bits)
    }
    #[cfg(not(all(target_arch = "arm", target_abi = "eabihf")))]
    libm::sqrtf(x)
}

/// The larger of two; `other` where one of them is no number.
///
/// `f32::max` is a call on the boards, for what it promises of numbers that are none.
#[inline(always)]
pub fn larger(one: f32, other: f32) -> f32 {
    if one > other { one } else { other }
}

/// The smaller of two; `other` where one of them is no number. See [`larger`].
#[inline(always)]
pub fn smaller(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}
