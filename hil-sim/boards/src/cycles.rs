//! What a run would take on a Cortex-M4 at 168 MHz behind the STM32F4's flash: an estimate, made of the
//! instructions that an emulated board retires, one by one.
//!
//! | what | cycles, least and most | from |
//! | --- | --- | --- |
//! | an instruction | [`instruction::Instruction`] | the Cortex-M4's manual, table 3-1 |
//! | a branch that is taken | 1 and 3 more | the same |
//! | an exception | 12 to enter, 10 or 12 to leave | the same, 3.9.1 |
//! | a line of flash | 5 to wait for it | [`flash::Flash`] |
//! | a register of a peripheral | 0, and 1 to 9 more by its bus | a guess: see [`bus_wait`] |
//!
//! Not in it: constants that are read from the flash by a pointer, DMA's share of the buses, and the
//! registers of the floating-point unit that an interrupt has to save.

pub mod flash;
pub mod instruction;

use flash::Flash;
use instruction::Instruction;

/// The processor's clock, in Hz.
pub const CLOCK_HZ: u64 = 168_000_000;
/// To fill the pipeline again.
const REFILL: u64 = 3;
const LEAST_REFILL: u64 = 1;
/// To enter an exception, and to leave it.
const EXCEPTION: u64 = 12 + 12;
const LEAST_EXCEPTION: u64 = 12 + 10;

/// Which end of the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimate {
    /// The least cycles that the manual allows, the flash read ahead and cached.
    Least,
    /// The most.
    Most,
    /// The most, and the flash neither read ahead nor cached, as it is after a reset.
    Unaccelerated,
}

/// Counts the cycles of a run as it goes on.
#[derive(Debug)]
pub struct CycleMeter {
    /// By half the distance from `from`; none where no instruction begins.
    code: Vec<Option<Instruction>>,
    from: u64,
    flash: Flash,
    is_least: bool,
    /// Where the last instruction was, and what it is.
    last: Option<(u64, Instruction)>,
    cycles: u64,
}

impl CycleMeter {
    /// For a program whose code is `code`: the address of each instruction, and its first two halfwords, in
    /// order.
    pub fn new(code: &[(u64, [u16; 2])], estimate: Estimate) -> Self {
        let from = code.first().map_or(0, |first| first.0);
        let to = code.last().map_or(0, |last| last.0 + 2);
        let mut table = vec![None; ((to - from) / 2) as usize];
        for &(address, halfwords) in code {
            let place = ((address - from) / 2) as usize;
            table[place] = Some(Instruction::decode(address, halfwords));
        }
        Self {
            code: table,
            from,
            flash: Flash::new(estimate != Estimate::Unaccelerated),
            is_least: estimate == Estimate::Least,
            last: None,
            cycles: 0,
        }
    }

    /// The cycles so far.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// The instruction at `address` is retired next.
    pub fn retire(&mut self, address: u64) {
        let known = address
            .checked_sub(self.from)
            .and_then(|distance| self.code.get((distance / 2) as usize).copied().flatten());
        // Code that is not in the table is not in the flash.
        let Some(instruction) = known else {
            self.last = None;
            self.cycles += 1;
            return;
        };
        if let Some((before, last)) = self.last
            && before + last.bytes != address
        {
            self.cycles += match (last.branches, self.is_least) {
                (true, true) => LEAST_REFILL,
                (true, false) => REFILL,
                (false, true) => LEAST_EXCEPTION,
                (false, false) => EXCEPTION,
            };
        }
        self.cycles += self.flash.fetch(address, self.cycles);
        if let Some(literal) = instruction.literal {
            self.cycles += self.flash.read(literal);
        }
        self.cycles += if self.is_least {
            instruction.least
        } else {
            instruction.cycles
        };
        self.last = Some((address, instruction));
    }

    /// It reads or writes the register of a peripheral at `address`.
    pub fn access(&mut self, address: u64) {
        if !self.is_least {
            self.cycles += bus_wait(address);
        }
    }
}

/// Cycles that a register takes beyond those of any load: a guess, two of the bus's own clock and one to
/// come into step with it. APB1 has a quarter of the processor's clock, APB2 half.
const fn bus_wait(address: u64) -> u64 {
    match address >> 16 {
        0x4000 => 9,
        0x4001 => 5,
        0x4002 => 1,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `nop`, `b` back to it.
    const LOOP: [(u64, [u16; 2]); 2] = [
        (0x0800_0000, [0xBF00, 0xE7FD]),
        (0x0800_0002, [0xE7FD, 0xBF00]),
    ];

    #[test]
    fn a_loop_takes_its_instructions_and_a_refill_each_round() {
        let mut meter = CycleMeter::new(&LOOP, Estimate::Most);
        let mut before = 0;
        for round in 0..3 {
            meter.retire(0x0800_0000);
            meter.retire(0x0800_0002);
            let took = meter.cycles() - before;
            before = meter.cycles();
            // The first round waits for the line, and has no branch behind it.
            assert_eq!(took, if round == 0 { 7 } else { 5 });
        }
    }

    #[test]
    fn an_exception_is_told_from_a_branch() {
        let code = [
            (0x0800_0000, [0xBF00, 0xBF00]),
            (0x0800_0002, [0xBF00, 0xBF00]),
            (0x0800_0008, [0xBF00, 0xBF00]),
        ];
        let mut meter = CycleMeter::new(&code, Estimate::Most);
        meter.retire(0x0800_0000);
        let before = meter.cycles();
        meter.retire(0x0800_0008);
        assert_eq!(meter.cycles() - before, 1 + 24);
    }

    #[test]
    fn registers_take_longer_on_a_slower_bus() {
        let mut meter = CycleMeter::new(&LOOP, Estimate::Most);
        meter.access(0x4000_0C24);
        meter.access(0x4002_0014);
        assert_eq!(meter.cycles(), 9 + 1);
    }
}
