//! Paired comparison: Table III.

use crate::psychophysics::observer::Observer;
use crate::psychophysics::pair::{self, Pair};
use crate::psychophysics::presented::{Felt, IntegrationWindow};
use crate::psychophysics::thresholds::Skin;

/// Table III once over: `trials` of each pair of the samples, which are in order of wavelength.
pub fn table(samples: &[Felt], trials: u32, glimpse: IntegrationWindow, seed: u64) -> Vec<Pair> {
    let mut observer = Observer::new(Skin::average(), glimpse, seed);
    let correct = |one: &Felt, other: &Felt| {
        let answers = (0..trials).filter(|_| observer.chooses_other(one, other));
        answers.count() as f64
    };
    answered(samples, trials, correct)
}

/// Where the shares of Table III go in the long run, as if of `trials` each.
pub fn long_run(samples: &[Felt], trials: u32, glimpse: IntegrationWindow, seed: u64) -> Vec<Pair> {
    /// Glimpses of each pair: the mean of shares is then within 0.002 of where it goes.
    const GLIMPSES: u32 = 20_000;
    let mut observer = Observer::new(Skin::average(), glimpse, seed);
    answered(samples, trials, |one, other| {
        observer.share_choosing_other(one, other, GLIMPSES) * f64::from(trials)
    })
}

fn answered(
    samples: &[Felt],
    trials: u32,
    mut correct: impl FnMut(&Felt, &Felt) -> f64,
) -> Vec<Pair> {
    let pair = |(shorter, longer)| Pair {
        shorter,
        longer,
        correct: correct(&samples[shorter], &samples[longer]),
        trials: f64::from(trials),
    };
    pair::of(samples.len()).map(pair).collect()
}

/// The mean share of correct answers.
pub fn mean_share(pairs: &[Pair]) -> f64 {
    crate::psychophysics::interval::mean(pairs.iter().map(Pair::share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::psychophysics::normal::quantile;
    use crate::psychophysics::presented::Wave;
    use crate::psychophysics::published::SAMPLES_MM;

    /// A stimulus whose waves have a relative deviation, evenly spread over the quantiles of a normal one.
    fn noisy(wavelength_mm: f64, deviation: f64) -> Felt {
        const WAVES: u32 = 199;
        let waves = (0..WAVES).map(|index| {
            let share = (f64::from(index) + 0.5) / f64::from(WAVES);
            Wave {
                from_s: f64::from(index),
                to_s: f64::from(index + 1),
                wavelength_mm: wavelength_mm * (1.0 + deviation * quantile(share)),
                stroke: 0,
            }
        });
        Felt::new(waves.collect()).unwrap()
    }

    /// The numerical study's prediction from Table II's limens and a relative noise of λ: mean shares of
    /// .99, .98, .94 and .84 for 0, 10, 20 and 40 %.
    #[test]
    fn a_noisy_wavelength_costs_the_shares_that_the_study_predicted() {
        for (noise, predicted) in [(0.0, 0.99), (0.1, 0.98), (0.2, 0.94), (0.4, 0.84)] {
            let samples: Vec<Felt> = SAMPLES_MM.iter().map(|mm| noisy(*mm, noise)).collect();
            let share = mean_share(&long_run(&samples, 10, IntegrationWindow::Wave, 1));
            // The study's are rounded to 0.01; limens that go with the felt wavelength, and a spread that
            // ends, instead of a normal one, cost up to another 0.015.
            assert!((share - predicted).abs() < 0.02, "{noise} {share}");
        }
    }

    #[test]
    fn a_table_has_every_pair_once_and_whole_answers() {
        let samples: Vec<Felt> = SAMPLES_MM.into_iter().map(Felt::steady).collect();
        let table = table(&samples, 10, IntegrationWindow::Wave, 3);
        assert_eq!(table.len(), 6);
        assert!(table.iter().all(|pair| pair.correct.fract() == 0.0
            && pair.correct <= 10.0
            && pair.shorter < pair.longer));
    }
}
