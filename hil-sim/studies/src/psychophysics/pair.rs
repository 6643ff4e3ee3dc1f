//! Two samples that are compared, and the answers.

use serde::Serialize;

use crate::psychophysics::normal;

/// The answers to one pair of samples, by their numbers in order of wavelength.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pair {
    pub shorter: usize,
    pub longer: usize,
    /// Trials in which the longer one was called longer; a fraction of them in the long run.
    pub correct: f64,
    pub trials: f64,
}

impl Pair {
    pub fn share(&self) -> f64 {
        self.correct / self.trials
    }

    pub fn deviate(&self) -> f64 {
        normal::quantile(self.share())
    }
}

/// All pairs of so many samples, the shorter one first.
pub fn of(samples: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..samples)
        .flat_map(move |shorter| (shorter + 1..samples).map(move |longer| (shorter, longer)))
}
