//! The method of limits: Table II.
//!
//! A series goes through the comparison stimuli in steps, upwards or downwards, and the observer says of
//! each whether it is shorter than the standard, equal or longer. Where he first says something else than
//! "shorter" going up (or first says "shorter" going down) lies the lower limen, halfway between the two
//! stimuli; the upper limen is where "longer" begins or ends in the same way. The paper says how many series there were,
//! and how far apart the stimuli; that they begin 1.6 mm from the standard, or at the shortest stimulus
//! of 0.4 mm, is an assumption.

use crate::psychophysics::interval::{mean, sample_deviation};
use crate::psychophysics::observer::{Answer, Observer};
use crate::psychophysics::presented::{Felt, IntegrationWindow};
use crate::psychophysics::published::{Limens, SERIES, STEP_MM, TABLE_2};
use crate::psychophysics::thresholds::Skin;

/// How far from the standard a series begins, in steps.
const SPAN_STEPS: usize = 8;
/// The shortest and the longest comparison, in steps from 0.
const SHORTEST_STEP: usize = 2;
const LONGEST_STEP: usize = 28;

/// The wavelengths of all comparison stimuli, in mm, among them the standards.
pub fn comparisons_mm() -> Vec<f64> {
    (SHORTEST_STEP..=LONGEST_STEP).map(step_mm).collect()
}

/// To a tenth of a millimetre, which binary steps of 0.2 are not.
fn step_mm(step: usize) -> f64 {
    (10.0 * step as f64 * STEP_MM).round() / 10.0
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    Up,
    Down,
}

/// Table II once over, with one observer for each skin, from `stimuli` as [`comparisons_mm`] lists them.
pub fn table(
    stimuli: &[Felt],
    skins: &[Skin],
    glimpse: IntegrationWindow,
    seed: u64,
) -> [Limens; 4] {
    let observer =
        |(&skin, subject): (&Skin, u64)| Observer::new(skin, glimpse, seed ^ subject << 56);
    let mut observers: Vec<Observer> = skins.iter().zip(0..).map(observer).collect();
    TABLE_2.map(|Limens { standard_mm, .. }| {
        let subjects = observers.iter_mut();
        let each = subjects.map(|observer| subject(observer, stimuli, standard_mm));
        let each: Vec<(f64, f64)> = each.collect();
        let limens: Vec<f64> = each.iter().map(|(low, high)| 0.5 * (high - low)).collect();
        Limens {
            standard_mm,
            lower_mm: mean(each.iter().map(|limens| limens.0)),
            upper_mm: mean(each.iter().map(|limens| limens.1)),
            limen_mm: mean(limens.iter().copied()),
            deviation_mm: sample_deviation(&limens),
        }
    })
}

/// One observer's lower and upper limen, in mm: the means over all series.
fn subject(observer: &mut Observer, stimuli: &[Felt], standard_mm: f64) -> (f64, f64) {
    let standard = (standard_mm / STEP_MM).round() as usize;
    let first = standard.saturating_sub(SPAN_STEPS).max(SHORTEST_STEP);
    let last = (standard + SPAN_STEPS).min(LONGEST_STEP);
    let mut limens = Vec::with_capacity(2 * SERIES);
    for way in [Direction::Up, Direction::Down].repeat(SERIES) {
        let mut answer = |step: usize| {
            let comparison = &stimuli[step - SHORTEST_STEP];
            observer.compare(comparison, &stimuli[standard - SHORTEST_STEP], standard_mm)
        };
        limens.push(series(way, first, last, &mut answer));
    }
    (
        mean(limens.iter().map(|limens| limens.0)),
        mean(limens.iter().map(|limens| limens.1)),
    )
}

/// The lower and the upper limen of one series, in mm. One that is not met lies half a step beyond the
/// series' end.
fn series(
    way: Direction,
    first: usize,
    last: usize,
    answer: &mut impl FnMut(usize) -> Answer,
) -> (f64, f64) {
    let half_mm = 0.5 * STEP_MM;
    match way {
        Direction::Up => {
            let mut lower_mm = None;
            for step in first..=last {
                let limen_mm = step_mm(step) - half_mm;
                let answer = answer(step);
                if answer != Answer::Shorter {
                    lower_mm = lower_mm.or(Some(limen_mm));
                }
                if answer == Answer::Longer {
                    return (lower_mm.unwrap_or(limen_mm), limen_mm);
                }
            }
            let beyond_mm = step_mm(last) + half_mm;
            (lower_mm.unwrap_or(beyond_mm), beyond_mm)
        }
        Direction::Down => {
            let mut upper_mm = None;
            for step in (first..=last).rev() {
                let limen_mm = step_mm(step) + half_mm;
                let answer = answer(step);
                if answer != Answer::Longer {
                    upper_mm = upper_mm.or(Some(limen_mm));
                }
                if answer == Answer::Shorter {
                    return (limen_mm, upper_mm.unwrap_or(limen_mm));
                }
            }
            let beyond_mm = step_mm(first) - half_mm;
            (beyond_mm, upper_mm.unwrap_or(beyond_mm))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers of somebody without noise: equal from 0.9 to 1.3 mm.
    fn certain(step: usize) -> Answer {
        match step_mm(step) {
            mm if mm < 0.9 => Answer::Shorter,
            mm if mm > 1.3 => Answer::Longer,
            _ => Answer::Equal,
        }
    }

    #[test]
    fn both_ways_find_the_limens_between_the_steps_about_them() {
        for way in [Direction::Up, Direction::Down] {
            let (lower_mm, upper_mm) = series(way, 2, 13, &mut certain);
            assert!((lower_mm - 0.9).abs() < 1e-12, "{way:?} {lower_mm}");
            assert!((upper_mm - 1.3).abs() < 1e-12, "{way:?} {upper_mm}");
        }
    }

    #[test]
    fn a_limen_that_is_not_met_lies_half_a_step_beyond() {
        let mut never = |_: usize| Answer::Equal;
        let (lower_mm, upper_mm) = series(Direction::Up, 4, 6, &mut never);
        assert!((lower_mm - 0.7).abs() < 1e-12 && (upper_mm - 1.3).abs() < 1e-12);
        let (lower_mm, upper_mm) = series(Direction::Down, 4, 6, &mut never);
        assert!((lower_mm - 0.7).abs() < 1e-12 && (upper_mm - 1.3).abs() < 1e-12);
    }

    #[test]
    fn comparisons_hold_every_standard() {
        let comparisons_mm = comparisons_mm();
        assert_eq!(comparisons_mm.len(), 27);
        for limens in TABLE_2 {
            assert!(comparisons_mm.contains(&limens.standard_mm));
        }
    }

    #[test]
    fn clean_stimuli_give_back_the_limens_that_went_in() {
        let stimuli: Vec<Felt> = comparisons_mm().into_iter().map(Felt::steady).collect();
        const TABLES: u64 = 400;
        let tables: Vec<_> = (0..TABLES)
            .map(|seed| table(&stimuli, &Skin::subjects(), IntegrationWindow::Wave, seed))
            .collect();
        for (column, expected) in TABLE_2.iter().enumerate() {
            let limen_mm = mean(tables.iter().map(|table| table[column].limen_mm));
            // The first answer of its kind decides, which in series so long comes early: up to half a step
            // is the method's own.
            assert!(
                (limen_mm - expected.limen_mm).abs() < 0.5 * STEP_MM,
                "{limen_mm} {expected:?}"
            );
        }
    }
}
