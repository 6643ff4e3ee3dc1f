//! The normal distribution.

use statrs::distribution::{ContinuousCDF, Normal};

/// Φ⁻¹(0.75): a limen that is a 75 % point is so many standard deviations.
pub const PROBABLE_ERROR: f64 = 0.674_489_750_196_081_7;

pub fn cdf(x: f64) -> f64 {
    Normal::standard().cdf(x)
}

/// Φ⁻¹(p), p from 0 to 1: infinite at the ends.
pub fn quantile(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probable_error_is_the_quantile_of_three_quarters() {
        assert!((quantile(0.75) - PROBABLE_ERROR).abs() < 1e-12);
        assert!((cdf(PROBABLE_ERROR) - 0.75).abs() < 1e-12);
        assert_eq!(quantile(1.0), f64::INFINITY);
    }
}
