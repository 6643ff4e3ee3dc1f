//! Mosteller's χ² test: do the shares agree with a Case V scale?
//!
//! χ² = Σ 4n (asin √p − asin √p′)² over the pairs, p observed and p′ of the scale, angles in radians (with
//! degrees, 4n becomes n/821). Of m(m − 1)/2 pairs m − 1 scores were fitted, so (m − 1)(m − 2)/2 degrees of
//! freedom remain: 3 for four samples. A pair that is left out takes one with it.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::psychophysics::normal;
use crate::psychophysics::pair::Pair;

/// The level of the test.
pub const LEVEL: f64 = 0.05;

/// What is done about a share of 1, or of 0, which no finite scale gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extreme {
    /// It counts as half an answer off: 1 − 1/(2n). With ten trials that is 0.95, and the paper's χ².
    HalfAnAnswer,
    /// It counts as it is.
    AsItIs,
    /// It is left out, with its degree of freedom.
    LeftOut,
}

/// The test's result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Test {
    pub chi_square: f64,
    pub freedom: u32,
    /// What χ² is above in 5 % of the cases, if Case V holds.
    pub critical: f64,
    /// How often χ² would be so large, or larger, if Case V held.
    pub p: f64,
}

impl Test {
    /// Whether Case V is rejected at [`LEVEL`].
    pub fn rejects(&self) -> bool {
        self.p < LEVEL
    }
}

/// Tests pairs against scores; none if no degree of freedom is left.
pub fn test(scores: &[f64], pairs: &[Pair], extreme: Extreme) -> Option<Test> {
    let mut chi_square = 0.0;
    let mut counted = 0;
    for pair in pairs {
        let is_extreme = !pair.deviate().is_finite();
        let margin = 0.5 / pair.trials;
        let share = match extreme {
            Extreme::LeftOut if is_extreme => continue,
            Extreme::HalfAnAnswer if is_extreme => pair.share().clamp(margin, 1.0 - margin),
            _ => pair.share(),
        };
        let due = normal::cdf(scores[pair.longer] - scores[pair.shorter]);
        let angle = share.sqrt().asin() - due.sqrt().asin();
        chi_square += 4.0 * pair.trials * angle * angle;
        counted += 1;
    }
    let freedom = u32::try_from(counted + 1 - scores.len() as i64).ok()?;
    let distribution = ChiSquared::new(f64::from(freedom)).ok()?;
    Some(Test {
        chi_square,
        freedom,
        critical: critical(freedom)?,
        p: distribution.sf(chi_square),
    })
}

/// What χ² of so many degrees of freedom is above in 5 % of the cases; none for 0.
pub fn critical(freedom: u32) -> Option<f64> {
    let distribution = ChiSquared::new(f64::from(freedom)).ok()?;
    Some(distribution.inverse_cdf(1.0 - LEVEL))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::psychophysics::published::{CRITICAL, FREEDOM, TABLE_3};
    use crate::psychophysics::thurstone;

    #[test]
    fn the_paper_s_chi_square_has_three_degrees_of_freedom_and_rejects() {
        let scale = thurstone::scale(4, &TABLE_3).unwrap();
        let test = test(&scale.scores, &TABLE_3, Extreme::HalfAnAnswer).unwrap();
        assert!((test.chi_square - 8.72).abs() < 0.005, "{test:?}");
        assert_eq!(test.freedom, 3);
        assert!((test.critical - 7.81).abs() < 0.005, "{test:?}");
        assert!((test.p - 0.033).abs() < 0.0005, "{test:?}");
        assert!(test.rejects());
        assert!((critical(FREEDOM).unwrap() - CRITICAL).abs() < 0.005);
    }

    #[test]
    fn a_pair_left_out_takes_a_degree_of_freedom() {
        let scale = thurstone::scale(4, &TABLE_3).unwrap();
        let test = |extreme| test(&scale.scores, &TABLE_3, extreme).unwrap();
        assert_eq!(test(Extreme::LeftOut).freedom, 2);
        assert!(test(Extreme::LeftOut).chi_square < test(Extreme::HalfAnAnswer).chi_square);
        assert!(test(Extreme::AsItIs).chi_square > test(Extreme::HalfAnAnswer).chi_square);
    }

    #[test]
    fn shares_that_come_of_a_scale_have_no_chi_square() {
        let scores = [0.0, 0.5, 1.0, 1.5];
        let pairs: Vec<Pair> = crate::psychophysics::pair::of(4)
            .map(|(shorter, longer)| Pair {
                shorter,
                longer,
                correct: 10.0 * normal::cdf(scores[longer] - scores[shorter]),
                trials: 10.0,
            })
            .collect();
        let test = test(&scores, &pairs, Extreme::AsItIs).unwrap();
        assert!(test.chi_square < 1e-12 && test.p > 1.0 - 1e-6, "{test:?}");
    }

    #[test]
    fn nothing_is_tested_without_a_degree_of_freedom() {
        let pairs = &TABLE_3[..3];
        assert_eq!(
            test(&[0.0, 0.5, 1.0, 1.4], pairs, Extreme::HalfAnAnswer),
            None
        );
    }
}
