//! Is an estimate's confidence a probability? Of the estimates with confidence p, a share p ought to be
//! within 5 % of the truth, on surfaces that nothing was fitted on: a reliability diagram, the expected
//! calibration error, and what is right, wrong and silent for each level of confidence from which on an
//! estimate is stood by.
//!
//! Intervals are by the bootstrap over surfaces: estimates of one surface depend on each other.

mod picture;
mod strangers;

use std::collections::BTreeMap;

use protocol::SensorConfiguration;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::jury::counts::{RIGHT, WRONG};
use crate::psychophysics::interval::{Interval, middle};
use crate::study::{Progress, Record, Study, Table, csv, fixed, number, short};

/// Goal of the expected calibration error.
const GOAL: f64 = 0.05;
/// Bins of the diagram, equally wide.
const BINS: usize = 10;
/// Levels of confidence: whole percents, 0 to 100.
const LEVELS: usize = 101;
/// Levels of the printed table, in percent.
const TOLD: [usize; 8] = [0, 50, 70, 80, 85, 90, 95, 98];
/// Surfaces are drawn anew so often for the intervals.
const RESAMPLES: usize = 1_000;
const SEED: u64 = 1;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    estimates: u32,
    confidence: f64,
    right: u32,
}

impl Bin {
    fn add(&mut self, other: &Self) {
        self.estimates += other.estimates;
        self.confidence += other.confidence;
        self.right += other.right;
    }

    /// Mean confidence and share of right ones; none if it is empty.
    fn means(&self) -> Option<(f64, f64)> {
        let count = f64::from(self.estimates);
        (self.estimates > 0).then(|| (self.confidence / count, f64::from(self.right) / count))
    }
}

#[derive(Clone, Debug, PartialEq)]
struct Tally {
    class: &'static str,
    /// Whether any λ is right there.
    has_a_period: bool,
    /// Estimates with a λ while the arm moved, by confidence.
    bins: [Bin; BINS],
    /// Estimates that count for the levels, with a λ or without.
    counted: u32,
    /// Of those, the ones with a λ, by confidence in whole percents, rounded down: within 5 %.
    right: [u32; LEVELS],
    /// More than 10 % off, or any λ where there is no period.
    wrong: [u32; LEVELS],
    /// All.
    said: [u32; LEVELS],
}

impl Tally {
    fn new(class: &'static str, has_a_period: bool) -> Self {
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
    fn heard(&mut self, confidence: f32, error: f64) {
        let confidence = f64::from(confidence).clamp(0.0, 1.0);
        self.bins[((confidence * BINS as f64) as usize).min(BINS - 1)].add(&Bin {
            estimates: 1,
            confidence,
            right: u32::from(error.abs() <= RIGHT),
        });
    }

    /// Counts an estimate for the levels; none if it has no λ.
    fn judged(&mut self, said: Option<(f32, f64)>) {
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

/// What a level of confidence gives, as shares of the estimates that count.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    percent: u8,
    /// Surfaces with a period: within 5 %.
    right: f64,
    /// The same: more than 10 % off.
    wrong: f64,
    /// The same: nothing is stood by.
    silent: f64,
    /// Surfaces without a period: anything is stood by.
    plain: f64,
}

/// The whole answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Reliability {
    surfaces: usize,
    /// The bins of all surfaces by rising confidence, each with where its share of right ones may really lie.
    bars: Vec<(Bin, Option<Interval>)>,
    /// Expected calibration error: the mean distance of a bin's share of right ones from its mean
    /// confidence, each bin weighing as much as it has estimates. None without any.
    error: Option<f64>,
    error_interval: Option<Interval>,
    levels: Vec<Level>,
    /// The classes and their estimates, those of one class as one bin.
    classes: Vec<(&'static str, Bin)>,
}

/// Asks the firmware's sensor about the surfaces of these seeds.
pub fn measure(seeds: &[u64], progress: &impl Progress) -> Reliability {
    Reliability::of(&strangers::ask(
        seeds,
        SensorConfiguration::DEFAULT,
        progress,
    ))
}

impl Reliability {
    fn of(tallies: &[Tally]) -> Self {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut shares = [const { Vec::new() }; BINS];
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
            bars: bins.into_iter().zip(shares.map(middle)).collect(),
            error: calibration_error(&bins),
            error_interval: middle(errors),
            levels: levels(tallies),
            classes: classes(tallies),
        }
    }

    fn told_interval(&self) -> String {
        let ends = |interval: Interval| format!(" ({:.3}–{:.3})", interval.low, interval.high);
        self.error_interval.map_or(String::new(), ends)
    }
}

fn told(of: &'static str, which: &str, bin: &Bin) -> Record {
    let (confidence, share) = bin.means().unzip();
    Record::default()
        .with(of, which)
        .with("estimates:", short(bin.estimates))
        .with("mean confidence:", number(confidence, 3))
        .with("within 5 %:", number(share, 3))
}

fn record(
    what: &str,
    of: &str,
    bin: Option<&Bin>,
    ends: Option<Interval>,
    level: Option<&Level>,
) -> Record {
    let (confidence, right) = bin.and_then(Bin::means).unzip();
    Record::default()
        .with("what", what)
        .with("of", of)
        .with("estimates", bin.map(|bin| short(bin.estimates)))
        .with("confidence", fixed(confidence, 5))
        .with("right", fixed(right.or(level.map(|level| level.right)), 5))
        .with("low", fixed(ends.map(|ends| ends.low), 5))
        .with("high", fixed(ends.map(|ends| ends.high), 5))
        .with("wrong", fixed(level.map(|level| level.wrong), 5))
        .with("silent", fixed(level.map(|level| level.silent), 5))
        .with("plain", fixed(level.map(|level| level.plain), 5))
}

impl Study for Reliability {
    const NAME: &'static str = "confidence";

    fn text(&self) -> Option<String> {
        let bins = self
            .bars
            .iter()
            .enumerate()
            .map(|(index, (bin, interval))| {
                let end = |index: usize| index as f64 / BINS as f64;
                let interval = interval.map(|of| format!("{:.3}–{:.3}", of.low, of.high));
                let range = format!("{:.1}–{:.1}", end(index), end(index + 1));
                told("confidence", &range, bin)
                    .with("95 % interval", interval.unwrap_or("–".to_owned()))
            });
        let levels = TOLD.map(|level| &self.levels[level]).map(|level| {
            Record::default()
                .with("stood by from:", format!("{} %", level.percent))
                .with("right:", number(level.right, 3))
                .with("wrong:", number(level.wrong, 4))
                .with("silent:", number(level.silent, 3))
                .with("without a period: stood by:", number(level.plain, 4))
        });
        let classes = self
            .classes
            .iter()
            .map(|(class, bin)| told("class", class, bin));
        Some(format!(
            "{}\n\nExpected calibration error over {} surfaces: {}{}; goal {GOAL}.\n\n{}\n\n{}\n",
            Table::from_iter(bins),
            self.surfaces,
            number(self.error, 3),
            self.told_interval(),
            Table::from_iter(levels),
            Table::from_iter(classes),
        ))
    }

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let bins = self
            .bars
            .iter()
            .enumerate()
            .map(|(index, (bin, interval))| {
                let from = format!("{:.1}", index as f64 / BINS as f64);
                record("bin", &from, Some(bin), *interval, None)
            });
        let levels = self.levels.iter().map(|level| {
            let percent = level.percent.to_string();
            record("level", &percent, None, None, Some(level))
        });
        let classes = self.classes.iter();
        let classes = classes.map(|(class, bin)| record("class", class, Some(bin), None, None));
        vec![("", csv(bins.chain(levels).chain(classes)))]
    }

    fn picture(&self) -> String {
        picture::draw(self, SensorConfiguration::DEFAULT.valid_percent)
    }

    fn is_met(&self) -> bool {
        self.error.is_some_and(|error| error <= GOAL)
    }
}

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
    let from = |has_a_period: bool, level: usize, which: fn(&Tally) -> &[u32; LEVELS]| -> f64 {
        let those = || tallies.iter().filter(|t| t.has_a_period == has_a_period);
        let counts = those().flat_map(|tally| &which(tally)[level..]);
        let count: u64 = counts.map(|count| u64::from(*count)).sum();
        let all: f64 = those().map(|tally| f64::from(tally.counted)).sum();
        if all > 0.0 { count as f64 / all } else { 0.0 }
    };
    let level = |level: usize| Level {
        percent: level as u8,
        right: from(true, level, |tally| &tally.right),
        wrong: from(true, level, |tally| &tally.wrong),
        silent: 1.0 - from(true, level, |tally| &tally.said),
        plain: from(false, level, |tally| &tally.said),
    };
    (0..LEVELS).map(level).collect()
}

/// Each class's estimates as one bin, in the classes' order of appearance by name.
fn classes(tallies: &[Tally]) -> Vec<(&'static str, Bin)> {
    let mut classes = BTreeMap::<_, Bin>::new();
    for tally in tallies {
        // Those with a period first.
        let class = classes
            .entry((!tally.has_a_period, tally.class))
            .or_default();
        tally.bins.iter().for_each(|bin| class.add(bin));
    }
    let classes = classes.into_iter();
    classes.map(|((_, class), bin)| (class, bin)).collect()
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
        assert!(reliability.is_met());
        // Of ten intervals of 95 %, two that miss are already rare (9 %), three very (1 %).
        let missed = reliability.bars.iter().filter(|(bin, interval)| {
            let confidence = bin.means().unwrap().0;
            let interval = interval.unwrap();
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
        assert!(!reliability.is_met());
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
        assert!(!silent.is_met());
        // The columns, the bins, the levels and a class.
        let csv = &silent.csvs()[0].1;
        assert_eq!(csv.lines().count(), 1 + BINS + LEVELS + 1);
    }
}
