//! `hil-sim jury`.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::ValueEnum;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::scene::Scene;
use hil_sim_studies::bench::Bench;
use hil_sim_studies::jury::counts::Counts;
use hil_sim_studies::jury::evidence;
use hil_sim_studies::jury::evidence::Cases;
use hil_sim_studies::jury::folder::Entry;
use hil_sim_studies::jury::play::{Played, play};
use hil_sim_studies::jury::seeds::Seeds;
use hil_sim_studies::jury::stranger::{Class, Trial};
use hil_sim_studies::jury::table;
use hil_sim_studies::jury::table::{Row, Weighed};
use protocol::{DisplayConfiguration, Method, SensorConfiguration};
use serde::Serialize;

use super::files::{Format, Results};
use super::run_options;
use super::say::say;
use super::{Elves, EngineName, threads, under_bar};

/// Surfaces named as the worst.
const WORST: usize = 8;

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Seeds:
      1 –  9999  to tune on: look at them as often as you like
  10000 – 19999  to report from: nothing is changed for what one of them does
Each seed is a surface, a hand and a fingertip; CONTRIBUTING.md says more.

right:  valid and within 5 % of the truth; of a shape, within a limen of 2.2 dB, whichever way up
wrong:  valid and more than 10 % off, or valid where there is no period; of a shape, more than two limens off
silent: not valid
shape:  of the textures that are told where a surface has one wave alone
felt:   the same of the λ that the display drives at, with its hold and fade
All of them are shares of the time in motion (above 5 mm/s, v/λ within 2.5–150 Hz), from 3 λ of travel on after
the start and after each boundary; in a folder, of all estimates from 1 s on, as a mean over its scenes.

Exit status:
  0  judged, whatever came of it
  2  an argument, a folder or a scene cannot be used")]
pub(super) struct Jury {
    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How many surfaces, a seed each: a million at most
    #[arg(long, value_name = "COUNT", default_value_t = 200, value_parser = clap::value_parser!(u64).range(..=1_000_000))]
    surfaces: u64,
    /// Judge the scenes of this folder instead, which has an index.json with their truths
    #[arg(long, value_name = "DIR", conflicts_with_all = ["seed", "surfaces", "force_channel", "traits", "shapes"])]
    folder: Option<PathBuf>,
    /// What runs a folder's scenes
    #[arg(long, value_enum, default_value_t = EngineName::Native)]
    engine: EngineName,
    /// How λ is estimated [default: as configured on a board; in a folder, as each scene says]
    #[arg(long, value_enum)]
    method: Option<MethodName>,
    /// Confidence from which on an estimate is valid, in percent, 50 to 99 [default: as above]
    #[arg(long, value_name = "PERCENT", value_parser = clap::value_parser!(u8).range(50..=99))]
    valid_percent: Option<u8>,
    /// Age of the last valid estimate at which the display fades out at the latest, in ms, 20 to 5 000 [default: as above]
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u16).range(20..=5_000))]
    max_age_ms: Option<u16>,
    /// Print the table by what makes surfaces hard, too
    #[arg(long)]
    traits: bool,
    /// Give the fingertips a tangential force channel, of which the sensor is told
    #[arg(long)]
    force_channel: bool,
    /// Print what textures tell of the wave's shape, too
    #[arg(long)]
    shapes: bool,
    /// Print the weights of the default estimator's evidence that these surfaces ask for, and judge nothing
    #[arg(long, conflicts_with_all = ["folder", "method", "valid_percent", "max_age_ms", "force_channel", "traits", "shapes", "json"])]
    weights: bool,
    /// Where to write everything as JSON, surface by surface
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Surfaces at a time; 0: one per core. The results are the same
    #[arg(short, long, value_name = "N", default_value_t = 0)]
    jobs: usize,
    #[command(flatten)]
    elves: Elves,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    /// The default estimator
    Spectrum,
    /// Crossings, their spacing taken in position
    Crossings,
    /// The paper's count
    Counting,
    /// The paper's count in the window that equation (11) asks for
    CountingAdapted,
}

/// What is written of strangers.
#[derive(Serialize)]
struct Strangers {
    first_seed: u64,
    surfaces: u64,
    purpose: &'static str,
    method: &'static str,
    force_channel: bool,
    valid_percent: u8,
    max_age_ms: u16,
    intervals: &'static str,
    classes: Vec<Row>,
    traits: Vec<Row>,
    shapes: Vec<Row>,
    trials: Vec<Judged>,
}

/// One stranger, judged.
#[derive(Serialize)]
struct Judged {
    seed: u64,
    class: &'static str,
    traits: Vec<&'static str>,
    said: Counts,
    felt: Counts,
    shaped: Counts,
    #[serde(skip)]
    trial: Trial,
}

/// What is written of a folder.
#[derive(Serialize)]
struct Folder {
    folder: PathBuf,
    engine: &'static str,
    intervals: &'static str,
    families: Vec<Row>,
    scenes: Vec<JudgedScene>,
}

/// One scene, judged.
#[derive(Serialize)]
struct JudgedScene {
    name: String,
    family: String,
    method: &'static str,
    said: Counts,
    felt: Option<Felt>,
}

/// What the operator's finger got of a scene, as shares of the moving time.
#[derive(Clone, Copy, Serialize)]
struct Felt {
    right: f64,
    wrong: f64,
}

impl Jury {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        anyhow::ensure!(
            self.folder.is_some() || matches!(self.engine, EngineName::Native),
            "--engine elf: runs the scenes of a folder, and there is none: give --folder too, or take it out"
        );
        let json = Results::wanted(self.json.as_deref(), Format::JsonObject)?;
        if self.weights {
            self.find_weights()?;
            return Ok(ExitCode::SUCCESS);
        }
        match &self.folder {
            Some(folder) => self.judge_folder(folder, json)?,
            None => self.judge_strangers(json)?,
        }
        Ok(ExitCode::SUCCESS)
    }

    fn find_weights(&self) -> anyhow::Result<()> {
        let seeds = self.seeds();
        let purpose = seeds.purpose()?.name();
        let cases_of = |&seed: &u64| Ok(Cases::of(&Trial::draw(seed).record()));
        let mut cases = Cases::default();
        for of_one in self.of_surfaces(cases_of) {
            cases.extend(of_one);
        }
        let last = self.seed.saturating_add(self.surfaces - 1);
        say!("seeds {}–{last} ({purpose})", self.seed);
        for (name, weights) in [
            ("LINE", evidence::weights(&cases.line)),
            ("WAVE", evidence::weights(&cases.wave)),
        ] {
            let weights: Vec<String> = weights.iter().map(|w| format!("{w:.3}")).collect();
            say!("{name}: [{}]", weights.join(", "));
        }
        Ok(())
    }

    fn seeds(&self) -> Seeds {
        Seeds {
            first: self.seed,
            count: self.surfaces,
        }
    }

    /// What `work` makes of each seed's surface.
    fn of_surfaces<O: Send>(&self, work: impl Fn(&u64) -> Result<O, Infallible> + Sync) -> Vec<O> {
        let Ok(made) = under_bar(&self.seeds().all(), threads(self.jobs), "surfaces", work);
        made
    }

    fn judge_strangers(&self, json: Option<Results>) -> anyhow::Result<()> {
        let seeds = self.seeds();
        let purpose = seeds.purpose()?.name();
        let mut sensor = SensorConfiguration::DEFAULT;
        if let Some(method) = self.method {
            sensor.method = method.into();
        }
        if let Some(percent) = self.valid_percent {
            sensor.valid_percent = percent;
        }
        let mut display = DisplayConfiguration::DEFAULT;
        if let Some(max_age_ms) = self.max_age_ms {
            display.max_age_ms = max_age_ms;
        }
        let settings =
            firmware_display::Settings::new(display, &protocol::actuators::DEFAULT_ACTUATORS)
                .map_err(|refusal| anyhow::anyhow!("--max-age-ms: {refusal}"))?;
        let method = sensor.method.name();

        let trials = self.of_surfaces(|&seed| {
            let mut trial = Trial::draw(seed);
            if self.force_channel {
                trial = trial.with_force_channel();
            }
            let sensor = trial.force.map_or(sensor, |force| force.told(sensor));
            let Played { said, felt, shaped } = play(&trial.record(), sensor, &settings);
            Ok(Judged {
                seed,
                class: trial.class.name(),
                traits: trial.traits(),
                said,
                felt,
                shaped,
                trial,
            })
        });

        let last = self.seed.saturating_add(self.surfaces - 1);
        say!(
            "seeds {}–{last} ({purpose}), method {method}{}, valid from {} %, display holds {} ms; intervals: {}",
            self.seed,
            if self.force_channel {
                ", force channel"
            } else {
                ""
            },
            sensor.valid_percent,
            display.max_age_ms,
            table::INTERVALS
        );
        let classes = by_class(&trials);
        say!("{}", table::text("class", "surfaces", &classes));
        let traits = by_trait(&trials);
        if self.traits {
            say!("\nof the surfaces with a period, those with");
            say!("{}", table::text("trait", "surfaces", &traits));
        }
        let shapes = by_shape(&trials);
        if self.shapes {
            say!("\nof one wave alone, its shape by what textures tell");
            say!("{}", table::text("class", "surfaces", &shapes));
        }
        say_worst(&trials);
        write(
            json,
            &Strangers {
                first_seed: self.seed,
                surfaces: self.surfaces,
                purpose,
                method,
                force_channel: self.force_channel,
                valid_percent: sensor.valid_percent,
                max_age_ms: display.max_age_ms,
                intervals: table::INTERVALS,
                classes,
                traits,
                shapes,
                trials,
            },
        )
    }

    fn judge_folder(&self, folder: &Path, json: Option<Results>) -> anyhow::Result<()> {
        let mut scenes = run_options::of_folder(folder, self.engine)?;
        for (_, scene) in &mut scenes {
            if let Some(method) = self.method {
                scene.estimator.method = method.into();
            }
            if let Some(percent) = self.valid_percent {
                scene.estimator.valid_percent = percent;
            }
            if let Some(max_age_ms) = self.max_age_ms {
                scene.display.configuration.max_age_ms = max_age_ms;
            }
        }
        let bench = self.engine.bench(&self.elves)?;
        let work = |(entry, scene): &(Entry, Scene)| judge_scene(&bench, entry, scene);
        let judged = under_bar(&scenes, threads(self.jobs), "scenes", work)?;

        let engine = self.engine.engine().name();
        say!(
            "{}, engine {engine}; intervals: {}",
            folder.display(),
            table::INTERVALS
        );
        let families = by_family(&judged);
        say!("{}", table::text("family", "scenes", &families));
        write(
            json,
            &Folder {
                folder: folder.to_owned(),
                engine,
                intervals: table::INTERVALS,
                families,
                scenes: judged,
            },
        )
    }
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Spectrum => Self::Spectrum,
            MethodName::Crossings => Self::Crossings,
            MethodName::Counting => Self::Counting,
            MethodName::CountingAdapted => Self::AdaptedCounting,
        }
    }
}

fn judge_scene(bench: &Bench, entry: &Entry, scene: &Scene) -> anyhow::Result<JudgedScene> {
    let recording = bench
        .run(scene)
        .with_context(|| format!("{}", entry.scene.display()))?;
    let outcome = Outcome::new(scene.clone(), recording);
    let said = outcome.verdict.estimates.iter().map(|estimate| {
        let said_mm = estimate.wavelength_mm.filter(|_| estimate.valid);
        (estimate.t_s, said_mm)
    });
    let felt = entry.truth.felt(&outcome.truth(), &outcome.recording);
    let right = felt.right_share.zip(felt.waves_share);
    Ok(JudgedScene {
        name: entry.name.clone(),
        family: entry.family.clone(),
        method: scene.estimator.method.name(),
        said: entry.truth.judge(said),
        felt: felt.wrong_share.map(|wrong| Felt {
            right: right.map_or(0.0, |(right, waves)| right * waves),
            wrong,
        }),
    })
}

/// Each class that came up, then those with a period together, and those without.
fn by_class(trials: &[Judged]) -> Vec<Row> {
    rows(trials, |judged| judged.said, |judged| judged.felt)
}

/// The same of the shape of what has one wave alone.
fn by_shape(trials: &[Judged]) -> Vec<Row> {
    rows(trials, |judged| judged.shaped, |_| Counts::default())
}

fn rows(
    trials: &[Judged],
    said: impl Fn(&Judged) -> Counts,
    felt: impl Fn(&Judged) -> Counts,
) -> Vec<Row> {
    let row = |name: &str, is_in: &dyn Fn(Class) -> bool| {
        let weighed = |counts: &dyn Fn(&Judged) -> Counts| -> Vec<Weighed> {
            let those = trials.iter().filter(|judged| is_in(judged.trial.class));
            those
                .filter_map(|judged| Weighed::by_time(&counts(judged)))
                .collect()
        };
        Row::of(name, &weighed(&said), &weighed(&felt))
    };
    Class::PERIODIC
        .iter()
        .chain(&Class::PLAIN)
        .map(|&class| row(class.name(), &|other| other == class))
        .chain([
            row("with a period", &Class::has_a_period),
            row("without a period", &|class| !class.has_a_period()),
        ])
        .filter(|row| row.surfaces > 0)
        .collect()
}

/// Each trait, of the surfaces with a period.
fn by_trait(trials: &[Judged]) -> Vec<Row> {
    let mut groups: BTreeMap<&str, (Vec<Weighed>, Vec<Weighed>)> = BTreeMap::new();
    let periodic = trials
        .iter()
        .filter(|judged| judged.trial.class.has_a_period());
    for judged in periodic {
        for name in &judged.traits {
            let (said, felt) = groups.entry(name).or_default();
            said.extend(Weighed::by_time(&judged.said));
            felt.extend(Weighed::by_time(&judged.felt));
        }
    }
    groups
        .into_iter()
        .map(|(name, (said, felt))| Row::of(name, &said, &felt))
        .collect()
}

/// Each family in the order of the index, then all.
fn by_family(scenes: &[JudgedScene]) -> Vec<Row> {
    let mut names: Vec<&str> = Vec::new();
    for scene in scenes {
        if !names.contains(&scene.family.as_str()) {
            names.push(&scene.family);
        }
    }
    let row = |name: &str, is_in: &dyn Fn(&JudgedScene) -> bool| {
        let those = || scenes.iter().filter(|scene| is_in(scene));
        let said: Vec<Weighed> = those()
            .filter_map(|scene| Weighed::alike(&scene.said))
            .collect();
        let felt: Vec<Weighed> = those()
            .filter_map(|scene| scene.felt)
            .map(|felt| Weighed {
                weight: 1.0,
                right: felt.right,
                wrong: felt.wrong,
                silent: 1.0 - felt.right - felt.wrong,
            })
            .collect();
        Row::of(name, &said, &felt)
    };
    names
        .iter()
        .map(|&name| row(name, &|scene| scene.family == name))
        .chain([row("all", &|_| true)])
        .collect()
}

/// The surfaces with the longest time wrong: where to look.
fn say_worst(trials: &[Judged]) {
    let mut wrong: Vec<&Judged> = trials
        .iter()
        .filter(|judged| judged.said.wrong > 0)
        .collect();
    wrong.sort_by_key(|judged| std::cmp::Reverse(judged.said.wrong));
    for judged in wrong.iter().take(WORST) {
        let Counts { all, wrong, .. } = judged.said;
        say!(
            "  wrong {:.3} of seed {}: {}, {}",
            f64::from(wrong) / f64::from(all),
            judged.seed,
            judged.class,
            judged.traits.join(", ")
        );
    }
}

fn write(json: Option<Results>, content: &impl Serialize) -> anyhow::Result<()> {
    json.map_or(Ok(()), |json| json.write_json(content))
}
