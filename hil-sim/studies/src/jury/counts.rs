//! What came of one surface, in counts.

use realfft::num_complex::Complex64;
use serde::Serialize;

/// An estimate this close to the truth, relative to it, is right.
pub const RIGHT: f64 = 0.05;
/// One further off than this is wrong. Between the two it is neither.
pub const WRONG: f64 = 0.1;

/// A wave's shape this close to the true one is right: what differs has so much of its RMS as a limen of 2.2 dB makes.
pub const SHAPE_RIGHT: f64 = 0.288;
/// One that is further off than twice that is wrong.
pub const SHAPE_WRONG: f64 = 2.0 * SHAPE_RIGHT;

/// The second and third partial of a wave, relative to its fundamental.
pub type Partials = [Complex64; 2];

/// What an estimate is worth, or what is played.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worth {
    /// Stood by and within [`RIGHT`].
    Right,
    /// Stood by and neither.
    Near,
    /// Stood by and more than [`WRONG`] off, or stood by where there is no period.
    Wrong,
    /// Not stood by.
    Silent,
}

impl Worth {
    /// Of `said_mm`, which is none where nothing is stood by; `truth_mm` is 0 where there is no period.
    pub fn of(said_mm: Option<f64>, truth_mm: f64) -> Self {
        let Some(said_mm) = said_mm else {
            return Self::Silent;
        };
        // Not said_mm / truth_mm − 1: without a truth it would be no number, and no number is right.
        let off_mm = (said_mm - truth_mm).abs();
        if truth_mm > 0.0 && off_mm <= RIGHT * truth_mm {
            Self::Right
        } else if truth_mm > 0.0 && off_mm <= WRONG * truth_mm {
            Self::Near
        } else {
            Self::Wrong
        }
    }

    /// Of the shape of a wave of which `felt` partials can be felt, 1 or 2. Which way up a gauge feels it nobody can know:
    /// upside down, the second partial is half a turn further.
    pub fn of_shape(told: Partials, truth: Partials, felt: usize) -> Self {
        let power = |partials: &[Complex64]| partials.iter().map(Complex64::norm_sqr).sum::<f64>();
        let off = |way_up: f64| {
            let off = [way_up * told[0] - truth[0], told[1] - truth[1]];
            (power(&off[..felt]) / (1.0 + power(&truth[..felt]))).sqrt()
        };
        match off(1.0).min(off(-1.0)) {
            off if off <= SHAPE_RIGHT => Self::Right,
            off if off <= SHAPE_WRONG => Self::Near,
            _ => Self::Wrong,
        }
    }
}

/// So many of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// All that counted.
    pub all: u32,
    /// [`Worth::Right`]
    pub right: u32,
    /// [`Worth::Wrong`]
    pub wrong: u32,
    /// [`Worth::Silent`]
    pub silent: u32,
}

impl Counts {
    /// One more.
    pub fn count(&mut self, worth: Worth) {
        self.all += 1;
        match worth {
            Worth::Right => self.right += 1,
            Worth::Near => {}
            Worth::Wrong => self.wrong += 1,
            Worth::Silent => self.silent += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worth_goes_by_the_distance_from_the_truth() {
        for (said_mm, truth_mm, worth) in [
            (Some(2.0), 2.0, Worth::Right),
            (Some(2.09), 2.0, Worth::Right),
            (Some(1.89), 2.0, Worth::Near),
            (Some(2.19), 2.0, Worth::Near),
            (Some(2.21), 2.0, Worth::Wrong),
            (Some(1.0), 2.0, Worth::Wrong),
            (Some(2.0), 0.0, Worth::Wrong),
            (Some(f64::NAN), 2.0, Worth::Wrong),
            (None, 2.0, Worth::Silent),
            (None, 0.0, Worth::Silent),
        ] {
            assert_eq!(
                Worth::of(said_mm, truth_mm),
                worth,
                "{said_mm:?} {truth_mm}"
            );
        }
    }

    #[test]
    fn a_shape_may_be_off_by_a_limen() {
        let limen = 10_f64.powf(hil_sim_core::judge::needed::LIMEN_DB / 20.0) - 1.0;
        assert!((SHAPE_RIGHT - limen).abs() < 0.001, "{limen}");
    }

    #[test]
    fn a_shape_is_worth_what_its_partials_are_either_way_up() {
        let shape = |second: f64, third: f64| [second, third].map(|x| Complex64::new(x, 0.0));
        for (told, truth, felt, worth) in [
            (shape(0.5, 0.2), shape(0.5, 0.2), 2, Worth::Right),
            (shape(-0.5, 0.2), shape(0.5, 0.2), 2, Worth::Right),
            (shape(0.5, -0.2), shape(0.5, 0.2), 2, Worth::Near),
            // A sine that is told as such, and not: 0.28 and 0.29, 0.57 and 0.58.
            (shape(0.28, 0.0), shape(0.0, 0.0), 2, Worth::Right),
            (shape(0.29, 0.0), shape(0.0, 0.0), 2, Worth::Near),
            (shape(0.0, 0.57), shape(0.0, 0.0), 2, Worth::Near),
            (shape(0.0, 0.58), shape(0.0, 0.0), 2, Worth::Wrong),
            // What can't be felt does not count.
            (shape(0.0, 0.58), shape(0.0, 0.0), 1, Worth::Right),
            // Of a sharper wave as much is less.
            (shape(0.6, 1.0), shape(1.0, 1.0), 2, Worth::Right),
            (shape(f64::NAN, 0.0), shape(0.0, 0.0), 2, Worth::Wrong),
        ] {
            assert_eq!(
                Worth::of_shape(told, truth, felt),
                worth,
                "{told:?} {truth:?} {felt}"
            );
        }
    }

    #[test]
    fn each_worth_is_counted_once_and_what_is_near_only_among_all() {
        let mut counts = Counts::default();
        for (worth, times) in [
            (Worth::Right, 5),
            (Worth::Near, 4),
            (Worth::Wrong, 3),
            (Worth::Silent, 2),
        ] {
            (0..times).for_each(|_| counts.count(worth));
        }
        let expected = Counts {
            all: 14,
            right: 5,
            wrong: 3,
            silent: 2,
        };
        assert_eq!(counts, expected);
    }
}
