//! Is an estimate's confidence a probability? Of the estimates with confidence p, a share p ought to be
//! within 5 % of the truth, on surfaces that nothing was fitted on: a reliability diagram, the expected
//! calibration error, and what is right, wrong and silent for each level of confidence from which on an
//! estimate is stood by.
//!
//! Intervals are by the bootstrap over surfaces: estimates of one surface depend on each other.

pub mod picture;
pub mod strangers;

use protocol::SensorConfiguration;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::psychophysics::interval::{Interval, middle};
use crate::study::{Fixed, Study, csv_text};

/// Relative error within which an estimate is right.
pub const RIGHT: f64 = 0.05;
/// Relative error above which it is wrong, if it is stood by.
pub const WRONG: f64 = 0.1;
/// Goal of the expected calibration error.
pub const GOAL: f64 = 0.05;
/// Bins of the diagram, equally wide.
pub const BINS: usize = 10;
/// Levels of confidence: whole percents, 0 to 100.
pub const LEVELS: usize = 101;
/// Surfaces are drawn anew so often for the intervals.
const RESAMPLES: usize = 1_000;
const SEED: u64 = 1;

/// Estimates of one surface that fell into a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bin {
    /// How many.
    pub estimates: u32,
    /// Their confidence, added up.
    pub confidence: f64,
    /// How many of them were right.
    pub right: u32,
}

impl Bin {
    fn add(&mut self, other: &Self) {
        self.estimates += other.estimates;
        self.confidence += other.confidence;
        self.right += other.right;
    }

    /// Mean confidence and share of right ones; none if it is empty.
    pub fn means(&self) -> Option<(f64, f64)> {
        let count = f64::from(self.estimates);
        (self.estimates > 0).then(|| (self.confidence / count, f64::from(self.right) / count))
    }
}

/// What came of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// Its class, for tables.
    pub class: &'static str,
    /// Whether any λ is right there.
    pub has_a_period: bool,
    /// Estimates with a λ while the arm moved, by confidence.
    pub bins: [Bin; BINS],
    /// Estimates that count for the levels, with a λ or without.
    pub counted: u32,
    /// Of those, the ones with a λ, by confidence in whole percents, rounded down: within 5 %.
    pub right: [u32; LEVELS],
    /// More than 10 % off, or any λ where there is no period.
    pub wrong: [u32; LEVELS],
    /// All.
    pub said: [u32; LEVELS],
}

impl Tally {
    /// Before anything was said.
    pub fn new(class: &'static str, has_a_period: bool) -> Self {
        Self {
            class,
            has_a_period,
            bins: [Bin::default(); BINS],
            counted: 0,
            right: [0; LEVELS],
            wrong: [0; LEVELS],
            said: [0; LEVELS],
        }
    }

    /// Counts an estimate: its confidence, 0 to 1, and its relative error (any, but infinite where there is no
    /// period).
    pub fn heard(&mut self, confidence: f32, error: f64) {
        let confidence = f64::from(confidence).clamp(0.0, 1.0);
        let bin = &mut self.bins[((confidence * BINS as f64) as usize).min(BINS - 1)];
        bin.estimates += 1;
        bin.confidence += confidence;
        bin.right += u32::from(error.abs() <= RIGHT);
    }

    /// Counts an estimate for the levels; none if it has no λ.
    pub fn judged(&mut self, said: Option<(f32, f64)>) {
        self.counted += 1;
        let Some((confidence, error)) = said else {
            return;
        };
        // A hundredth of a percent up, so that 0.9f32 is 90 %.
        let level = (f64::from(confidence).clamp(0.0, 1.0) * 100.0 + 0.01) as usize;
        self.said[level] += 1;
        self.right[level] += u32::from(error.abs() <= RIGHT);
        self.wrong[level] += u32::from(error.abs() > WRONG);
    }
}

/// A bin over all surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// All of its estimates.
    pub bin: Bin,
    /// Where the share of right ones may really lie.
    pub interval: Option<Interval>,
}

/// What a level of confidence gives, as shares of the estimates that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Estimates from this confidence on, in percent, are stood by.
    pub percent: u8,
    /// Surfaces with a period: within 5 %.
    pub right: f64,
    /// The same: more than 10 % off.
    pub wrong: f64,
    /// The same: nothing is stood by.
    pub silent: f64,
    /// Surfaces without a period: anything is stood by.
    pub plain: f64,
}

/// The whole answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Reliability {
    /// Surfaces asked.
    pub surfaces: usize,
    /// The bins, by rising confidence.
    pub bars: Vec<Bar>,
    /// Expected calibration error: the mean distance of a bin's share of right ones from its mean
    /// confidence, each bin weighing as much as it has estimates. None without any.
    pub error: Option<f64>,
    /// Where it may really lie.
    pub error_interval: Option<Interval>,
    /// The levels 0 to 100 %.
    pub levels: Vec<Level>,
    /// The classes and their estimates, those of one class as one bin.
    pub classes: Vec<(&'static str, Bin)>,
}

impl Reliability {
    /// Of these surfaces.
    pub fn of(tallies: &[Tally]) -> Self {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut shares: [Vec<f64>; BINS] = std::array::from_fn(|_| Vec::new());
        let mut errors = Vec::new();
        for _ in 0..RESAMPLES {
            let drawn = (0..tallies.len()).map(|_| &tallies[draws.random_range(0..tallies.len())]);
            let bins = sum(drawn);
            for (shares, bin) in shares.iter_mut().zip(&bins) {
                shares.extend(bin.means().map(|(_, share)| share));
            }
            errors.extend(calibration_error(&bins));
        }
        let bins = sum(tallies.iter());
        Self {
            surfaces: tallies.len(),
            bars: bins
                .into_iter()
                .zip(shares)
                .map(|(bin, shares)| Bar {
                    bin,
                    interval: middle(shares),
                })
                .collect(),
            error: calibration_error(&bins),
            error_interval: middle(errors),
            levels: levels(tallies),
            classes: classes(tallies),
        }
    }

    /// Whether the goal is met; not without any estimate.
    pub fn meets_goal(&self) -> bool {
        self.error.is_some_and(|error| error <= GOAL)
    }
}

/// A bin, a level or a class.
#[derive(Default, Serialize)]
struct Record {
    what: &'static str,
    of: String,
    estimates: Option<u32>,
    confidence: Fixed<5>,
    right: Fixed<5>,
    low: Fixed<5>,
    high: Fixed<5>,
    wrong: Fixed<5>,
    silent: Fixed<5>,
    plain: Fixed<5>,
}

impl Record {
    fn of_bin(what: &'static str, of: String, bin: &Bin, interval: Option<Interval>) -> Self {
        let (confidence, right) = bin.means().unzip();
        let ends = interval.map(|interval| (interval.low, interval.high));
        let (low, high) = ends.unzip();
        Self {
            what,
            of,
            estimates: Some(bin.estimates),
            confidence: confidence.into(),
            right: right.into(),
            low: low.into(),
            high: high.into(),
            ..Self::default()
        }
    }

    fn of_level(level: &Level) -> Self {
        Self {
            what: "level",
            of: level.percent.to_string(),
            right: level.right.into(),
            wrong: level.wrong.into(),
            silent: level.silent.into(),
            plain: level.plain.into(),
            ..Self::default()
        }
    }
}

impl Study for Reliability {
    const NAME: &'static str = "confidence";

    /// The bins, then the levels, then the classes.
    fn csvs(&self) -> Result<Vec<(&'static str, String)>, csv::Error> {
        let bins = self.bars.iter().enumerate().map(|(index, bar)| {
            let from = format!("{:.1}", index as f64 / BINS as f64);
            Record::of_bin("bin", from, &bar.bin, bar.interval)
        });
        let levels = self.levels.iter().map(Record::of_level);
        let classes = self.classes.iter();
        let classes =
            classes.map(|(class, bin)| Record::of_bin("class", (*class).to_owned(), bin, None));
        Ok(vec![("", csv_text(bins.chain(levels).chain(classes))?)])
    }

    fn picture(&self) -> String {
        picture::draw(self, SensorConfiguration::DEFAULT.valid_percent)
    }

    fn is_met(&self) -> bool {
        self.meets_goal()
    }
}

/// All surfaces' bins as one's.
fn sum<'a>(tallies: impl Iterator<Item = &'a Tally>) -> [Bin; BINS] {
    tallies.fold([Bin::default(); BINS], |mut bins, tally| {
        for (bin, more) in bins.iter_mut().zip(&tally.bins) {
            bin.add(more);
        }
        bins
    })
}

fn calibration_error(bins: &[Bin]) -> Option<f64> {
    let (mut apart, mut estimates) = (0.0, 0.0);
    for bin in bins {
        if let Some((confidence, share)) = bin.means() {
            apart += (confidence - share).abs() * f64::from(bin.estimates);
            estimates += f64::from(bin.estimates);
        }
    }
    (estimates > 0.0).then(|| apart / estimates)
}

fn levels(tallies: &[Tally]) -> Vec<Level> {
    let counted = |has_a_period: bool| -> f64 {
        let those = tallies.iter().filter(|t| t.has_a_period == has_a_period);
        those.map(|tally| f64::from(tally.counted)).sum::<f64>()
    };
    let from = |has_a_period: bool, level: usize, which: fn(&Tally) -> &[u32; LEVELS]| -> f64 {
        let those = tallies.iter().filter(|t| t.has_a_period == has_a_period);
        let count: u64 = those
            .flat_map(|tally| &which(tally)[level..])
            .map(|count| u64::from(*count))
            .sum();
        let all = counted(has_a_period);
        if all > 0.0 { count as f64 / all } else { 0.0 }
    };
    (0..LEVELS)
        .map(|level| Level {
            percent: level as u8,
            right: from(true, level, |tally| &tally.right),
            wrong: from(true, level, |tally| &tally.wrong),
            silent: 1.0 - from(true, level, |tally| &tally.said),
            plain: from(false, level, |tally| &tally.said),
        })
        .collect()
}

/// Each class's estimates as one bin, in the classes' order of appearance by name.
fn classes(tallies: &[Tally]) -> Vec<(&'static str, Bin)> {
    let mut classes = std::collections::BTreeMap::<_, Bin>::new();
    for tally in tallies {
        // Those with a period first.
        let class = classes
            .entry((!tally.has_a_period, tally.class))
            .or_default();
        for bin in &tally.bins {
            class.add(bin);
        }
    }
    classes
        .into_iter()
        .map(|((_, class), bin)| (class, bin))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Surfaces whose estimates are right as often as `share` says of their confidence.
    fn surfaces(share: impl Fn(f64) -> f64) -> Vec<Tally> {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(2);
        (0..200)
            .map(|_| {
                let mut tally = Tally::new("made up", true);
                for _ in 0..100 {
                    let confidence: f64 = draws.random_range(0.0..1.0);
                    let right = draws.random_range(0.0..1.0) < share(confidence);
                    let error = if right { 0.0 } else { 0.5 };
                    tally.heard(confidence as f32, error);
                    tally.judged(Some((confidence as f32, error)));
                }
                tally
            })
            .collect()
    }

    #[test]
    fn a_probability_has_next_to_no_calibration_error() {
        let reliability = Reliability::of(&surfaces(|confidence| confidence));
        // A bin has 2 000 estimates: the mean of |its share − its confidence| is at most √(2/π · ¼/2000)
        // = 0.9 %, and the mean over ten of them is known to a quarter of that.
        assert!(
            reliability.error.unwrap() < 0.015,
            "{:?}",
            reliability.error
        );
        assert!(reliability.meets_goal());
        // Of ten intervals of 95 %, two that miss are already rare (9 %), three very (1 %).
        let missed = reliability.bars.iter().filter(|bar| {
            let confidence = bar.bin.means().unwrap().0;
            let interval = bar.interval.unwrap();
            !(interval.low..=interval.high).contains(&confidence)
        });
        assert!(missed.count() < 3);
    }

    #[test]
    fn too_much_confidence_is_an_error_of_as_much() {
        // p² in place of p: the mean of p − p² over 0 to 1 is 1/6.
        let reliability = Reliability::of(&surfaces(|confidence| confidence * confidence));
        let error = reliability.error.unwrap();
        // Each p is known to ± 0.9 % as above, all of the same sign: 20 000 estimates give ± 0.35 %; 4 σ.
        assert!((error - 1.0 / 6.0).abs() < 0.014, "{error}");
        let interval = reliability.error_interval.unwrap();
        assert!((interval.low..=interval.high).contains(&error));
        assert!(!reliability.meets_goal());
    }

    #[test]
    fn a_level_trades_right_against_wrong_and_silence() {
        let mut ridges = Tally::new("ridges", true);
        for (confidence, error) in [(0.9, 0.01), (0.9, 0.2), (0.5, -0.04), (0.5, 0.07)] {
            ridges.judged(Some((confidence, error)));
        }
        ridges.judged(None);
        let mut flat = Tally::new("flat", false);
        flat.judged(Some((0.6, f64::INFINITY)));
        flat.judged(None);
        let levels = Reliability::of(&[ridges, flat]).levels;
        let at = |percent: usize| levels[percent];
        assert_eq!(levels.len(), LEVELS);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(close(at(50).right, 0.4) && close(at(50).wrong, 0.2) && close(at(50).silent, 0.2));
        assert!(close(at(90).right, 0.2) && close(at(90).wrong, 0.2) && close(at(90).silent, 0.6));
        assert!(close(at(91).right, 0.0) && close(at(91).silent, 1.0));
        assert!(close(at(60).plain, 0.5) && close(at(61).plain, 0.0));
    }

    #[test]
    fn nothing_said_is_no_answer_and_misses_the_goal() {
        let silent = Reliability::of(&[Tally::new("flat", false)]);
        assert_eq!(silent.error, None);
        assert!(!silent.meets_goal());
        // The columns, the bins, the levels and a class.
        let csv = &silent.csvs().unwrap()[0].1;
        assert_eq!(csv.lines().count(), 1 + BINS + LEVELS + 1);
    }
}
