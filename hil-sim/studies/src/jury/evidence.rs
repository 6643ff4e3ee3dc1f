//! The weights of the default estimator's evidence: a logistic regression over strangers.
//!
//! Each estimate on a stranger's record has one supposition or two, each with its clues; the regression finds the
//! weights with which they tell best whether λ̂ is within 5 % of the truth. Every trial counts alike.

use firmware_sensor::Sensor;
use firmware_sensor::spectrum::evidence::{LINE_CLUES, WAVE_CLUES};
use firmware_sensor::spectrum::{HIGHEST_HZ, LONGEST_MM, LOWEST_HZ, SHORTEST_MM, Weighed};
use protocol::{Contact, SensorConfiguration};

use super::counts::RIGHT;
use super::play::MOVING_MM_S;
use super::stranger::Record;

/// One estimate in so many is looked at: neighbours say the same.
const STRIDE: usize = 4;
/// Steps of the regression: it has converged after eight or so.
const STEPS: usize = 20;
/// What keeps weights finite where clues tell everything apart, relative to the trials' number.
const RIDGE: f64 = 1e-5;

/// Clues of a supposition, and whether it was right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case<const CLUES: usize> {
    /// What there is to weigh.
    pub clues: [f32; CLUES],
    /// λ̂ was within 5 % of the truth.
    pub right: bool,
    /// What it counts for, above 0.
    pub weight: f64,
}

/// The cases of a trial, or of many.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cases {
    /// Of the averaged spectrum's line.
    pub line: Vec<Case<LINE_CLUES>>,
    /// Of the wave of the moment.
    pub wave: Vec<Case<WAVE_CLUES>>,
}

impl Cases {
    /// What the default estimator makes of `record`. All cases of a record weigh 1 together. Estimates that hint
    /// at stick and slip are left out: the estimator has a rule of its own for these.
    pub fn of(record: &Record) -> Self {
        let mut cases = Self::default();
        let mut sensor = Sensor::new(SensorConfiguration::DEFAULT);
        let mut estimates = 0;
        for (ms, (scans, &encoder)) in record.scans.iter().zip(&record.encoder).enumerate() {
            let output = sensor.step(1_000 * (ms as u64 + 1), scans, encoder);
            let Some(estimate) = output.estimate else {
                continue;
            };
            estimates += 1;
            let (speed_mm_s, truth_mm) = (record.speed_mm_s[ms].abs(), record.truth_mm[ms]);
            let between = truth_mm > 0.0 && record.travelled_mm[ms] == 0.0;
            let band = LOWEST_HZ * truth_mm..=HIGHEST_HZ * truth_mm;
            if !usize::is_multiple_of(estimates, STRIDE)
                || speed_mm_s <= MOVING_MM_S
                || between
                || (truth_mm > 0.0 && !band.contains(&speed_mm_s))
                || estimate.contact == Contact::StickSlip
            {
                continue;
            }
            if let Some(spectrum) = sensor.spectrum() {
                cases.take(spectrum.weighed(), truth_mm, speed_mm_s);
            }
        }
        let weight = 1.0 / (cases.line.len() + cases.wave.len()) as f64;
        cases.line.iter_mut().for_each(|case| case.weight = weight);
        cases.wave.iter_mut().for_each(|case| case.weight = weight);
        cases
    }

    fn take(&mut self, weighed: &Weighed, truth_mm: f32, speed_mm_s: f32) {
        let stands = |mm: f32| {
            (SHORTEST_MM..=LONGEST_MM).contains(&mm)
                && (LOWEST_HZ..=HIGHEST_HZ).contains(&(speed_mm_s / mm))
        };
        let right = |mm: f32| (mm - truth_mm).abs() <= RIGHT as f32 * truth_mm;
        if let Some((mm, evidence)) = weighed.line.filter(|(mm, _)| stands(*mm)) {
            self.line.push(Case {
                clues: evidence.clues(),
                right: right(mm),
                weight: 1.0,
            });
        }
        if let Some((mm, evidence)) = weighed.wave.filter(|(mm, _)| stands(*mm)) {
            self.wave.push(Case {
                clues: evidence.clues(),
                right: right(mm),
                weight: 1.0,
            });
        }
    }

    /// Adds another trial's.
    pub fn extend(&mut self, other: Self) {
        self.line.extend(other.line);
        self.wave.extend(other.wave);
    }
}

/// The weights, a constant before them, under which `cases` are likeliest: P = 1/(1 + e^−(w₀ + Σ wᵢ clueᵢ)), by
/// Newton's method. All zero without cases.
pub fn weights<const CLUES: usize>(cases: &[Case<CLUES>]) -> Vec<f64> {
    let size = CLUES + 1;
    let total: f64 = cases.iter().map(|case| case.weight).sum();
    if total <= 0.0 {
        return vec![0.0; size];
    }
    // On scales on which each clue has mean 0 and deviation 1.
    let mean_of = |of: &dyn Fn(&Case<CLUES>) -> f64| {
        cases.iter().map(|case| case.weight * of(case)).sum::<f64>() / total
    };
    let means: Vec<f64> = (0..CLUES)
        .map(|i| mean_of(&|case| f64::from(case.clues[i])))
        .collect();
    let deviations: Vec<f64> = (0..CLUES)
        .map(|i| {
            let away = |case: &Case<CLUES>| (f64::from(case.clues[i]) - means[i]).powi(2);
            mean_of(&away).sqrt().max(1e-9)
        })
        .collect();
    let mut found = vec![0.0; size];
    let mut terms = vec![1.0; size];
    for _ in 0..STEPS {
        let mut gradient: Vec<f64> = found.iter().map(|w| -RIDGE * total * w).collect();
        let mut curvature = vec![vec![0.0; size]; size];
        (0..size).for_each(|i| curvature[i][i] = RIDGE * total);
        for case in cases {
            for i in 0..CLUES {
                terms[i + 1] = (f64::from(case.clues[i]) - means[i]) / deviations[i];
            }
            let sum: f64 = terms.iter().zip(&found).map(|(x, w)| x * w).sum();
            let p = 1.0 / (1.0 + (-sum).exp());
            let miss = case.weight * (f64::from(u8::from(case.right)) - p);
            let spread = case.weight * p * (1.0 - p);
            for i in 0..size {
                gradient[i] += miss * terms[i];
                for j in 0..=i {
                    curvature[i][j] += spread * terms[i] * terms[j];
                }
            }
        }
        for (w, step) in found.iter_mut().zip(solved(curvature, gradient)) {
            *w += step;
        }
    }
    for i in 0..CLUES {
        found[i + 1] /= deviations[i];
        found[0] -= found[i + 1] * means[i];
    }
    found
}

/// x of A x = b by Cholesky's factor. A's lower triangle counts; it must be positive definite, which a ridge makes
/// sure of.
fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let size = b.len();
    for i in 0..size {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            let rest = a[i][j] - known;
            a[i][j] = if i == j { rest.sqrt() } else { rest / a[j][j] };
        }
        let known: f64 = (0..i).map(|k| a[i][k] * b[k]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|k| a[k][i] * b[k]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jury::dice::Dice;

    #[test]
    fn the_weights_are_those_that_the_cases_were_drawn_with() {
        const TRUE: [f64; 3] = [-0.5, 2.0, -1.0];
        let mut dice = Dice::new(1, 1);
        let cases: Vec<Case<2>> = (0..40_000)
            .map(|_| {
                let clues = [dice.between(0.0, 3.0), dice.between(-1.0, 4.0)];
                let sum = TRUE[0] + TRUE[1] * clues[0] + TRUE[2] * clues[1];
                Case {
                    clues: clues.map(|clue| clue as f32),
                    right: dice.chance(1.0 / (1.0 + (-sum).exp())),
                    weight: 1.0,
                }
            })
            .collect();
        for (found, truth) in weights(&cases).iter().zip(TRUE) {
            assert!((found - truth).abs() < 0.08, "{found} for {truth}");
        }
    }

    #[test]
    fn clues_that_tell_everything_apart_have_finite_weights() {
        let case = |clue: f32| Case {
            clues: [clue],
            right: clue > 0.0,
            weight: 1.0,
        };
        let found = weights(&[case(-1.0), case(1.0), case(-2.0), case(2.0)]);
        assert!(found.iter().all(|w| w.is_finite()), "{found:?}");
        assert!(found[1] > 1.0, "{found:?}");
    }

    #[test]
    fn a_linear_system_is_solved() {
        let a = vec![vec![4.0, 0.0], vec![2.0, 3.0]];
        for (x, truth) in solved(a, vec![10.0, 8.0]).iter().zip([1.75, 1.5]) {
            assert!((x - truth).abs() < 1e-12, "{x} for {truth}");
        }
    }

    #[test]
    fn no_cases_have_no_weights() {
        assert_eq!(weights::<2>(&[]), vec![0.0; 3]);
    }
}
