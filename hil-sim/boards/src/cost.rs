//! Counts the instructions between marks that a firmware leaves, and estimates their cycles if it is asked to.

use std::collections::BTreeMap;
use std::path::Path;

use rigless::emulator::{
    Access, AccessKind, Driver, Hit, HitKind, Host, Settled, Start, Stop, Watch,
};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::stm32f427::Stm32f427;
use rigless::time::VirtualNanos;

use super::ElfError;
use super::firmware::read_elf;
use super::nucleo::{Nucleo, Pins};
use crate::cycles::{CycleMeter, Estimate};
use crate::instructions::instructions;

/// Where a firmware writes its marks: the data register of the CRC unit, which nothing else uses.
const MARKS: u64 = 0x4002_3000;
/// Added to a part's number at its end.
const END: u64 = 100;
/// The mark after the last part.
const DONE: u64 = 999;
/// Virtual time after which a firmware that has not come to its end is given up.
const LIMIT: VirtualNanos = VirtualNanos(60_000_000_000);

/// What is said of a board without a role.
pub(super) const BOARD: &str = "bare";

/// Nothing on the pins.
#[derive(Debug)]
pub(super) struct Bare;

impl Pins for Bare {
    type Records = ();

    fn take_records(&mut self) {}

    fn on_trigger(&mut self, _part: &mut Stm32f427, _at_ns: u64) -> u16 {
        0
    }
}

/// The instructions of a part, which may come in pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// Of all pieces.
    pub total: u64,
    /// Of the largest piece.
    pub largest: u64,
    /// How many pieces.
    pub pieces: u64,
    /// Processor cycles of all pieces, estimated; 0 if nobody asked for them.
    pub cycles: u64,
    /// Those of the piece with the most.
    pub largest_cycles: u64,
}

#[derive(Default)]
struct Marks {
    /// Instructions and cycles at the beginning of each part's last piece.
    begun: BTreeMap<u64, (u64, u64)>,
    taken: BTreeMap<u64, Taken>,
    done: bool,
    /// Where each instruction begins, until they are watched.
    code: Vec<u64>,
    /// The parts whose cycles are wanted begin with this one.
    metered_from: u64,
    meter: Option<CycleMeter>,
}

impl Driver<Nucleo<Bare>> for Marks {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<Bare>>,
        host: &mut dyn Host,
        settled: Settled,
    ) {
        if let (
            Some(meter),
            Settled::Hit(Hit {
                kind: HitKind::Instruction,
                address,
                ..
            }),
        ) = (&mut self.meter, settled)
        {
            meter.retire(address);
            return;
        }
        let Settled::Access {
            access:
                Access {
                    kind: AccessKind::Write,
                    address: MARKS,
                    value,
                    instruction_count,
                    virtual_time,
                    ..
                },
            ..
        } = settled
        else {
            return;
        };
        let cycles = self.meter.as_ref().map_or(0, CycleMeter::cycles);
        if (self.metered_from..END).contains(&value) {
            for address in std::mem::take(&mut self.code) {
                host.watch(Watch::Instruction(address));
            }
        }
        if value == DONE {
            self.done = true;
            session.pause_at(Some(virtual_time));
        } else if let Some((begun, cycles_before)) = value
            .checked_sub(END)
            .and_then(|part| self.begun.get(&part))
        {
            let piece = instruction_count - begun;
            let piece_cycles = cycles - cycles_before;
            let taken = self.taken.entry(value - END).or_default();
            taken.total += piece;
            taken.largest = taken.largest.max(piece);
            taken.pieces += 1;
            taken.cycles += piece_cycles;
            taken.largest_cycles = taken.largest_cycles.max(piece_cycles);
        } else {
            self.begun.insert(value, (instruction_count, cycles));
        }
    }

    fn on_stop(
        &mut self,
        _session: &mut Session<Nucleo<Bare>>,
        stop: Stop,
        _host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        (!self.done && stop.at < LIMIT).then_some(LIMIT)
    }
}

/// What each part of the ELF at `path` took, by the part's number.
///
/// # Errors
/// If the file can't be read or placed, or does not come to its end.
pub fn measure(path: &Path) -> Result<BTreeMap<u64, Taken>, ElfError> {
    measure_example(path, "firmware-sensor --example filter_cost")
}

/// The same, with the cycles of the parts from `from` on, instruction by instruction: slow.
///
/// # Errors
/// As [`measure`].
pub fn meter(path: &Path, from: u64) -> Result<BTreeMap<u64, Taken>, ElfError> {
    run(path, "firmware-sensor --example filter_cost", Some(from))
}

/// The same of any ELF that leaves marks. `package` is what it is built with, behind `cargo build -p`.
///
/// # Errors
/// As [`measure`].
pub fn measure_example(
    path: &Path,
    package: &'static str,
) -> Result<BTreeMap<u64, Taken>, ElfError> {
    run(path, package, None)
}

fn run(
    path: &Path,
    package: &'static str,
    metered_from: Option<u64>,
) -> Result<BTreeMap<u64, Taken>, ElfError> {
    let elf = read_elf(path, package)?;
    let mut marks = Marks::default();
    if let Some(from) = metered_from {
        let code = instructions(&elf).ok_or("its code can't be read: it has no mapping symbols");
        let code = code.map_err(ElfError::board(BOARD))?;
        marks.meter = Some(CycleMeter::new(&code, Estimate::Most));
        marks.metered_from = from;
        marks.code = code.into_iter().map(|(address, _)| address).collect();
    }
    let image = Image::new(path, elf, None).map_err(ElfError::board(BOARD))?;
    let board = Nucleo::new(Bare, |_| {}).map_err(ElfError::board(BOARD))?;
    let finished = board
        .run(&Start::new(&[image]), LIMIT, marks)
        .map_err(ElfError::board(BOARD))?;
    if finished.driver.done {
        Ok(finished.driver.taken)
    } else {
        let never = format!("{} never came to its end", path.display());
        Err(ElfError::board(BOARD)(never))
    }
}
