//! What the paper prints of its experiments with people (Okamoto et al. 2009, Tables II to IV).

use serde::Serialize;

use crate::psychophysics::pair::Pair;

pub const SAMPLES_MM: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
/// The subjects of Table II.
pub const SUBJECTS: usize = 3;
/// Steps of the comparison stimuli of Table II, in mm.
pub const STEP_MM: f64 = 0.2;
/// Ascending series for a standard, and as many descending ones.
pub const SERIES: usize = 2;
/// Trials of a pair of Table III.
pub const TRIALS: u32 = 10;

/// A column of Table II, in mm: averages over three subjects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limens {
    pub standard_mm: f64,
    pub lower_mm: f64,
    pub upper_mm: f64,
    /// The average discrimination limen: half of what lies between them.
    pub limen_mm: f64,
    pub deviation_mm: f64,
}

const fn limens(
    standard_mm: f64,
    lower_mm: f64,
    upper_mm: f64,
    limen_mm: f64,
    deviation_mm: f64,
) -> Limens {
    Limens {
        standard_mm,
        lower_mm,
        upper_mm,
        limen_mm,
        deviation_mm,
    }
}

pub const TABLE_2: [Limens; 4] = [
    limens(1.0, 0.82, 1.28, 0.23, 0.095),
    limens(2.0, 1.78, 2.14, 0.18, 0.10),
    limens(3.0, 2.80, 3.42, 0.31, 0.082),
    limens(4.0, 3.55, 4.40, 0.43, 0.13),
];

const fn pair(shorter: usize, longer: usize, correct: u32) -> Pair {
    Pair {
        shorter,
        longer,
        correct: correct as f64,
        trials: TRIALS as f64,
    }
}

/// Table III: of ten trials for each pair of [`SAMPLES_MM`], those answered correctly.
pub const TABLE_3: [Pair; 6] = [
    pair(0, 1, 9),
    pair(0, 2, 7),
    pair(0, 3, 9),
    pair(1, 2, 9),
    pair(1, 3, 10),
    pair(2, 3, 7),
];

pub const TABLE_4: [f64; 4] = [0.0, 0.5461, 1.092, 1.449];
pub const CHI_SQUARE: f64 = 8.72;
/// The degrees of freedom that the paper took.
pub const FREEDOM: u32 = 7;
/// The critical value that the paper took, at 5 %.
pub const CRITICAL: f64 = 14.07;
