//! Judging a run: what the estimates and the actuators did, in numbers.

pub mod actuators;
mod cycles;
pub mod edges;
pub mod estimates;
pub mod mean;
mod middle;
pub mod phase;
mod phase_error;
pub mod reaction;
pub mod spectrum;
#[cfg(test)]
pub(crate) mod synthetic;
pub mod track;
mod voltage;
pub mod words;

use crate::recording::Recording;
use crate::truth::Truth;

pub use actuators::Actuators;
pub use estimates::{JudgedEstimate, Summary};

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
    let (estimates, summary) = estimates::judge(truth, recording);
    Verdict {
        estimates,
        summary,
        actuators: actuators::judge(truth, recording),
    }
}

/// An instant of a recording in s.
pub(crate) fn seconds(at_ns: u64) -> f64 {
    at_ns as f64 / 1e9
}

/// None instead of a number that is not finite: JSON has no NaN.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The mean of the values; none if there are none.
fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value;
        count += 1;
    }
    finite(sum / count as f64)
}
