//! Thurstone's Case V: a scale from paired comparisons.
//!
//! The deviate of the share in which i is placed above j is sᵢ − sⱼ, the standard deviation of a difference
//! being the unit. A share of 0 or 1 has no deviate and is left out; the scale is the least squares of what
//! remains, with the first sample at 0. (With no share left out that is the mean of each sample's deviates.)

use thiserror::Error;

use crate::psychophysics::pair::Pair;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "no scale: without the {left_out} pairs that were always answered alike, nothing ties sample {sample} to the first"
)]
pub struct Unconnected {
    pub left_out: usize,
    /// The first sample that has no tie, counted from 1.
    pub sample: usize,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// The score of each sample; the first is 0.
    pub scores: Vec<f64>,
    /// Pairs that were left out because of a share of 0 or 1.
    pub left_out: usize,
}

/// Scales so many samples.
///
/// # Errors
/// If the pairs that can be used do not tie every sample to the first.
pub fn scale(samples: usize, pairs: &[Pair]) -> Result<Scale, Unconnected> {
    let used = || pairs.iter().filter(|pair| pair.deviate().is_finite());
    let left_out = pairs.len() - used().count();
    // The normal equations of all scores but the first, the right side as the last column.
    let unknowns = samples - 1;
    let mut rows = vec![vec![0.0; unknowns + 1]; unknowns];
    for pair in used() {
        for (sample, other, sign) in [
            (pair.longer, pair.shorter, 1.0),
            (pair.shorter, pair.longer, -1.0),
        ] {
            let Some(row) = sample.checked_sub(1) else {
                continue;
            };
            rows[row][row] += 1.0;
            if let Some(column) = other.checked_sub(1) {
                rows[row][column] -= 1.0;
            }
            rows[row][unknowns] += sign * pair.deviate();
        }
    }
    /// What whole numbers leave of a pivot that is 0.
    const NOTHING: f64 = 1e-9;
    for pivot in 0..unknowns {
        if rows[pivot][pivot].abs() < NOTHING {
            let sample = pivot + 2;
            return Err(Unconnected { left_out, sample });
        }
        let of_pivot = rows[pivot].clone();
        for (at, row) in rows.iter_mut().enumerate() {
            let factor = row[pivot] / of_pivot[pivot];
            if at != pivot {
                for (value, of_pivot) in row.iter_mut().zip(&of_pivot) {
                    *value -= factor * of_pivot;
                }
            }
        }
    }
    let scores = rows
        .iter()
        .enumerate()
        .map(|(at, row)| row[unknowns] / row[at]);
    Ok(Scale {
        scores: std::iter::once(0.0).chain(scores).collect(),
        left_out,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::psychophysics::normal;
    use crate::psychophysics::published::TABLE_3;

    #[test]
    fn table_4_follows_from_table_3_without_the_cell_of_one() {
        let scale = scale(4, &TABLE_3).unwrap();
        assert_eq!(scale.left_out, 1);
        for (score, expected) in scale.scores.iter().zip([0.0, 0.5461, 1.0923, 1.4491]) {
            // To the four decimals that they are given with.
            assert!((score - expected).abs() <= 0.00005, "{score} {expected}");
        }
    }

    #[test]
    fn shares_that_come_of_a_scale_give_it_back() {
        let scores = [0.0, 0.4, 1.5, 1.1];
        let pairs: Vec<Pair> = crate::psychophysics::pair::of(4)
            .map(|(shorter, longer)| Pair {
                shorter,
                longer,
                correct: 100.0 * normal::cdf(scores[longer] - scores[shorter]),
                trials: 100.0,
            })
            .collect();
        for (score, expected) in scale(4, &pairs).unwrap().scores.iter().zip(scores) {
            assert!((score - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn samples_that_nobody_ever_confused_have_no_scale() {
        let mut pairs = TABLE_3;
        for pair in &mut pairs {
            if pair.longer == 3 {
                pair.correct = pair.trials;
            }
        }
        let refused = scale(4, &pairs).unwrap_err();
        assert_eq!(
            refused,
            Unconnected {
                left_out: 3,
                sample: 4
            }
        );
        for pair in &mut pairs {
            pair.correct = pair.trials;
        }
        assert_eq!(scale(4, &pairs).unwrap_err().sample, 2);
    }
}
