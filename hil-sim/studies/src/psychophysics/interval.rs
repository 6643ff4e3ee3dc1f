//! Confidence intervals and small statistics.

use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::psychophysics::normal;

/// The confidence of all intervals.
const CONFIDENCE: f64 = 0.95;

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

/// Wilson's score interval, 95 %, of the share behind `correct` of `trials`, `trials` above 0.
pub fn wilson(correct: f64, trials: f64) -> Interval {
    let z = normal::quantile(0.5 + 0.5 * CONFIDENCE);
    let share = correct / trials;
    let shrink = 1.0 + z * z / trials;
    let middle = (share + z * z / (2.0 * trials)) / shrink;
    let spread = share * (1.0 - share) / trials + z * z / (4.0 * trials * trials);
    let half = z / shrink * spread.sqrt();
    Interval {
        low: (middle - half).max(0.0),
        high: (middle + half).min(1.0),
    }
}

/// The middle 95 % of values; none without any.
pub fn middle(mut values: Vec<f64>) -> Option<Interval> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = |share: f64| values[(share * last as f64).round() as usize];
    Some(Interval {
        low: at(0.5 - 0.5 * CONFIDENCE),
        high: at(0.5 + 0.5 * CONFIDENCE),
    })
}

/// How often a guesser, right in half of the trials, would do at least as well: the exact one-sided test.
pub fn guessing(correct: u32, trials: u32) -> f64 {
    let Some(fewer) = correct.checked_sub(1) else {
        return 1.0;
    };
    Binomial::new(0.5, u64::from(trials)).map_or(f64::NAN, |guesses| guesses.sf(u64::from(fewer)))
}

/// The mean; NaN without any value.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// The standard deviation with n − 1; NaN for fewer than two values.
pub(super) fn sample_deviation(values: &[f64]) -> f64 {
    let mean = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() as f64 - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_s_interval_has_the_ends_at_which_the_score_test_turns() {
        for correct in 0..=10 {
            let Interval { low, high } = wilson(f64::from(correct), 10.0);
            let share = f64::from(correct) / 10.0;
            // |p̂ − p| = z √(p(1 − p)/n) at both ends, which is how Wilson found them.
            for end in [low, high] {
                let due = 1.959_964 * (end * (1.0 - end) / 10.0).sqrt();
                assert!(((share - end).abs() - due).abs() < 1e-6, "{correct} {end}");
            }
        }
    }

    #[test]
    fn nine_of_ten_are_guessed_in_eleven_of_1024_cases() {
        assert!((guessing(9, 10) - 11.0 / 1024.0).abs() < 1e-12);
        assert!((guessing(10, 10) - 1.0 / 1024.0).abs() < 1e-12);
        assert_eq!(guessing(0, 10), 1.0);
    }

    #[test]
    fn the_middle_of_a_thousand_and_one_leaves_25_at_either_end() {
        let values = (0..=1000).map(f64::from).collect();
        let interval = middle(values).unwrap();
        assert_eq!((interval.low, interval.high), (25.0, 975.0));
        assert_eq!(middle(Vec::new()), None);
    }
}
