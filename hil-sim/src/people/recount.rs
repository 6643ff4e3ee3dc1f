//! The paper's own Tables III and IV, counted again.

use crate::people::interval::{Interval, middle};
use crate::people::mosteller::{Extreme, Test, test};
use crate::people::pairs::Pair;
use crate::people::published::{SAMPLES_MM, TABLE_3};
use crate::people::thurstone::{Scale, scale};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What follows from the paper's Table III.
#[derive(Clone, Debug, PartialEq)]
pub struct Recount {
    /// Table IV: the cell of 1.00 left out.
    pub scale: Scale,
    /// Of each score, by the bootstrap of [`resampled`].
    pub intervals: Vec<Option<Interval>>,
    /// Mosteller's test with that cell at 0.95, which is the paper's χ².
    pub half_an_answer: Test,
    /// With that cell left out of the test, too.
    pub left_out: Test,
    /// With that cell at 1.
    pub as_it_is: Test,
}

impl Recount {
    /// Counts again. The bootstrap's chance comes from the seed; none if the paper's numbers gave no scale,
    /// which they do.
    pub fn new(repetitions: u32, seed: u64) -> Option<Self> {
        let scale = scale(SAMPLES_MM.len(), &TABLE_3).ok()?;
        let tested = |extreme| test(&scale.scores, &TABLE_3, extreme);
        Some(Self {
            half_an_answer: tested(Extreme::HalfAnAnswer)?,
            left_out: tested(Extreme::LeftOut)?,
            as_it_is: tested(Extreme::AsItIs)?,
            intervals: resampled(&TABLE_3, repetitions, seed),
            scale,
        })
    }
}

/// The middle 95 % of each score over a parametric bootstrap: each pair's answers are drawn anew from the
/// share (k + ½)/(n + 1), so that a share of 1 may also have been a lucky one. Tables that give no scale
/// do not count.
fn resampled(pairs: &[Pair], repetitions: u32, seed: u64) -> Vec<Option<Interval>> {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
    let scales: Vec<Scale> = (0..repetitions)
        .filter_map(|_| {
            let drawn: Vec<Pair> = pairs
                .iter()
                .map(|pair| {
                    let share = (pair.correct + 0.5) / (pair.trials + 1.0);
                    let correct = (0..pair.trials as u32)
                        .filter(|_| draws.random::<f64>() < share)
                        .count();
                    Pair {
                        correct: correct as f64,
                        ..*pair
                    }
                })
                .collect();
            scale(SAMPLES_MM.len(), &drawn).ok()
        })
        .collect();
    (0..SAMPLES_MM.len())
        .map(|sample| middle(scales.iter().map(|scale| scale.scores[sample]).collect()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_numbers_are_met_and_its_verdict_is_not() {
        let recount = Recount::new(500, 1).unwrap();
        for test in [recount.half_an_answer, recount.left_out, recount.as_it_is] {
            assert!(test.rejects(), "{test:?}");
        }
        assert_eq!(recount.left_out.freedom, 2);
        for (score, interval) in recount.scale.scores.iter().zip(&recount.intervals).skip(1) {
            let interval = interval.unwrap();
            assert!(interval.low < *score && *score < interval.high);
        }
    }
}
