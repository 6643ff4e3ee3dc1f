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

use hil_sim_core::scene::SceneError;
use protocol::Rendering;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::likeness::{THIRDS, thirds_where};
use super::surfaces::{Ground, gratings, sine, weave};
use super::{Case, LOOKS_S, SPEEDS, played, said, scene, ticks};
use crate::psychophysics::interval::{Interval, middle};
use crate::psychophysics::normal::{PROBABLE_ERROR, cdf};
use crate::study::{Progress, Record, csv, fixed};

/// The limen of a vibration's amplitude on the fingertip.
const LIMEN_DB: f64 = 2.35;
/// What is so far below the whole is masked.
const MASKED_DB: f64 = -20.0;
/// Presentations of each surface: noises of the sensor, each with a delay of its own.
const SEEDS: u64 = 8;
/// From one presentation's delay to the next one's: the display's wave begins with the first estimate.
const DELAY_MS: f64 = 13.0;
/// He attends where the hand is at least so fast, over its highest speed: at the turns a stroke's end is felt, not a
/// surface.
const BRISK: f64 = 0.8;
/// Resamplings of the bootstrap.
const RESAMPLINGS: usize = 400;

/// The names of two surfaces of one λ, and how each of [`Rendering::ALL`] lets them be told apart.
#[derive(Clone, Debug)]
pub struct Pair {
    pub one: String,
    pub other: String,
    pub answers: Vec<Answer>,
}

/// The share of choices between two that are right, 0.5 to 1, with its 95 % interval.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub right: f64,
    pub interval: Interval,
}

type Levels = [f64; THIRDS];

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

/// How many runs [`pairs`] makes.
pub fn runs(quick: bool) -> usize {
    2 * seeds(quick) as usize * couples().len()
}

pub fn pairs(quick: bool, progress: &impl Progress) -> Result<Vec<Pair>, SceneError> {
    let (arm, hand) = SPEEDS[0];
    let couples = couples();
    let cases = couples.iter().flat_map(|(one, other)| {
        (0..seeds(quick)).flat_map(move |seed| {
            // No noise twice.
            [(one, 2 * seed + 1), (other, 2 * seed + 2)].map(|(ground, seed)| Case {
                ground: ground.clone(),
                arm,
                hand,
                seed,
            })
        })
    });
    let felt = progress.each(&cases.collect::<Vec<_>>(), felt)?;
    let told = couples.iter().zip(felt.chunks(2 * seeds(quick) as usize));
    let pair = |((one, other), felt): (&(Ground, Ground), &[[Levels; Rendering::ALL.len()]])| {
        let of = |which: usize, rendering: usize| -> Vec<Levels> {
            let own = felt.iter().skip(which).step_by(2);
            own.map(|levels| levels[rendering]).collect()
        };
        let answer = |rendering| answer(&of(0, rendering), &of(1, rendering));
        Pair {
            one: one.name.clone(),
            other: other.name.clone(),
            answers: (0..Rendering::ALL.len()).map(answer).collect(),
        }
    };
    Ok(told.map(pair).collect())
}

fn felt(case: &Case) -> Result<[Levels; Rendering::ALL.len()], SceneError> {
    let said = said(&scene(case))?;
    let delay_ms = DELAY_MS * case.seed as f64;
    let hand_mm = |t_s| case.hand.position_mm(t_s);
    let is_brisk = |t_s| case.hand.relative_speed(LOOKS_S.0 + t_s) >= BRISK;
    Ok(Rendering::ALL.map(|rendering| {
        let played = played(&said, hand_mm, &ticks(), rendering, delay_ms);
        thirds_where(&played, is_brisk)
    }))
}

/// How presentations of one surface are told from those of another.
fn answer(one: &[Levels], other: &[Levels]) -> Answer {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut resampled = |of: &[Levels]| -> Vec<Levels> {
        let drawn = (0..of.len()).map(|_| of[draws.random_range(0..of.len())]);
        drawn.collect()
    };
    let shares = (0..RESAMPLINGS)
        .map(|_| right(&mean_db(&resampled(one)), &mean_db(&resampled(other))))
        .collect();
    let right = right(&mean_db(one), &mean_db(other));
    let alone = Interval {
        low: right,
        high: right,
    };
    Answer {
        right,
        interval: middle(shares).unwrap_or(alone),
    }
}

/// The level of the mean power of each third octave.
fn mean_db(presentations: &[Levels]) -> Levels {
    std::array::from_fn(|third| {
        let levels = presentations.iter().map(|levels| levels[third]);
        let powers = levels.map(|level| 10_f64.powf(0.1 * level));
        10.0 * (powers.sum::<f64>() / presentations.len() as f64).log10()
    })
}

fn right(one: &Levels, other: &Levels) -> f64 {
    let heard = one.iter().zip(other);
    let difference = heard
        .map(|(one, other)| one.max(MASKED_DB) - other.max(MASKED_DB))
        .fold(0.0_f64, |most, difference| most.max(difference.abs()));
    cdf(difference / LIMEN_DB * PROBABLE_ERROR)
}

pub fn csv_of(pairs: &[Pair]) -> String {
    csv(pairs.iter().flat_map(|pair| {
        let answers = Rendering::ALL.iter().zip(&pair.answers);
        answers.map(|(rendering, answer)| {
            Record::default()
                .with("one", &*pair.one)
                .with("other", &*pair.other)
                .with("rendering", rendering.name())
                .with("right", fixed(answer.right, 3))
                .with("low", fixed(answer.interval.low, 3))
                .with("high", fixed(answer.interval.high, 3))
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
