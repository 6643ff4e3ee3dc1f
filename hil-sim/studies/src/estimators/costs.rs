//! What every contestant costs on the Cortex-M4F: counted there, or estimated from its operations.

use std::collections::BTreeMap;
use std::path::Path;

use hil_sim_boards::ElfError;
use hil_sim_boards::cost::{Taken, measure_example};

use super::benchmark::Work;
use super::parts::{FRONT, TRANSFORM};
use super::pitch::operations_of_transform;

/// Milliseconds from one answer to the next.
const MS_PER_ANSWER: f64 =
    (firmware_sensor::SAMPLE_RATE_HZ / firmware_sensor::ESTIMATE_RATE_HZ) as f64;

/// Instructions of everything from the ADC's scans to λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    pub mean: f64,
    /// In the worst millisecond; none if estimated.
    pub worst: Option<f64>,
}

/// The counts of the example `estimator_cost`, part by part.
pub struct Costs(BTreeMap<u64, Taken>);

impl Costs {
    pub fn count(path: &Path) -> Result<Self, ElfError> {
        measure_example(path, "firmware-sensor --example estimator_cost").map(Self)
    }

    /// What a contestant costs; none if its part is missing in the ELF.
    ///
    /// The crates of YIN and McLeod need an allocator and a standard library. Their arithmetic is counted
    /// on the host, and an operation of theirs taken to cost as many instructions as one of a real
    /// Fourier transform does: the board's count of `microfft`'s over the operations of `realfft`'s at
    /// the same length. (Most of what either detector does is Fourier transforms.)
    pub fn of(&self, work: Work) -> Option<Cost> {
        match work {
            Work::Part(part) => self.part(part),
            Work::Operations(operations) => {
                let per_operation = self.part(TRANSFORM)?.mean / operations_of_transform() as f64;
                Some(Cost {
                    mean: self.part(FRONT)?.mean
                        + operations() as f64 * per_operation / MS_PER_ANSWER,
                    worst: None,
                })
            }
        }
    }

    fn part(&self, part: u32) -> Option<Cost> {
        let taken = self.0.get(&u64::from(part))?;
        Some(Cost {
            mean: taken.total as f64 / taken.pieces as f64,
            worst: Some(taken.largest as f64),
        })
    }
}
