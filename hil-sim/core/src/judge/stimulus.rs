//! The stimulus as it goes on: each point of the outputs beside the phase due then, and where the hand turned.

use crate::judge::phase::{Due, DuePhase};
use crate::judge::track::Turns;
use crate::judge::truth::Truth;
use crate::judge::voltage::{Edge, Edges};
use crate::run::observer::{RunEvent, RunObserver};

/// What a tick tells of the stimulus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Told {
    /// The hand turned back, after so many cycles travelled.
    Turned(f64),
    /// The outputs, and the phase due then.
    Point(Edge, Due),
}

/// Puts the outputs beside the phase due, a tick after they have changed. To be taken from after each tick.
#[derive(Clone, Debug)]
pub struct Stimulus {
    due: DuePhase,
    turns: Turns,
    edges: Edges,
    turned_cycles: Option<f64>,
    /// Points before it can be told, in s.
    known_s: f64,
}

impl Stimulus {
    /// Before the first tick.
    pub fn new(truth: &Truth) -> Self {
        Self {
            due: DuePhase::new(truth),
            turns: Turns::default(),
            edges: Edges::new(truth.display.update_rate.hz()),
            turned_cycles: None,
            known_s: f64::NEG_INFINITY,
        }
    }

    /// What the last tick tells, in the order of time.
    pub fn take(&mut self) -> Option<Told> {
        if let Some(cycles) = self.turned_cycles.take() {
            return Some(Told::Turned(cycles));
        }
        let edge = self.edges.take_before(self.known_s)?;
        Some(Told::Point(edge, self.due.at(edge.t_s)))
    }

    /// There will be no more ticks: what follows the last one can be taken too.
    pub fn end(&mut self) {
        self.known_s = f64::INFINITY;
    }

    /// The wavenumber in force over the last tick's travel, in cycles per mm; 0 before there is any.
    pub fn in_force_per_mm(&self) -> f64 {
        self.due.in_force_per_mm()
    }

    /// The shortest λ̂ that has been in force, in mm.
    pub fn shortest_mm(&self) -> Option<f64> {
        self.due.shortest_mm()
    }

    /// How many points wait.
    pub fn held(&self) -> usize {
        self.edges.held()
    }
}

impl RunObserver for Stimulus {
    fn see(&mut self, event: RunEvent<'_>) {
        if let RunEvent::Tick(tick) = event
            && self.turns.turned(tick.position_mm)
        {
            self.turned_cycles = self.due.last().map(|due| due.travelled_cycles);
        }
        self.due.see(event);
        match event {
            RunEvent::Tick(_) => self.known_s = self.due.last().map_or(self.known_s, |due| due.t_s),
            RunEvent::Output(output) => self.edges.add(output),
            _ => {}
        }
    }
}
