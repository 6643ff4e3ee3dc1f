//! What is told of a run while it goes on: to whoever writes it down, or judges it.
//!
//! ```text
//! native ─┬─────────────────────────────┐
//!         └─> Recording ─> replay_to ───┼─> judges
//! elf ──────> Recording ─> replay_to ───┘
//! ```
//!
//! A judge keeps only what it still needs, so that a run that is told to it directly needs no more memory
//! the longer it lasts, but for its estimates and a few numbers for each cycle of the stimulus.

use std::iter::Peekable;

use protocol::{Estimate, Role};

use crate::run::decoder::TimedMessage;
use crate::run::fault_evidence::Reset;
use crate::run::recording::{
    Arrival, EstimateRecord, OutputRecord, Recording, ScanRecord, TickRecord,
};

/// What happens in a run. Of one instant, what is further up here comes first.
#[derive(Clone, Copy, Debug)]
pub enum RunEvent<'a> {
    /// An ADC scan.
    Scan(&'a ScanRecord),
    /// The sensor has made an estimate, at an instant in ns since the scene's start.
    Estimate(u64, &'a Estimate),
    /// A tick of the display's.
    Tick(&'a TickRecord),
    /// The outputs have changed.
    Output(&'a OutputRecord),
    /// An estimate has arrived at the display, be it the sensor's or a forged one: told then, or as late as at
    /// the display's next tick.
    Received(&'a Arrival),
    /// What a board sent, in which a fault may show.
    Said(Role, &'a TimedMessage),
    /// A board was reset.
    Reset(&'a Reset),
    /// CLR fell, at an instant in ns since the scene's start.
    Cleared(u64),
}

/// Is told of a run, in the order of time.
pub trait RunObserver {
    /// Takes the next of what happens.
    fn see(&mut self, event: RunEvent<'_>);
}

/// Nobody.
impl RunObserver for () {
    fn see(&mut self, _event: RunEvent<'_>) {}
}

impl<O: RunObserver> RunObserver for [O] {
    fn see(&mut self, event: RunEvent<'_>) {
        self.iter_mut().for_each(|observer| observer.see(event));
    }
}

impl<O: RunObserver> RunObserver for Option<O> {
    fn see(&mut self, event: RunEvent<'_>) {
        self.as_mut_slice().see(event);
    }
}

/// All three.
impl<A: RunObserver, B: RunObserver, C: RunObserver> RunObserver for (A, B, C) {
    fn see(&mut self, event: RunEvent<'_>) {
        self.0.see(event);
        self.1.see(event);
        self.2.see(event);
    }
}

/// Writes everything down.
impl RunObserver for Recording {
    fn see(&mut self, event: RunEvent<'_>) {
        match event {
            RunEvent::Scan(scan) => self.scans.push(*scan),
            RunEvent::Estimate(made_ns, estimate) => self.estimates.push(EstimateRecord {
                made_ns,
                received_ns: None,
                estimate: *estimate,
            }),
            RunEvent::Tick(tick) => self.ticks.push(*tick),
            RunEvent::Output(output) => self.outputs.push(*output),
            RunEvent::Received(arrival) => self.arrived.push(*arrival),
            RunEvent::Said(Role::Sensor, said) => self.signs.sensor.push(said.clone()),
            RunEvent::Said(Role::Display, said) => self.signs.display.push(said.clone()),
            RunEvent::Said(Role::Host, _) => {}
            RunEvent::Reset(reset) => self.signs.resets.push(*reset),
            RunEvent::Cleared(at_ns) => self.signs.clears_ns.push(at_ns),
        }
    }
}

/// Tells of a run as it was recorded, in the order of time.
pub fn replay_to(recording: &Recording, to: &mut impl RunObserver) {
    type Events<'a> = Peekable<Box<dyn Iterator<Item = (u64, RunEvent<'a>)> + 'a>>;
    let scans = recording.scans.iter();
    let made = recording.estimates.iter();
    let ticks = recording.ticks.iter();
    let outputs = recording.outputs.iter();
    let arrivals = recording.arrived.iter();
    let signs = &recording.signs;
    let of_display = signs.display.iter();
    let of_sensor = signs.sensor.iter();
    let resets = signs.resets.iter();
    let clears_ns = signs.clears_ns.iter();
    let mut all: [Events; 9] = [
        Box::new(scans.map(|scan| (scan.at_ns, RunEvent::Scan(scan))))
            as Box<dyn Iterator<Item = _>>,
        Box::new(made.map(|made| {
            (
                made.made_ns,
                RunEvent::Estimate(made.made_ns, &made.estimate),
            )
        })),
        Box::new(ticks.map(|tick| (tick.at_ns, RunEvent::Tick(tick)))),
        Box::new(outputs.map(|output| (output.at_ns, RunEvent::Output(output)))),
        Box::new(arrivals.map(|arrival| (arrival.at_ns, RunEvent::Received(arrival)))),
        Box::new(of_display.map(|said| (said.at_ns, RunEvent::Said(Role::Display, said)))),
        Box::new(of_sensor.map(|said| (said.at_ns, RunEvent::Said(Role::Sensor, said)))),
        Box::new(resets.map(|reset| (reset.at_ns, RunEvent::Reset(reset)))),
        Box::new(clears_ns.map(|&at_ns| (at_ns, RunEvent::Cleared(at_ns)))),
    ]
    .map(Iterator::peekable);
    // The first of those that come at the same instant.
    while let Some((_, event)) = all
        .iter_mut()
        .filter_map(|events| Some((events.peek()?.0, events)))
        .min_by_key(|&(at_ns, _)| at_ns)
        .and_then(|(_, events)| events.next())
    {
        to.see(event);
    }
}
