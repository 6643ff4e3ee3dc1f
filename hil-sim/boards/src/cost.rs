//! Counts the instructions between marks that a firmware leaves: no model of time, no cycles.

use std::collections::BTreeMap;
use std::path::Path;

use rigless::emulator::{self, Access, AccessKind, Driver, Host, Settled, Start, Stop};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::stm32f427::Stm32f427;
use rigless::time::VirtualNanos;

use super::nucleo::{Nucleo, Pins};
use super::{ElfError, FirmwareError};

/// Where a firmware writes its marks: the data register of the CRC unit, which nothing else uses.
const MARKS: u64 = 0x4002_3000;
/// Added to a part's number at its end.
const END: u64 = 100;
/// The mark after the last part.
const DONE: u64 = 999;
/// Virtual time after which a firmware that has not come to its end is given up.
const LIMIT: VirtualNanos = VirtualNanos(60_000_000_000);

/// Nothing on the pins.
#[derive(Debug)]
struct Bare;

impl Pins for Bare {
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
}

#[derive(Default)]
struct Marks {
    begun: BTreeMap<u64, u64>,
    taken: BTreeMap<u64, Taken>,
    done: bool,
}

impl Driver<Nucleo<Bare>> for Marks {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<Bare>>,
        _host: &mut dyn Host,
        settled: Settled,
    ) {
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
        if value == DONE {
            self.done = true;
            session.pause_at(Some(virtual_time));
        } else if let Some(begun) = value
            .checked_sub(END)
            .and_then(|part| self.begun.get(&part))
        {
            let piece = instruction_count - begun;
            let taken = self.taken.entry(value - END).or_default();
            taken.total += piece;
            taken.largest = taken.largest.max(piece);
            taken.pieces += 1;
        } else {
            self.begun.insert(value, instruction_count);
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

/// Instructions that each part of the ELF at `path` took, by the part's number.
///
/// # Errors
/// If the file can't be read or placed, or does not come to its end.
pub fn count(path: &Path) -> Result<BTreeMap<u64, u64>, ElfError> {
    let taken = measure(path)?;
    Ok(taken
        .into_iter()
        .map(|(k, taken)| (k, taken.total))
        .collect())
}

/// The same, piece by piece.
///
/// # Errors
/// As [`count`].
pub fn measure(path: &Path) -> Result<BTreeMap<u64, Taken>, ElfError> {
    measure_example(path, "firmware-sensor --example filter_cost")
}

/// The same of any ELF that leaves marks. `package` is what it is built with, behind `cargo build -p`.
///
/// # Errors
/// As [`count`].
pub fn measure_example(
    path: &Path,
    package: &'static str,
) -> Result<BTreeMap<u64, Taken>, ElfError> {
    let board = |reason: String| ElfError::Board {
        board: "bare",
        reason,
    };
    let elf = std::fs::read(path).map_err(|source| {
        ElfError::Firmware(FirmwareError::Missing {
            path: path.to_owned(),
            package,
            source,
        })
    })?;
    let image = Image::new(path, elf, None).map_err(|error| board(error.to_string()))?;
    let nucleo = Nucleo::new(Bare, |_| {}).map_err(|error| board(error.to_string()))?;
    let session =
        Session::new(Box::new(nucleo), 0, LIMIT).map_err(|error| board(error.to_string()))?;
    let finished = emulator::run(session, &Start::new(&[image]), Marks::default())
        .map_err(|error| board(error.to_string()))?;
    if finished.driver.done {
        Ok(finished.driver.taken)
    } else {
        Err(board(format!("{} never came to its end", path.display())))
    }
}
