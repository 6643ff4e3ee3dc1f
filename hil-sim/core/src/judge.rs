//! Judging a run: what the estimates and the actuators did, in numbers.

pub mod actuators;
mod cycles;
mod displacement;
pub mod edges;
pub mod estimates;
pub mod event;
pub mod expectation;
pub mod fault;
pub mod felt;
pub mod mean;
mod middle;
pub mod needed;
pub mod outcome;
pub mod phase;
mod phase_error;
pub mod reaction;
pub mod spectrum;
mod standing;
mod stimulus;
pub mod synthetic;
pub mod track;
pub mod trust;
pub mod truth;
mod voltage;
mod words;

use protocol::Role;

use crate::judge::truth::Truth;
use crate::run::observer::{RunEvent, RunObserver, replay_to};
use crate::run::recording::Recording;

pub use actuators::{Actuators, Held};
pub use estimates::{JudgedEstimate, Summary};
use felt::Waves;

/// A recording, judged against its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Every estimate beside the truth, in the order they were made.
    pub estimates: Vec<JudgedEstimate>,
    /// The estimates as a whole.
    pub summary: Summary,
    /// What the actuators did.
    pub actuators: Actuators,
}

/// Judges a recording. What a recording is too short or too empty to tell is none, never NaN.
pub fn judge(truth: &Truth, recording: &Recording) -> Verdict {
    let mut judge = Judge::new(truth);
    replay_to(recording, &mut judge);
    judge.finish()
}

/// Judges a run as it goes on, the same as [`judge`] does once it is recorded. It keeps the estimates, a few
/// numbers for each cycle of the stimulus, and no more of the rest than the hand takes for a cycle.
pub struct Judge<'a> {
    estimates: estimates::Judge<'a>,
    actuators: actuators::Judge,
    felt: felt::Judge,
    needed: needed::Judge,
}

impl<'a> Judge<'a> {
    /// Before the run.
    pub fn new(truth: &Truth<'a>) -> Self {
        Self {
            estimates: estimates::Judge::new(truth),
            actuators: actuators::Judge::new(truth),
            felt: felt::Judge::default(),
            needed: needed::Judge::new(truth),
        }
    }

    /// The run, judged.
    pub fn finish(self) -> Verdict {
        let (estimates, summary) = self.estimates.finish();
        let felt = self.felt.finish();
        Verdict {
            estimates,
            summary: Summary {
                felt_right_share: felt.right_share,
                felt_wrong_share: felt.wrong_share,
                rendering_needed: self.needed.finish(),
                ..summary
            },
            actuators: self.actuators.finish(),
        }
    }

    /// How much is held of what is not the estimates.
    pub fn held(&self) -> Held {
        let held = self.actuators.held();
        Held {
            points: held.points + self.estimates.held(),
            ..held
        }
    }
}

impl RunObserver for Judge<'_> {
    fn see(&mut self, event: RunEvent<'_>) {
        self.estimates.see(event);
        self.actuators.see(event);
        match event {
            RunEvent::Tick(tick) => {
                let waves = Waves {
                    in_force_per_mm: self.actuators.in_force_per_mm(),
                    under_mm: self.estimates.under_mm(),
                };
                self.felt.tick(tick, waves);
                self.needed.tick(tick);
            }
            RunEvent::Output(output) => self.felt.output(output),
            RunEvent::Reset(reset) if reset.role == Role::Display => self.felt.restart(),
            RunEvent::Said(role, said) => self.needed.said(role, said),
            _ => {}
        }
    }
}

/// Speed above which arm and hand count as in motion, in mm/s: 5, and as much more as a speed worked out of two places
/// and instants may be off by rounding.
pub const MOTION_MM_S: f64 = 5.0 * (1.0 + 1e-9);

/// An instant of a recording in s.
pub fn seconds(at_ns: u64) -> f64 {
    at_ns as f64 / 1e9
}

/// None instead of a number that is not finite: JSON has no NaN.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The mean of the values; none if there are none.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value;
        count += 1;
    }
    finite(sum / count as f64)
}
