//! Somebody who feels stimuli and answers.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::psychophysics::normal;
use crate::psychophysics::presented::{Felt, IntegrationWindow};
use crate::psychophysics::thresholds::Skin;

/// For how long a sensation is gathered, in s: a guess, and not a number of the paper's.
/// [`crate::psychophysics::study`] says what a shorter and a longer one would change.
pub const GLIMPSE_S: f64 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    Shorter,
    Equal,
    Longer,
}

/// An observer. Equal skins, glimpses and seeds give equal answers.
#[derive(Clone, Debug)]
pub struct Observer {
    skin: Skin,
    glimpse: IntegrationWindow,
    draws: Xoshiro256PlusPlus,
}

impl Observer {
    /// With a skin, and a seed for where he looks and what his nerves add.
    pub fn new(skin: Skin, glimpse: IntegrationWindow, seed: u64) -> Self {
        Self {
            skin,
            glimpse,
            draws: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }

    /// One sensation of a stimulus, in mm: a glimpse from anywhere in it, and the skin's noise.
    fn sense_mm(&mut self, felt: &Felt) -> f64 {
        let felt_mm = felt.glimpse_mm(self.draws.random(), self.glimpse);
        let noise: f64 = StandardNormal.sample(&mut self.draws);
        felt_mm + self.skin.deviation_mm(felt_mm) * noise
    }

    /// Whether `other` feels longer than `one`; he must choose.
    pub fn chooses_other(&mut self, one: &Felt, other: &Felt) -> bool {
        self.sense_mm(other) > self.sense_mm(one)
    }

    /// How a comparison feels beside the standard `standard_mm`: longer or shorter if by more than his
    /// limen.
    pub fn compare(&mut self, comparison: &Felt, standard: &Felt, standard_mm: f64) -> Answer {
        let difference_mm = self.sense_mm(comparison)
            - self.sense_mm(standard)
            - self.skin.constant_error_mm(standard_mm);
        let limen_mm = self.skin.limen_mm(standard_mm);
        if difference_mm > limen_mm {
            Answer::Longer
        } else if difference_mm < -limen_mm {
            Answer::Shorter
        } else {
            Answer::Equal
        }
    }

    /// The share of trials in the long run in which `other` feels longer than `one`: the mean over `pairs`
    /// pairs of glimpses of what the skin makes of each. Never just 0 or 1.
    pub fn share_choosing_other(&mut self, one: &Felt, other: &Felt, pairs: u32) -> f64 {
        let shares = (0..pairs).map(|_| {
            let one_mm = one.glimpse_mm(self.draws.random(), self.glimpse);
            let other_mm = other.glimpse_mm(self.draws.random(), self.glimpse);
            let [of_one, of_other] = [one_mm, other_mm].map(|mm| self.skin.deviation_mm(mm));
            normal::cdf((other_mm - one_mm) / of_one.hypot(of_other))
        });
        shares.sum::<f64>() / f64::from(pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::psychophysics::published::TABLE_2;

    const TRIALS: u32 = 40_000;
    /// Four standard deviations of a share of so many trials, at most.
    const BOUND: f64 = 4.0 * 0.5 / 200.0;

    fn observer() -> Observer {
        Observer::new(Skin::average(), IntegrationWindow::Wave, 1)
    }

    fn share(of: impl FnMut() -> bool) -> f64 {
        let mut of = of;
        f64::from((0..TRIALS).filter(|_| of()).count() as u32) / f64::from(TRIALS)
    }

    #[test]
    fn a_limen_is_told_in_three_of_four_choices() {
        for limens in TABLE_2 {
            // About the standard, where the limen is that of Table II on either side together.
            let limen_mm = 0.02;
            let near = Skin::average().limen_mm(limens.standard_mm);
            let mut observer = observer();
            let one = Felt::steady(limens.standard_mm);
            let other = Felt::steady(limens.standard_mm + limen_mm);
            let right = share(|| observer.chooses_other(&one, &other));
            let expected = normal::cdf(limen_mm / near * normal::PROBABLE_ERROR);
            // The limen changes by 0.13 a mm at most, so by 2 % over 0.02 mm of it.
            assert!(
                (right - expected).abs() < BOUND + 0.01,
                "{right} {expected}"
            );
        }
    }

    #[test]
    fn equal_stimuli_are_called_equal_by_half_but_for_the_constant_error() {
        for limens in TABLE_2 {
            let constant_mm = Skin::average().constant_error_mm(limens.standard_mm);
            let mut observer = observer();
            let standard = Felt::steady(limens.standard_mm);
            let felt_equal = Felt::steady(limens.standard_mm + constant_mm);
            let equal = share(|| {
                observer.compare(&felt_equal, &standard, limens.standard_mm) == Answer::Equal
            });
            // 3: the limen grows by 0.12 mm a mm, 4 % over the constant error of 0.11 mm.
            assert!((equal - 0.5).abs() < BOUND + 0.02, "{equal}");
        }
    }

    #[test]
    fn the_long_run_is_where_many_trials_go() {
        let (one, other) = (Felt::steady(3.0), Felt::steady(4.0));
        let mut observer = observer();
        let long_run = observer.share_choosing_other(&one, &other, 1);
        let right = share(|| observer.chooses_other(&one, &other));
        assert!((long_run - right).abs() < BOUND, "{long_run} {right}");
    }

    #[test]
    fn one_seed_gives_one_row_of_answers() {
        let answers = || {
            let mut observer = observer();
            let (one, other) = (Felt::steady(1.0), Felt::steady(1.1));
            (0..100)
                .map(|_| observer.chooses_other(&one, &other))
                .collect::<Vec<_>>()
        };
        assert_eq!(answers(), answers());
    }
}
