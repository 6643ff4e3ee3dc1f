//! The paper's own Tables III and IV, counted again.

use crate::psychophysics::interval::{Interval, middle};
use crate::psychophysics::mosteller::{Extreme, LEVEL, Test, test};
use crate::psychophysics::normal;
use crate::psychophysics::pair::Pair;
use crate::psychophysics::published::{SAMPLES_MM, TABLE_3};
use crate::psychophysics::thurstone::{Scale, scale};

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
    /// The same χ² as the first, held against tables of ten trials a pair that are drawn from the scale itself
    /// instead of against χ²'s distribution, which is that of many trials.
    pub simulated: Test,
    /// In how many of those tables the test of the first rejects Case V, which holds in all of them: it should
    /// be 5 %.
    pub rejected_though_true: f64,
}

impl Recount {
    /// Counts again. The bootstrap's chance comes from the seed; none if the paper's numbers gave no scale,
    /// which they do.
    pub fn new(repetitions: u32, seed: u64) -> Option<Self> {
        let scale = scale(SAMPLES_MM.len(), &TABLE_3).ok()?;
        let tested = |extreme| test(&scale.scores, &TABLE_3, extreme);
        let half_an_answer = tested(Extreme::HalfAnAnswer)?;
        let true_tests = tests_of(&scale, repetitions, seed);
        let share = |holds: &dyn Fn(&Test) -> bool| {
            true_tests.iter().filter(|test| holds(test)).count() as f64 / true_tests.len() as f64
        };
        Some(Self {
            simulated: Test {
                critical: upper_end(&true_tests)?,
                p: share(&|test| test.chi_square >= half_an_answer.chi_square),
                ..half_an_answer
            },
            rejected_though_true: share(&Test::rejects),
            half_an_answer,
            left_out: tested(Extreme::LeftOut)?,
            as_it_is: tested(Extreme::AsItIs)?,
            intervals: resampled(&TABLE_3, repetitions, seed),
            scale,
        })
    }
}

/// Pairs whose answers are drawn anew from each one's share.
fn drawn(
    pairs: &[Pair],
    share: impl Fn(&Pair) -> f64,
    draws: &mut Xoshiro256PlusPlus,
) -> Vec<Pair> {
    let again = |pair: &Pair| {
        let share = share(pair);
        let answers = (0..pair.trials as u32).filter(|_| draws.random::<f64>() < share);
        Pair {
            correct: answers.count() as f64,
            ..*pair
        }
    };
    pairs.iter().map(again).collect()
}

/// The middle 95 % of each score over a parametric bootstrap: each pair's answers are drawn anew from the
/// share (k + ½)/(n + 1), so that a share of 1 may also have been a lucky one. Tables that give no scale
/// do not count.
fn resampled(pairs: &[Pair], repetitions: u32, seed: u64) -> Vec<Option<Interval>> {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
    let share = |pair: &Pair| (pair.correct + 0.5) / (pair.trials + 1.0);
    let scales: Vec<Scale> = (0..repetitions)
        .filter_map(|_| scale(SAMPLES_MM.len(), &drawn(pairs, share, &mut draws)).ok())
        .collect();
    (0..SAMPLES_MM.len())
        .map(|sample| middle(scales.iter().map(|scale| scale.scores[sample]).collect()))
        .collect()
}

/// Mosteller's test of tables in which Case V holds, with these scores. Tables that give no scale do not count.
fn tests_of(truth: &Scale, repetitions: u32, seed: u64) -> Vec<Test> {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
    let scores = &truth.scores;
    let share = |pair: &Pair| normal::cdf(scores[pair.longer] - scores[pair.shorter]);
    let test_of_one = |_| {
        let drawn = drawn(&TABLE_3, share, &mut draws);
        let scale = scale(SAMPLES_MM.len(), &drawn).ok()?;
        test(&scale.scores, &drawn, Extreme::HalfAnAnswer)
    };
    (0..repetitions).filter_map(test_of_one).collect()
}

/// What χ² is above in 5 % of the tests.
fn upper_end(tests: &[Test]) -> Option<f64> {
    let mut all: Vec<f64> = tests.iter().map(|test| test.chi_square).collect();
    all.sort_by(f64::total_cmp);
    let last = all.len().checked_sub(1)?;
    Some(all[((1.0 - LEVEL) * last as f64).round() as usize])
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
        // Shares of tables, one of them above the critical value as often as the level says.
        assert!((0.0..=1.0).contains(&recount.rejected_though_true));
        assert_eq!(
            recount.simulated.p < LEVEL,
            recount.half_an_answer.chi_square > recount.simulated.critical
        );
        for (score, interval) in recount.scale.scores.iter().zip(&recount.intervals).skip(1) {
            let interval = interval.unwrap();
            assert!(interval.low < *score && *score < interval.high);
        }
    }
}
