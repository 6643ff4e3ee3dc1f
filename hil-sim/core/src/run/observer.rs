//! What is told of a run while it goes on: to whoever writes it down, or judges it.
//!
//! ```text
//! native ─┬──────────────────────────────────┐
//!         └─> Tape ─> Recording ─> retell ───┼─> judges
//! elf ──────────────> Recording ─> retell ───┘
//! ```
//!
//! A judge keeps only what it still needs, so that a run that is told to it directly needs no more memory
//! the longer it lasts, but for its estimates and a few numbers for each cycle of the stimulus.

use protocol::{Estimate, Role};

use crate::run::decoder::TimedMessage;
use crate::run::fault_evidence::{FaultEvidence, Reset};
use crate::run::recording::{Arrival, OutputRecord, Recording, ScanRecord, TickRecord};

/// Is told of a run, in the order of time. Of one instant, what is further up here comes first. Nobody needs
/// to listen to everything.
pub trait RunObserver {
    /// An ADC scan.
    fn scan(&mut self, _scan: &ScanRecord) {}

    /// The sensor has made an estimate, at an instant in ns since the scene's start.
    fn on_estimate(&mut self, _made_ns: u64, _estimate: &Estimate) {}

    /// A tick of the display's.
    fn tick(&mut self, _tick: &TickRecord) {}

    /// The outputs have changed.
    fn output(&mut self, _output: &OutputRecord) {}

    /// An estimate has arrived at the display, be it the sensor's or a forged one: told then, or as late as at
    /// the display's next tick.
    fn received(&mut self, _arrival: &Arrival) {}

    /// What a board sent, in which a fault may show.
    fn said(&mut self, _role: Role, _said: &TimedMessage) {}

    /// A board was reset.
    fn reset(&mut self, _reset: &Reset) {}

    /// CLR fell, at an instant in ns since the scene's start.
    fn cleared(&mut self, _at_ns: u64) {}
}

/// Nobody.
impl RunObserver for () {}

/// Tells of a run as it was recorded; what shows of faults comes at the end.
pub fn replay_to(recording: &Recording, to: &mut impl RunObserver) {
    let made = &recording.estimates;
    let mut scans = recording.scans.iter().peekable();
    let mut made = made.iter().peekable();
    let mut ticks = recording.ticks.iter().peekable();
    let mut outputs = recording.outputs.iter().peekable();
    let mut arrivals = recording.arrived.iter().peekable();
    // What is over comes last.
    const OVER_NS: u64 = u64::MAX;
    loop {
        let scan_ns = scans.peek().map_or(OVER_NS, |scan| scan.at_ns);
        let made_ns = made.peek().map_or(OVER_NS, |record| record.made_ns);
        let tick_ns = ticks.peek().map_or(OVER_NS, |tick| tick.at_ns);
        let output_ns = outputs.peek().map_or(OVER_NS, |output| output.at_ns);
        let arrival_ns = arrivals.peek().map_or(OVER_NS, |arrival| arrival.at_ns);
        let next_ns = [scan_ns, made_ns, tick_ns, output_ns, arrival_ns]
            .into_iter()
            .fold(OVER_NS, u64::min);
        if next_ns == OVER_NS {
            break;
        } else if scan_ns == next_ns {
            if let Some(scan) = scans.next() {
                to.scan(scan);
            }
        } else if made_ns == next_ns {
            if let Some(record) = made.next() {
                to.on_estimate(record.made_ns, &record.estimate);
            }
        } else if tick_ns == next_ns {
            if let Some(tick) = ticks.next() {
                to.tick(tick);
            }
        } else if output_ns == next_ns {
            if let Some(output) = outputs.next() {
                to.output(output);
            }
        } else if let Some(arrival) = arrivals.next() {
            to.received(arrival);
        }
    }
    retell_signs(&recording.signs, to);
}

/// Tells of what shows of faults alone.
pub fn retell_signs(signs: &FaultEvidence, to: &mut impl RunObserver) {
    for said in &signs.display {
        to.said(Role::Display, said);
    }
    for said in &signs.sensor {
        to.said(Role::Sensor, said);
    }
    for reset in &signs.resets {
        to.reset(reset);
    }
    for &at_ns in &signs.clears_ns {
        to.cleared(at_ns);
    }
}
