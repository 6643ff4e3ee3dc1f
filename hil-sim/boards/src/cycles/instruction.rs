//! How long an instruction takes, by the Cortex-M4's Technical Reference Manual, table 3-1 and, for floating
//! point, table 7-1.

/// A load or a store of one word, and how much of that may overlap with the one before.
const LOAD: u64 = 2;
const OVERLAP: u64 = 1;
/// By how many bits the quotient has.
const LEAST_DIVIDE: u64 = 2;
const DIVIDE: u64 = 12;
const FLOAT_DIVIDE: u64 = 14;
const FLOAT_ROOT: u64 = 14;
const FLOAT_MULTIPLY_ADD: u64 = 3;

/// What of an instruction decides its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Its length.
    pub bytes: u64,
    /// The most cycles, without what a branch or the memory adds.
    pub cycles: u64,
    /// The least.
    pub least: u64,
    /// Whether another than the next one may follow it.
    pub branches: bool,
    /// The constant beside the code that it loads.
    pub literal: Option<u64>,
}

impl Instruction {
    /// The instruction at `address` that begins with these halfwords.
    pub fn decode(address: u64, [first, second]: [u16; 2]) -> Self {
        if first >> 11 >= 0b11101 {
            Self::wide(address, first, second)
        } else {
            Self::narrow(address, first)
        }
    }

    const fn taking(bytes: u64, cycles: u64) -> Self {
        Self {
            bytes,
            cycles,
            least: cycles,
            branches: false,
            literal: None,
        }
    }

    /// That overlaps with what is loaded or stored before it, if it can.
    const fn loading(self) -> Self {
        Self {
            least: self.cycles - OVERLAP,
            ..self
        }
    }

    const fn branching(self, branches: bool) -> Self {
        Self { branches, ..self }
    }

    fn narrow(address: u64, code: u16) -> Self {
        let taking = |cycles| Self::taking(2, cycles);
        let count = |mask: u16| u64::from((code & mask).count_ones());
        match code >> 12 {
            // ADD, CMP and MOV of any register, the program counter among them; BX, BLX.
            0x4 if code & 0xFC00 == 0x4400 => {
                let destination = ((code >> 4) & 8) | (code & 7);
                let is_jump = code & 0xFF00 == 0x4700;
                let compares = code & 0xFF00 == 0x4500;
                taking(1).branching(is_jump || (!compares && destination == 15))
            }
            0x4 if code & 0xF800 == 0x4800 => Self {
                literal: Some(((address + 4) & !3) + 4 * u64::from(code & 0xFF)),
                ..taking(LOAD).loading()
            },
            0x5..=0x9 => taking(LOAD).loading(),
            0xB if code & 0xFE00 == 0xB400 => taking(1 + count(0x1FF)),
            0xB if code & 0xFE00 == 0xBC00 => taking(1 + count(0x1FF)).branching(code & 0x100 != 0),
            // CBZ, CBNZ.
            0xB if code & 0xF500 == 0xB100 => taking(1).branching(true),
            0xC => taking(1 + count(0xFF)),
            // A branch on a condition; the last two of them are UDF and SVC.
            0xD | 0xE => taking(1).branching(true),
            _ => taking(1),
        }
    }

    fn wide(address: u64, first: u16, second: u16) -> Self {
        let taking = |cycles| Self::taking(4, cycles);
        let base = (address + 4) & !3;
        let of_base = first & 0xF == 15;
        if first & 0xEC00 == 0xEC00 && matches!((second >> 8) & 0xF, 0xA | 0xB) {
            return Self::float(address, first, second);
        }
        match first >> 9 {
            // Several registers.
            0b111_0100 if first & 0x40 == 0 => {
                let count = u64::from(second.count_ones());
                let loads_counter = first & 0x10 != 0 && second & 0x8000 != 0;
                taking(1 + count).branching(loads_counter)
            }
            // TBB, TBH.
            0b111_0100 if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 => Self {
                literal: Some(address + 4),
                ..taking(LOAD).branching(true)
            },
            // Two registers, or an exclusive one.
            0b111_0100 => taking(1 + 2),
            _ if first & 0xF800 == 0xF000 && second & 0x8000 != 0 => {
                let is_plain = second & 0x5000 == 0 && (first >> 6) & 0xE == 0xE;
                // MSR, MRS, barriers, hints.
                taking(if is_plain { 2 } else { 1 }).branching(!is_plain)
            }
            0b111_1100 => {
                let loads = first & 0x10 != 0;
                let offset = u64::from(second & 0xFFF);
                let below = first & 0x80 == 0;
                Self {
                    literal: (loads && of_base)
                        .then(|| if below { base - offset } else { base + offset }),
                    ..taking(LOAD)
                        .loading()
                        .branching(loads && second >> 12 == 15 && first & 0x60 == 0x40)
                }
            }
            _ if matches!(first & 0xFFF0, 0xFB90 | 0xFBB0) => Self {
                least: LEAST_DIVIDE,
                ..taking(DIVIDE)
            },
            _ => taking(1),
        }
    }

    fn float(address: u64, first: u16, second: u16) -> Self {
        let taking = |cycles| Self::taking(4, cycles);
        // Data processing, then moves to and from other registers, then loads and stores.
        if first & 0xFF00 == 0xEE00 && second & 0x10 == 0 {
            let subtracts_or_roots = (second >> 6) & 3 == 3;
            return taking(match (first >> 4) & 0xB {
                0x0 | 0x1 | 0x9 | 0xA => FLOAT_MULTIPLY_ADD,
                0x8 => FLOAT_DIVIDE,
                0xB if first & 0xF == 1 && subtracts_or_roots => FLOAT_ROOT,
                _ => 1,
            });
        }
        if first & 0xFF00 == 0xEE00 {
            return taking(1);
        }
        if first & 0xFFE0 == 0xEC40 {
            return taking(2);
        }
        let words = u64::from(second & 0xFF);
        if first & 0xFF20 == 0xED00 {
            let base = (address + 4) & !3;
            let below = first & 0x80 == 0;
            let offset = 4 * words;
            return Self {
                literal: (first & 0x1F == 0x1F)
                    .then(|| if below { base - offset } else { base + offset }),
                ..taking(LOAD).loading()
            };
        }
        taking(1 + words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `llvm-mc` encodes them.
    #[test]
    fn instructions_take_what_the_manual_says() {
        let of = |first, second| Instruction::decode(0x0800_0100, [first, second]);
        let cycles = |first, second| of(first, second).cycles;
        assert_eq!(cycles(0xBF00, 0), 1, "nop");
        assert_eq!(cycles(0x4348, 0), 1, "muls r0, r1, r0");
        assert_eq!(cycles(0x6808, 0), 2, "ldr r0, [r1]");
        assert_eq!(cycles(0xB5F0, 0), 6, "push {{r4-r7, lr}}");
        assert_eq!(cycles(0xE92D, 0x4FF0), 10, "push.w {{r4-r11, lr}}");
        assert_eq!(cycles(0xE9D0, 0x1200), 3, "ldrd r1, r2, [r0]");
        assert_eq!(cycles(0xFBB0, 0xF0F1), 12, "udiv r0, r0, r1");
        assert_eq!(cycles(0xFB90, 0xF0F1), 12, "sdiv r0, r0, r1");
        assert_eq!(cycles(0xFBA0, 0x0102), 1, "umull r0, r1, r0, r2");
        assert_eq!(cycles(0xEE30, 0x0A20), 1, "vadd.f32 s0, s0, s1");
        assert_eq!(cycles(0xEE20, 0x0A20), 1, "vmul.f32 s0, s0, s1");
        assert_eq!(cycles(0xEE00, 0x0A81), 3, "vmla.f32 s0, s1, s2");
        assert_eq!(cycles(0xEEA0, 0x0A81), 3, "vfma.f32 s0, s1, s2");
        assert_eq!(cycles(0xEE80, 0x0A20), 14, "vdiv.f32 s0, s0, s1");
        assert_eq!(cycles(0xEEB1, 0x0AC0), 14, "vsqrt.f32 s0, s0");
        assert_eq!(cycles(0xEEB1, 0x0A40), 1, "vneg.f32 s0, s0");
        assert_eq!(cycles(0xEEB4, 0x0A60), 1, "vcmp.f32 s0, s1");
        assert_eq!(cycles(0xEE00, 0x0A10), 1, "vmov s0, r0");
        assert_eq!(cycles(0xED90, 0x0A00), 2, "vldr s0, [r0]");
        assert_eq!(cycles(0xED2D, 0x8A10), 17, "vpush {{s16-s31}}");
    }

    #[test]
    fn branches_are_known() {
        let branches = |first, second| Instruction::decode(0x0800_0100, [first, second]).branches;
        for (first, second, name) in [
            (0xE7FE, 0, "b ."),
            (0xD0FE, 0, "beq ."),
            (0x4770, 0, "bx lr"),
            (0x4798, 0, "blx r3"),
            (0x469F, 0, "mov pc, r3"),
            (0xB100, 0, "cbz r0"),
            (0xB900, 0, "cbnz r0"),
            (0xBD10, 0, "pop {r4, pc}"),
            (0xF000, 0xF800, "bl"),
            (0xF000, 0xB800, "b.w"),
            (0xF000, 0x8000, "beq.w"),
            (0xE8BD, 0x8FF0, "pop.w {r4-r11, pc}"),
            (0xE8DF, 0xF000, "tbb [pc, r0]"),
            (0xF85D, 0xFB04, "ldr.w pc, [sp], #4"),
        ] {
            assert!(branches(first, second), "{name}");
        }
        for (first, second, name) in [
            (0xBD10 & !0x100, 0, "pop {r4}"),
            (0xE8BD, 0x0FF0, "pop.w {r4-r11}"),
            (0x4618, 0, "mov r0, r3"),
            (0xF3EF, 0x8010, "mrs r0, primask"),
            (0xF3BF, 0x8F4F, "dsb sy"),
            (0xF8D0, 0x1004, "ldr.w r1, [r0, #4]"),
            (0xBF08, 0, "it eq"),
            (0xB510, 0, "push {r4, lr}"),
        ] {
            assert!(!branches(first, second), "{name}");
        }
    }

    #[test]
    fn a_constant_beside_the_code_is_found() {
        let literal = |at, first, second| Instruction::decode(at, [first, second]).literal;
        assert_eq!(literal(0x102, 0x4801, 0), Some(0x108), "ldr r0, [pc, #4]");
        assert_eq!(
            literal(0x100, 0xF8DF, 0x0010),
            Some(0x114),
            "ldr.w r0, [pc, #16]"
        );
        assert_eq!(
            literal(0x100, 0xF85F, 0x0010),
            Some(0x0F4),
            "ldr.w r0, [pc, #-16]"
        );
        assert_eq!(
            literal(0x100, 0xED9F, 0x0A02),
            Some(0x10C),
            "vldr s0, [pc, #8]"
        );
        assert_eq!(literal(0x100, 0xED90, 0x0A02), None, "vldr s0, [r0, #8]");
    }
}
