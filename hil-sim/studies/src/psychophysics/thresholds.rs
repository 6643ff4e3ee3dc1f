//! How well a skin tells wavelengths apart: Table II's limens, read as one psychometric function.
//!
//! A limen L is taken as the 75 % point of a choice between two, so that the difference of two sensations
//! has the standard deviation σ = L/Φ⁻¹(0.75) = L/0.6745, and a single sensation σ/√2. The paper measured
//! L by the method of limits and does not say what share of answers it stands for; with this reading both
//! methods have one observer: if he says "longer" where a difference is felt as more than L, then "longer"
//! is said in half of the trials just where the choice between two is right in 75 %, and equal stimuli are
//! told apart in half of the trials.

use crate::psychophysics::normal::PROBABLE_ERROR;
use crate::psychophysics::published::{Limens, SUBJECTS, TABLE_2};

/// The limens of one skin at the standards of Table II, in mm, and its constant errors there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skin {
    points: [Point; TABLE_2.len()],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    standard_mm: f64,
    limen_mm: f64,
    constant_error_mm: f64,
}

impl Skin {
    /// The average of Table II: Table III's subject was one of its three, and the paper does not say which.
    pub fn average() -> Self {
        Self::with(|limens| limens.limen_mm)
    }

    /// The three subjects of Table II: limens m − s, m and m + s, the one symmetric three that has the
    /// table's mean m and standard deviation s. The paper prints no more of them.
    pub fn subjects() -> [Self; SUBJECTS] {
        [-1.0, 0.0, 1.0].map(|deviations| {
            Self::with(|limens| limens.limen_mm + deviations * limens.deviation_mm)
        })
    }

    fn with(limen_mm: impl Fn(&Limens) -> f64) -> Self {
        Self {
            points: TABLE_2.each_ref().map(|limens| Point {
                standard_mm: limens.standard_mm,
                limen_mm: limen_mm(limens),
                constant_error_mm: 0.5 * (limens.lower_mm + limens.upper_mm) - limens.standard_mm,
            }),
        }
    }

    /// The limen at a wavelength, in mm: straight lines between the standards, level beyond them.
    pub fn limen_mm(&self, wavelength_mm: f64) -> f64 {
        self.between(wavelength_mm, |point| point.limen_mm)
    }

    /// How much longer than the standard a comparison has to be to feel as long, in mm: the middle between
    /// Table II's upper and lower limens. Two samples of a pair are on a par and have none.
    pub fn constant_error_mm(&self, standard_mm: f64) -> f64 {
        self.between(standard_mm, |point| point.constant_error_mm)
    }

    pub fn deviation_mm(&self, wavelength_mm: f64) -> f64 {
        self.limen_mm(wavelength_mm) / (PROBABLE_ERROR * std::f64::consts::SQRT_2)
    }

    fn between(&self, wavelength_mm: f64, value: impl Fn(&Point) -> f64) -> f64 {
        let points = &self.points;
        let after = points.partition_point(|point| point.standard_mm <= wavelength_mm);
        let (Some(before), Some(next)) = (points[..after].last(), points.get(after)) else {
            return value(&points[after.min(points.len() - 1)]);
        };
        let share = (wavelength_mm - before.standard_mm) / (next.standard_mm - before.standard_mm);
        value(before) + share * (value(next) - value(before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_limen_and_one_constant_error_give_both_limens_of_table_2() {
        let skin = Skin::average();
        for limens in TABLE_2 {
            let middle_mm = limens.standard_mm + skin.constant_error_mm(limens.standard_mm);
            let limen_mm = skin.limen_mm(limens.standard_mm);
            // The table's limens are rounded to 0.01 mm, so half of their difference to 0.005 mm.
            assert!((middle_mm - limen_mm - limens.lower_mm).abs() <= 0.005 + 1e-12);
            assert!((middle_mm + limen_mm - limens.upper_mm).abs() <= 0.005 + 1e-12);
        }
    }

    #[test]
    fn three_subjects_have_the_table_s_mean_and_deviation() {
        let subjects = Skin::subjects();
        for limens in TABLE_2 {
            let each = subjects.map(|skin| skin.limen_mm(limens.standard_mm));
            let mean = each.iter().sum::<f64>() / 3.0;
            let variance = each.iter().map(|mm| (mm - mean).powi(2)).sum::<f64>() / 2.0;
            assert!((mean - limens.limen_mm).abs() < 1e-12);
            assert!((variance.sqrt() - limens.deviation_mm).abs() < 1e-12);
        }
    }

    #[test]
    fn limens_are_straight_between_standards_and_level_beyond() {
        let skin = Skin::average();
        assert_eq!(skin.limen_mm(0.4), 0.23);
        assert!((skin.limen_mm(3.5) - 0.37).abs() < 1e-12);
        assert_eq!(skin.limen_mm(5.6), 0.43);
    }
}
