//! All of the experiments, once as big as the paper's and over and over.

use std::path::Path;

use protocol::{Method, SensorConfiguration};
use serde::Serialize;
use thiserror::Error;

use crate::psychophysics::given::StimulusSequence;
use crate::psychophysics::hand;
use crate::psychophysics::interval::{Interval, mean, middle, wilson};
use crate::psychophysics::job::Job;
use crate::psychophysics::limits;
use crate::psychophysics::mosteller::{Extreme, Test, test};
use crate::psychophysics::observer::GLIMPSE_S;
use crate::psychophysics::pair::Pair;
use crate::psychophysics::pairs;
use crate::psychophysics::pairs::mean_share;
use crate::psychophysics::presented::{ACTUATOR, Felt, IntegrationWindow};
use crate::psychophysics::published::{Limens, SAMPLES_MM, TABLE_2, TRIALS};
use crate::psychophysics::recount::Recount;
use crate::psychophysics::thresholds::Skin;
use crate::psychophysics::thurstone::{Scale, scale};
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::{Estimator, Scene};

/// How often the experiments are repeated for intervals.
const REPETITIONS: u32 = 2_000;
/// The gauges' noise while pairs are compared.
pub const SNR_DB: f64 = 20.0;
/// The bits of a seed that a scene's file may have: its numbers are signed.
const SCENE_SEED: u64 = u64::MAX >> 1;
/// How long each specimen is rubbed. All repetitions are of the same rubs: what another hand would change,
/// another seed shows.
const RUB_S: f64 = 4.0;
/// From when on it is felt: the boards have started.
const FELT_FROM_S: f64 = 0.5;
/// What the seeds of Table II, its clean twin, Table III, its long run and its repetitions have of their own.
const SALTS: [u64; 5] = [0x11 << 32, 0x22 << 32, 0x33 << 32, 0x44 << 32, 0x55 << 32];

/// Somebody whose wavelengths are compared: an estimator over specimens of some friction.
struct Contender {
    method: Method,
    friction: &'static str,
    name: &'static str,
}

/// Who is compared: the paper's count and the boards' default, with the plan's friction. Where that is none,
/// the count also meets specimens that stick a little, which the paper blames for its errors.
fn contenders(plan: &Plan) -> Vec<Contender> {
    let contender = |method, friction, name| Contender {
        method,
        friction,
        name,
    };
    let default = SensorConfiguration::DEFAULT.method;
    let mut contenders = vec![
        contender(Method::Counting, plan.friction, "counting"),
        contender(default, plan.friction, "default"),
    ];
    if plan.friction == FRICTIONS[0] {
        let sticks = contender(Method::Counting, FRICTIONS[1], "counting-mild");
        contenders.insert(1, sticks);
    }
    contenders
}

/// What is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// All chance comes from it.
    pub seed: u64,
    /// Trials of each pair.
    pub trials: u32,
    /// Repetitions of each experiment, for intervals.
    pub repetitions: u32,
    /// How sticky the specimens of Table III are, one of [`FRICTIONS`].
    pub friction: &'static str,
}

/// How sticky specimens may be: the `friction` of a scene's contact. From the second on the fingertip sticks and
/// slips, and the tangential channel is fitted, which the default estimator uses.
pub const FRICTIONS: [&str; 3] = ["none", "mild", "strong"];

impl Default for Plan {
    /// As big as the paper's, on specimens that do not stick.
    fn default() -> Self {
        Self {
            seed: 1,
            trials: TRIALS,
            repetitions: REPETITIONS,
            friction: FRICTIONS[0],
        }
    }
}

/// There is nothing to be felt.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{stimulus}: the actuators did not vibrate for one whole wave: nothing can be felt")]
pub struct Silent {
    stimulus: String,
}

/// The results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    pub(crate) engine: &'static str,
    pub(crate) seed: u64,
    pub(crate) trials: u32,
    pub(crate) repetitions: u32,
    pub(crate) friction: &'static str,
    pub(crate) glimpse_s: f64,
    given: Vec<Stimulus>,
    pub(crate) limens: Vec<Column>,
    /// Tables III and IV, for each of [`contenders`].
    pub(crate) methods: Vec<Compared>,
    #[serde(skip)]
    pub(crate) recount: Recount,
}

/// What a stimulus felt like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stimulus {
    pub wavelength_mm: f64,
    pub waves: usize,
    pub mean_mm: f64,
    /// Root mean square of its error over time.
    pub error_percent: f64,
    /// Root mean square of its distance from its mean over time.
    pub scatter_percent: f64,
    #[serde(skip)]
    pub felt: Felt,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Column {
    /// The paper's.
    pub paper: Limens,
    /// One experiment's.
    pub once: Limens,
    /// The mean over all repetitions.
    pub mean: Limens,
    /// The same if every stimulus were without error.
    pub clean: Limens,
    /// The middle 95 % of the repetitions' lower, upper and discrimination limens, in mm.
    pub lower: Option<Interval>,
    pub upper: Option<Interval>,
    pub limen: Option<Interval>,
}

/// A line of a column: its name, the paper's, one experiment's, all repetitions' and the clean ones' mean, in
/// mm, and the middle 95 % of the repetitions.
pub struct Line {
    pub name: &'static str,
    /// Paper, once, mean, clean.
    pub each_mm: [f64; 4],
    pub interval: Option<Interval>,
}

impl Column {
    /// The column, line by line.
    pub fn lines(&self) -> [Line; 4] {
        let line = |name, value: fn(&Limens) -> f64, interval| Line {
            name,
            each_mm: [&self.paper, &self.once, &self.mean, &self.clean].map(value),
            interval,
        };
        [
            line("lower limen", |l| l.lower_mm, self.lower),
            line("upper limen", |l| l.upper_mm, self.upper),
            line("discrimination limen", |l| l.limen_mm, self.limen),
            line("its SD over observers", |l| l.deviation_mm, None),
        ]
    }
}

/// What comparisons with one estimator came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    pub method: &'static str,
    pub samples: Vec<Stimulus>,
    pub once: Vec<Pair>,
    /// Wilson's interval of each of its shares.
    pub wilson: Vec<Interval>,
    /// Where the shares go in the long run.
    pub long_run: Vec<Pair>,
    /// The middle 95 % of the repetitions' mean shares.
    pub mean_share: Option<Interval>,
    /// Table IV of Table III, if it has one.
    pub scores: Option<Vec<f64>>,
    pub left_out: usize,
    /// Why there is none.
    pub no_scale: Option<String>,
    pub test: Option<Test>,
    /// Table IV of the long run.
    pub long_run_scores: Vec<f64>,
    /// Mosteller's χ² of the long run, as if its shares were of so many trials: how far Case V is off.
    pub long_run_test: Option<Test>,
    /// The middle 95 % of the repetitions' scores, of those that have a scale.
    pub score_intervals: Vec<Option<Interval>>,
    /// Share of the repetitions that have a scale.
    pub scaled: f64,
    /// Share of these in which Mosteller's test rejects Case V; none if there are none.
    pub rejected: Option<f64>,
    /// Mean share of correct answers in the long run if a sensation is gathered for a wave, for
    /// [`GLIMPSE_S`], and for a stroke.
    pub by_glimpse: [f64; 3],
}

/// What has to be run: long jobs first.
pub fn jobs(plan: &Plan) -> Vec<Job> {
    let mut jobs: Vec<Job> = courses().into_iter().map(Job::Display).collect();
    for contender in contenders(plan) {
        jobs.extend(SAMPLES_MM.map(|mm| Job::pair(rubbed(mm, &contender, plan))));
    }
    jobs
}

/// All comparison stimuli, in two runs for two cores.
fn courses() -> [StimulusSequence; 2] {
    let all_mm = limits::comparisons_mm();
    let (one, other) = all_mm.split_at(all_mm.len().div_ceil(2));
    [StimulusSequence::new(one), StimulusSequence::new(other)]
}

/// A specimen under a hand that strokes to and fro; the same hand and noise for every estimator.
fn rubbed(wavelength_mm: f64, contender: &Contender, plan: &Plan) -> Scene {
    let friction = contender.friction;
    let tangential = friction != FRICTIONS[0];
    let text = format!(
        "name = \"people-{}-{wavelength_mm}mm\"\nseed = {}\nduration_s = {RUB_S}\n\
         [surface]\nspecimens = [{{ wavelength_mm = {wavelength_mm:.1} }}]\n\
         [motion]\nspeed_mm_s = {}\n\
         [contact]\nfriction = \"{friction}\"\n\
         [gauges]\nsnr_db = {SNR_DB:.1}\ntangential = {tangential}\n",
        contender.name,
        plan.seed & SCENE_SEED,
        hand::PEAK_MM_S,
    );
    let scene = Scene::parse(Path::new("people"), &text).expect("a scene within its ranges");
    Scene {
        motion: hand::strokes(plan.seed, RUB_S),
        estimator: Estimator {
            method: contender.method,
            ..scene.estimator
        },
        ..scene
    }
}

impl Stimulus {
    fn new(wavelength_mm: f64, felt: Felt) -> Self {
        Self {
            wavelength_mm,
            waves: felt.waves.len(),
            mean_mm: felt.mean_mm(),
            error_percent: felt.error_percent(wavelength_mm),
            scatter_percent: felt.scatter_percent(),
            felt,
        }
    }
}

impl Study {
    pub(crate) fn stimuli(&self) -> impl Iterator<Item = (&'static str, &Stimulus)> {
        let given = self.given.iter().map(|stimulus| ("given", stimulus));
        given.chain(self.methods.iter().flat_map(|compared| {
            let samples = compared.samples.iter();
            samples.map(|stimulus| (compared.method, stimulus))
        }))
    }

    pub(crate) fn contender(&self, name: &str) -> Option<&Compared> {
        self.methods.iter().find(|compared| compared.method == name)
    }

    /// Makes the experiments with what [`jobs`] left, in its order.
    ///
    /// # Errors
    /// If the actuators were silent in one of them.
    ///
    /// # Panics
    /// If there are fewer recordings than jobs.
    pub fn new(plan: Plan, recordings: &[Recording]) -> Result<Self, Silent> {
        let (given, rubbed) = recordings.split_at(courses().len());
        let given = given_stimuli(given)?;
        let contenders = contenders(&plan).into_iter();
        let methods = contenders
            .zip(rubbed.chunks(SAMPLES_MM.len()))
            .map(|(contender, recordings)| Compared::new(contender.name, plan, recordings));
        let methods = methods.collect::<Result<_, _>>()?;
        let recount = Recount::new(plan.repetitions, plan.seed)
            .expect("the paper's Table III ties all samples together");
        Ok(Self {
            engine: recordings[0].engine.name(),
            seed: plan.seed,
            trials: plan.trials,
            repetitions: plan.repetitions,
            friction: plan.friction,
            glimpse_s: GLIMPSE_S,
            limens: columns(plan, &given),
            given,
            methods,
            recount,
        })
    }
}

fn given_stimuli(recordings: &[Recording]) -> Result<Vec<Stimulus>, Silent> {
    let felt = courses()
        .into_iter()
        .zip(recordings)
        .flat_map(|(course, recording)| course.felt(recording));
    let given = limits::comparisons_mm().into_iter().zip(felt);
    let stimulus = |(mm, felt): (f64, Option<Felt>)| {
        let felt = felt.ok_or_else(|| Silent {
            stimulus: format!("the display's stimulus of {mm} mm"),
        })?;
        Ok(Stimulus::new(mm, felt))
    };
    given.map(stimulus).collect()
}

fn columns(plan: Plan, given: &[Stimulus]) -> Vec<Column> {
    let glimpse = IntegrationWindow::Seconds(GLIMPSE_S);
    let real: Vec<Felt> = given.iter().map(|stimulus| stimulus.felt.clone()).collect();
    let clean = given.iter().map(|of| Felt::steady(of.wavelength_mm));
    let clean: Vec<Felt> = clean.collect();
    let tables = |stimuli: &[Felt], salt: u64| -> Vec<[Limens; 4]> {
        let seeds = (0..=u64::from(plan.repetitions)).map(|n| plan.seed ^ salt ^ n);
        let tables = seeds.map(|seed| limits::table(stimuli, &Skin::subjects(), glimpse, seed));
        tables.collect()
    };
    let (real, clean) = (tables(&real, SALTS[0]), tables(&clean, SALTS[1]));
    let column = |(column, paper): (usize, Limens)| {
        let spread = |value: fn(&Limens) -> f64| {
            middle(real[1..].iter().map(|of| value(&of[column])).collect())
        };
        Column {
            paper,
            once: real[0][column],
            mean: averaged(&real[1..], column),
            clean: averaged(&clean[1..], column),
            lower: spread(|limens| limens.lower_mm),
            upper: spread(|limens| limens.upper_mm),
            limen: spread(|limens| limens.limen_mm),
        }
    };
    TABLE_2.into_iter().enumerate().map(column).collect()
}

fn averaged(tables: &[[Limens; 4]], column: usize) -> Limens {
    let over = |value: fn(&Limens) -> f64| mean(tables.iter().map(|table| value(&table[column])));
    Limens {
        standard_mm: TABLE_2[column].standard_mm,
        lower_mm: over(|limens| limens.lower_mm),
        upper_mm: over(|limens| limens.upper_mm),
        limen_mm: over(|limens| limens.limen_mm),
        deviation_mm: over(|limens| limens.deviation_mm),
    }
}

impl Compared {
    fn new(method: &'static str, plan: Plan, recordings: &[Recording]) -> Result<Self, Silent> {
        let mut samples = Vec::new();
        for (wavelength_mm, recording) in SAMPLES_MM.into_iter().zip(recordings) {
            let felt = Felt::of(recording, ACTUATOR, FELT_FROM_S, recording.duration_s);
            let felt = felt.ok_or_else(|| Silent {
                stimulus: format!("{wavelength_mm} mm by {method}"),
            })?;
            samples.push(Stimulus::new(wavelength_mm, felt));
        }
        let felt: Vec<Felt> = samples.iter().map(|sample| sample.felt.clone()).collect();
        let glimpse = IntegrationWindow::Seconds(GLIMPSE_S);
        let Plan { seed, trials, .. } = plan;
        let once = pairs::table(&felt, trials, glimpse, seed ^ SALTS[2]);
        let long_run = |glimpse| pairs::long_run(&felt, trials, glimpse, seed ^ SALTS[3]);
        let again: Vec<Vec<Pair>> = (1..=u64::from(plan.repetitions))
            .map(|repetition| pairs::table(&felt, trials, glimpse, seed ^ SALTS[4] ^ repetition))
            .collect();
        let scales: Vec<(Scale, &Vec<Pair>)> = again
            .iter()
            .filter_map(|table| Some((scale(SAMPLES_MM.len(), table).ok()?, table)))
            .collect();
        let rejected = scales.iter().map(|(scale, table)| {
            let tested = test(&scale.scores, table, Extreme::HalfAnAnswer);
            f64::from(u8::from(tested.is_some_and(|test| test.rejects())))
        });
        let scaled = scale(SAMPLES_MM.len(), &once);
        let in_the_long_run = long_run(glimpse);
        // A share in the long run is never just 1.
        let long_run_scores = scale(SAMPLES_MM.len(), &in_the_long_run);
        let long_run_scores = long_run_scores
            .map(|scale| scale.scores)
            .unwrap_or_default();
        let wilson = once.iter().map(|pair| wilson(pair.correct, pair.trials));
        let of_once = scaled.as_ref().ok();
        let spread = |sample: usize| {
            middle(
                scales
                    .iter()
                    .map(|(scale, _)| scale.scores[sample])
                    .collect(),
            )
        };
        Ok(Self {
            method,
            wilson: wilson.collect(),
            mean_share: middle(again.iter().map(|table| mean_share(table)).collect()),
            test: of_once.and_then(|scale| test(&scale.scores, &once, Extreme::HalfAnAnswer)),
            left_out: match &scaled {
                Ok(scale) => scale.left_out,
                Err(refused) => refused.left_out,
            },
            no_scale: scaled.as_ref().err().map(ToString::to_string),
            scores: scaled.ok().map(|scale| scale.scores),
            long_run_test: test(&long_run_scores, &in_the_long_run, Extreme::AsItIs),
            long_run_scores,
            score_intervals: (0..SAMPLES_MM.len()).map(spread).collect(),
            scaled: scales.len() as f64 / again.len() as f64,
            rejected: Some(mean(rejected)).filter(|share| share.is_finite()),
            by_glimpse: [IntegrationWindow::Wave, glimpse, IntegrationWindow::Stroke]
                .map(|glimpse| mean_share(&long_run(glimpse))),
            samples,
            once,
            long_run: in_the_long_run,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Bench;
    use crate::psychophysics::run;

    const PLAN: Plan = Plan {
        seed: 1,
        trials: 10,
        repetitions: 200,
        friction: FRICTIONS[0],
    };

    fn study() -> Study {
        let recordings = run(&Bench::Native, &jobs(&PLAN), |_| {}).unwrap();
        Study::new(PLAN, &recordings).unwrap()
    }

    #[test]
    fn the_stimulus_of_the_default_estimator_costs_next_to_nothing_and_that_of_the_count_does() {
        let study = study();
        let counting = study.contender("counting").unwrap();
        let default = study.contender("default").unwrap();
        // The study's prediction for no noise at all is 0.993; the default's estimates are within 1 %.
        let without_noise = 0.993;
        let share = |compared: &Compared| mean_share(&compared.long_run);
        assert!(share(default) > without_noise - 0.005, "{}", share(default));
        assert!(
            share(counting) < share(default) - 0.005,
            "{}",
            share(counting)
        );
        for (counted, sample) in counting.samples.iter().zip(&default.samples) {
            assert!(counted.error_percent > sample.error_percent);
        }
    }

    #[test]
    fn a_count_over_specimens_that_stick_is_felt_far_worse() {
        let study = study();
        let share = |name| mean_share(&study.contender(name).unwrap().long_run);
        assert!(share("counting-mild") < share("counting") - 0.02);
    }

    #[test]
    fn the_display_adds_nothing_to_table_2() {
        for column in study().limens {
            // 200 tables of twelve series each, whose limens have a standard deviation of 0.3 mm at most:
            // four of 0.3/√2400 mm each way.
            let bound_mm = 4.0 * std::f64::consts::SQRT_2 * 0.3 / 2400f64.sqrt();
            let added_mm = column.mean.limen_mm - column.clean.limen_mm;
            assert!(added_mm.abs() < bound_mm, "{added_mm}");
            assert!(column.limen.is_some_and(|i| i.low <= i.high));
        }
    }

    #[test]
    fn one_seed_gives_one_study() {
        let recordings = run(&Bench::Native, &jobs(&PLAN), |_| {}).unwrap();
        assert_eq!(Study::new(PLAN, &recordings), Study::new(PLAN, &recordings));
    }
}
