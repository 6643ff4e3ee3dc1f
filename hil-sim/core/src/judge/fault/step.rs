//! Whether the stimulus stays in step with the hand while something is broken.

use std::ops::Range;

use crate::judge::phase_error::Demodulator;
use crate::judge::seconds;
use crate::judge::stimulus::{Stimulus, Told};
use crate::judge::truth::Truth;
use crate::run::observer::RunObserver;
use crate::run::recording::{Arrival, OutputRecord, TickRecord, volts};

/// So long before a fault tells from where the phase goes on, in ns: a display that has started again counts from
/// another place than the scene.
const BEFORE_NS: u64 = 500_000_000;

/// The phase of the stimulus against the one due, before the fault and since.
#[derive(Clone, Debug)]
pub(super) struct Step {
    judged_ns: Range<u64>,
    stimulus: Stimulus,
    reference: usize,
    before: Demodulator,
    /// When the display last began to count anew before the fault, in s.
    restarted_s: f64,
    /// Where it stood before the fault, in cycles.
    standing: Option<f64>,
    since: Demodulator,
    peak_v: f64,
}

impl Step {
    pub fn new(truth: &Truth, judged_ns: Range<u64>) -> Self {
        Self {
            judged_ns,
            stimulus: Stimulus::new(truth),
            reference: truth.reference_actuator,
            before: Demodulator::new(truth.display.rendering),
            restarted_s: 0.0,
            standing: None,
            since: Demodulator::new(truth.display.rendering),
            peak_v: f64::from(truth.display.amplitude_mv) * 1e-3,
        }
    }

    /// The display has begun to count anew.
    pub fn restart(&mut self, at_ns: u64) {
        if at_ns < self.judged_ns.start {
            self.restarted_s = seconds(at_ns);
        }
    }

    /// Root mean square of what it is off since the fault, in cycles; none if too little was driven.
    pub fn finish(mut self) -> Option<f64> {
        self.stimulus.end();
        self.follow();
        Some(self.since.finish(self.peak_v)?.rms_cycles)
    }

    fn follow(&mut self) {
        let (from_s, to_s) = (seconds(self.judged_ns.start), seconds(self.judged_ns.end));
        let before_s = (from_s - BEFORE_NS as f64 * 1e-9).max(self.restarted_s);
        while let Some(told) = self.stimulus.take() {
            let Told::Point(edge, mut due) = told else {
                continue;
            };
            let volts = volts(edge.words[self.reference]);
            if (before_s..from_s).contains(&edge.t_s) {
                self.before.add(due, volts);
            } else if (from_s..to_s).contains(&edge.t_s) {
                let standing = *self.standing.get_or_insert_with(|| {
                    self.before.clone().standing(self.peak_v).unwrap_or(0.0)
                });
                due.cycles += standing;
                self.since.add(due, volts);
            }
        }
    }
}

impl RunObserver for Step {
    fn tick(&mut self, tick: &TickRecord) {
        self.stimulus.tick(tick);
        self.follow();
    }

    fn output(&mut self, output: &OutputRecord) {
        self.stimulus.output(output);
    }

    fn received(&mut self, arrival: &Arrival) {
        self.stimulus.received(arrival);
    }
}
