//! Somebody who is given one of two surfaces and says which it is, by what is played.
//!
//! He hears each third octave's level as an ear of a fingertip: two levels that differ by the limen are told apart in 75 % of
//! choices between two. The limen is 2.35 dB, the middle of what is found at 2 to 200 Hz on the fingertip (2.2 to 2.5
//! dB; Craig 1972 and Verrillo and Gescheider as cited by the field's reviews).
//!
//! He has felt each surface [`SEEDS`] times, each time under other noise and with the wave beginning elsewhere in the stroke,
//! and compares the means. Intervals are by the bootstrap over these times.
//!
//! Assumed: he goes by the one third octave that differs most, and puts none together; what is [`MASKED_DB`] below the
//! whole is masked; all is above his threshold; he knows neither place nor time, so phases say nothing to him; he neither
//! tires nor learns. The same surface under other noise is among the pairs: so often is a guess right.

use hil_sim_core::run::batch::on_all_cores;
use hil_sim_core::scene::SceneError;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use super::likeness::{THIRDS, thirds_where};
use super::surfaces::{Ground, gratings, sine, weave};
use super::{Case, LOOKS_S, RENDERINGS, SPEEDS, played, said, scene, ticks, word};
use crate::psychophysics::interval::{Interval, middle};
use crate::psychophysics::normal::{PROBABLE_ERROR, cdf};
use crate::study::{Fixed, csv_text};

/// The limen of a vibration's amplitude on the fingertip, in dB.
pub const LIMEN_DB: f64 = 2.35;
/// What is so far below the whole is masked, in dB.
const MASKED_DB: f64 = -20.0;
/// Presentations of each surface: noises of the sensor, each with a delay of its own.
const SEEDS: u64 = 8;
/// From one presentation's delay to the next one's, in ms: the display's wave begins with the first estimate.
const DELAY_MS: f64 = 13.0;
/// He attends where the hand is at least so fast, over its highest speed: at the turns a stroke's end is felt, not a
/// surface.
const BRISK: f64 = 0.8;
/// Resamplings of the bootstrap.
const RESAMPLINGS: usize = 400;

/// Two surfaces of one λ.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Their names.
    pub one: String,
    /// See `one`.
    pub other: String,
    /// How each of [`RENDERINGS`] lets them be told apart.
    pub answers: Vec<Answer>,
}

/// How often two surfaces are told apart.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// Share of choices between two that are right, 0.5 to 1.
    pub right: f64,
    /// Its 95 % interval.
    pub interval: Interval,
}

fn couples() -> Vec<(Ground, Ground)> {
    let [even, narrow] = gratings();
    vec![
        (sine(0.0), sine(0.0)),
        (sine(0.0), even.clone()),
        (even.clone(), narrow),
        (even, weave(0.0)),
        (sine(0.0), sine(0.35)),
        (weave(0.0), weave(0.35)),
    ]
}

fn seeds(quick: bool) -> u64 {
    if quick { 1 } else { SEEDS }
}

/// How often [`pairs`] tells that it is done.
pub fn runs(quick: bool) -> u64 {
    2 * seeds(quick) * couples().len() as u64
}

/// All pairs, told apart.
///
/// # Errors
/// If a scene can't be run.
pub fn pairs(quick: bool, done: &(impl Fn() + Sync)) -> Result<Vec<Pair>, SceneError> {
    let (arm, hand) = SPEEDS[0];
    let couples = couples();
    let cases: Vec<Case> = couples
        .iter()
        .flat_map(|(one, other)| {
            (0..seeds(quick)).flat_map(move |seed| {
                // No noise twice.
                [(one, 2 * seed + 1), (other, 2 * seed + 2)].map(|(ground, seed)| Case {
                    ground: ground.clone(),
                    arm,
                    hand,
                    seed,
                })
            })
        })
        .collect();
    let felt: Vec<[[f64; THIRDS]; RENDERINGS.len()]> = on_all_cores(&cases, |case| {
        let said = said(&scene(case))?;
        done();
        Ok::<_, SceneError>(RENDERINGS.map(|rendering| {
            let delay_ms = DELAY_MS * case.seed as f64;
            let hand_mm = |t_s| case.hand.position_mm(t_s);
            let played = played(&said, hand_mm, &ticks(), rendering, delay_ms);
            thirds_where(&played, |t_s| {
                case.hand.relative_speed(LOOKS_S.0 + t_s) >= BRISK
            })
        }))
    })?;
    let of_a_couple = 2 * seeds(quick) as usize;
    Ok(couples
        .iter()
        .zip(felt.chunks(of_a_couple))
        .map(|((one, other), felt)| Pair {
            one: one.name.clone(),
            other: other.name.clone(),
            answers: (0..RENDERINGS.len())
                .map(|rendering| {
                    let of = |which: usize| -> Vec<_> {
                        let own = felt.iter().skip(which).step_by(2);
                        own.map(|levels| levels[rendering]).collect()
                    };
                    answer(&of(0), &of(1))
                })
                .collect(),
        })
        .collect())
}

/// How presentations of one surface are told from those of another.
fn answer(one: &[[f64; THIRDS]], other: &[[f64; THIRDS]]) -> Answer {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut resampled = |of: &[[f64; THIRDS]]| -> Vec<[f64; THIRDS]> {
        (0..of.len())
            .map(|_| of[draws.random_range(0..of.len())])
            .collect()
    };
    let shares = (0..RESAMPLINGS)
        .map(|_| right(&mean_db(&resampled(one)), &mean_db(&resampled(other))))
        .collect();
    let right = right(&mean_db(one), &mean_db(other));
    Answer {
        right,
        interval: middle(shares).unwrap_or(Interval {
            low: right,
            high: right,
        }),
    }
}

/// The level of the mean power of each third octave.
fn mean_db(presentations: &[[f64; THIRDS]]) -> [f64; THIRDS] {
    std::array::from_fn(|third| {
        let powers = presentations
            .iter()
            .map(|levels| 10_f64.powf(0.1 * levels[third]));
        10.0 * (powers.sum::<f64>() / presentations.len() as f64).log10()
    })
}

/// The share of right choices between two of these levels.
fn right(one: &[f64; THIRDS], other: &[f64; THIRDS]) -> f64 {
    let difference = one
        .iter()
        .zip(other)
        .map(|(one, other)| one.max(MASKED_DB) - other.max(MASKED_DB))
        .fold(0.0_f64, |most, difference| most.max(difference.abs()));
    cdf(difference / LIMEN_DB * PROBABLE_ERROR)
}

#[derive(Serialize)]
struct Record<'a> {
    one: &'a str,
    other: &'a str,
    rendering: &'static str,
    right: Fixed<3>,
    low: Fixed<3>,
    high: Fixed<3>,
}

/// The pairs as CSV.
///
/// # Errors
/// None in practice: it is written to memory.
pub fn csv(pairs: &[Pair]) -> Result<String, csv::Error> {
    csv_text(pairs.iter().flat_map(|pair| {
        RENDERINGS
            .iter()
            .zip(&pair.answers)
            .map(|(rendering, answer)| Record {
                one: &pair.one,
                other: &pair.other,
                rendering: word(*rendering),
                right: answer.right.into(),
                low: answer.interval.low.into(),
                high: answer.interval.high.into(),
            })
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limen_is_told_in_three_of_four_choices_and_what_is_masked_is_not() {
        let quiet = [-30.0; THIRDS];
        assert_eq!(right(&quiet, &quiet), 0.5);
        let mut louder = quiet;
        louder[3] = MASKED_DB + LIMEN_DB;
        assert!((right(&quiet, &louder) - 0.75).abs() < 1e-9);
        louder[3] = MASKED_DB - 1.0;
        assert_eq!(right(&quiet, &louder), 0.5);
    }
}
