//! What a board's driver does for its pins.

use super::display::{DisplayPins, DisplayRecords};
use super::nucleo::{Nucleo, Pins};
use super::sensor::SensorPins;
use hil_sim_core::run::recording::ScanRecord;
use hil_sim_core::scene::fault::Fault;

/// What the driver does for one board's pins beyond the seam itself.
pub trait BoardPins: Pins {
    /// What is written down at the pins.
    type Records: Send;

    /// Takes what has been written down since the last call.
    fn take_records(board: &mut Nucleo<Self>) -> Self::Records
    where
        Self: Sized;

    /// Sees every write of the firmware to a peripheral.
    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64)
    where
        Self: Sized;

    /// `fault` begins, or ends, at the pins.
    fn break_pins(_board: &mut Nucleo<Self>, _fault: &Fault, _begins: bool, _at_ns: u64)
    where
        Self: Sized,
    {
    }
}

impl BoardPins for SensorPins {
    type Records = Vec<ScanRecord>;

    fn take_records(board: &mut Nucleo<Self>) -> Vec<ScanRecord> {
        std::mem::take(&mut board.pins().0.scans)
    }

    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64) {
        let (pins, part) = board.pins();
        pins.on_write(part, address, value, at_ns);
    }
}

impl BoardPins for DisplayPins {
    type Records = DisplayRecords;

    fn take_records(board: &mut Nucleo<Self>) -> DisplayRecords {
        let (pins, part) = board.pins();
        pins.leave(part)
    }

    fn on_write(board: &mut Nucleo<Self>, address: u64, value: u64, at_ns: u64) {
        let (pins, part) = board.pins();
        pins.on_write(part, address, value, at_ns);
    }

    fn break_pins(board: &mut Nucleo<Self>, fault: &Fault, begins: bool, at_ns: u64) {
        let (pins, part) = board.pins();
        pins.break_by(part, fault, begins, at_ns);
    }
}
