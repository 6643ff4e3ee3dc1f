//! `hil-sim run`.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use hil_sim_core::judge::expectation::keys_of;
use hil_sim_core::judge::outcome::{Judgement, Outcome};
use hil_sim_core::run::batch;
use hil_sim_core::run::recording::Engine;
use hil_sim_core::scene::SceneError;
use hil_sim_core::scene_file::line::line_of;
use hil_sim_studies::map::Shard;
use hil_sim_studies::output::golden::{Comparison, Golden, complaint};
use hil_sim_studies::output::json::{JsonList, SceneResult};
use hil_sim_studies::output::junit::{Fate, TestCase, case, xml};
use hil_sim_studies::output::report::{Chapter, html};

use super::files::{Format, Results};
use super::run_options::{Loaded, RunOptions};
use super::say::say;
use super::scene_files::scene_files;
use super::{number, status};

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Exit status:
  0  every scene is as it expects, its faults as `hil-sim faults` says, and as its golden hash says
  1  one is not
  2  a scene or a file cannot be used; scenes are all read before one runs")]
pub(super) struct Run {
    /// Scenes: TOML files, or folders of them
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    way: RunOptions,
    /// Run the i-th of n parts of the scenes only: each scene is in exactly one part
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Where to write every result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write a report with plots, as one HTML page
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Where to write the results as JUnit XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Golden hashes to compare the runs with, as hil-sim golden renew makes them
    #[arg(long, value_name = "FILE")]
    golden: Option<PathBuf>,
}

/// What is left of a run once it has been judged.
struct Judged {
    judgement: Judgement,
    /// Only if a report is to be made of it.
    outcome: Option<Outcome>,
}

impl Run {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let files = scene_files(&self.scenes, self.shard)?;
        let loaded = self.way.load(&files);
        if loaded.iter().any(Result::is_err)
            && let Some(junit) = Results::wanted(self.junit.as_deref(), Format::Xml)?
        {
            junit.write(&xml(
                self.way.engine(),
                files.iter().zip(&loaded).map(unrun),
            )?)?;
        }
        let scenes = self.way.accepted(loaded)?;
        let ready = self.way.ready()?;
        let golden = self.golden.as_deref().map(Golden::read).transpose()?;
        // Opened first: a run is not to be lost for a folder that is not there.
        let json = Results::wanted(self.json.as_deref(), Format::JsonList)?;
        let report = Results::wanted(self.report.as_deref(), Format::Html)?;
        let junit = Results::wanted(self.junit.as_deref(), Format::Xml)?;

        let names = scenes
            .iter()
            .map(|loaded| loaded.scene.name.chars().count());
        let width = names.max().unwrap_or(0).max(LEAST_WIDTH);
        say!("{:<width$}{HEADER}", "scene");
        let mut books = Books {
            width,
            way: &self.way,
            golden,
            json: json.map(|json| (json, JsonList::default())),
            cases: Vec::with_capacity(scenes.len()),
            outcomes: Vec::new(),
            met: true,
        };
        let work = |loaded: &Loaded| {
            // Events are for the JSON.
            let events = self.json.is_some();
            if report.is_none() && self.way.engine() == Engine::Native {
                return Ok(Judged {
                    judgement: Judgement::of(&loaded.scene, events)?,
                    outcome: None,
                });
            }
            let recording = ready.run(&loaded.scene)?;
            let outcome = Outcome::new(loaded.scene.clone(), recording);
            anyhow::Ok(Judged {
                judgement: outcome.judgement(events),
                outcome: report.is_some().then_some(outcome),
            })
        };
        let ran = batch::in_order(&scenes, self.way.threads(), work, |index, judged| {
            books.enter(&scenes[index], judged)
        });
        if let Some(junit) = junit {
            let rest = scenes.iter().skip(books.cases.len());
            let rest = rest.map(|loaded| case(&loaded.path, &loaded.scene.name, &Fate::Skipped));
            junit.write(&xml(
                self.way.engine(),
                books.cases.into_iter().chain(rest),
            )?)?;
        }
        // Of those that have run, if one could not.
        if let Some((mut json, list)) = books.json {
            json.part(|file| file.write_all(list.end().as_bytes()))?;
            json.end()?;
        }
        ran?;
        if let Some(report) = report {
            let chapters: Vec<_> = books.outcomes.iter().map(Chapter::of).collect();
            let path = report.path;
            report.write(&html(&chapters))?;
            say!("report: {}", path.display());
        }
        Ok(status(books.met))
    }
}

/// What is written down of the runs, in their order.
struct Books<'a> {
    way: &'a RunOptions,
    /// Of the names.
    width: usize,
    golden: Option<Golden>,
    json: Option<(Results<'a>, JsonList)>,
    cases: Vec<TestCase>,
    outcomes: Vec<Outcome>,
    /// Whether all was as expected so far.
    met: bool,
}

impl Books<'_> {
    fn enter(&mut self, loaded: &Loaded, judged: anyhow::Result<Judged>) -> anyhow::Result<()> {
        let Loaded { path, scene } = loaded;
        let Judged { judgement, outcome } = match judged {
            Ok(judged) => judged,
            Err(error) => {
                let reason = format!("{error:#}");
                let title = format!("{} could not be run", scene.name);
                self.way.annotate(path, None, &title, &reason);
                let fate = Fate::Unusable(&reason);
                self.cases.push(case(path, &scene.name, &fate));
                return Err(error.context(path.display().to_string()));
            }
        };
        let (hash, wall_s) = (judgement.ran.hash, judgement.ran.wall_s);
        let mut row = row(&scene.name, self.width, &judgement);
        let mut unmet = judgement.unmet.clone();
        // What came out of a pipe is gone, and nothing more may come.
        let text = match path.is_file() {
            true => fs::read_to_string(path).unwrap_or_default(),
            false => String::new(),
        };
        // Each line with the file and the line of it that it is about.
        let place = |line: &String| (path.as_path(), line_of(&text, &keys_of(line)));
        let mut places: Vec<(&Path, Option<usize>)> = unmet.iter().map(place).collect();
        if let Some(golden) = &self.golden {
            let name = golden.name(path)?;
            let standing = golden.standing(&name, self.way.engine(), hash);
            unmet.extend(complaint(&standing, hash, golden, &name));
            places.push(match standing {
                Comparison::Other(_, at) => (golden.path(), at),
                Comparison::Same | Comparison::Missing => (path.as_path(), None),
            });
        }
        let is_met = unmet.is_empty();
        row += if is_met { "  ok" } else { "  FAILED" };
        say!("{row}");
        for (line, (file, at)) in unmet.iter().zip(places) {
            say!("  not as expected: {line}");
            let title = format!("{} is not as expected", scene.name);
            self.way.annotate(file, at, &title, line);
        }
        for (number, finding) in judgement.findings.iter().enumerate() {
            let kind = finding.fault.kind.name();
            for line in &finding.unjudged {
                say!("  not judged: fault[{number}] {kind}: {line}");
            }
        }
        self.met &= is_met;
        if let Some((json, list)) = &mut self.json {
            json.part(|file| list.write(&SceneResult::of(&judgement, scene), file))?;
        }
        if let Some(mut outcome) = outcome {
            outcome.unmet.clone_from(&unmet);
            self.outcomes.push(outcome);
        }
        let (row, unmet) = (&row, &unmet);
        let fate = Fate::Ran {
            wall_s,
            hash,
            row,
            unmet,
        };
        self.cases.push(case(path, &scene.name, &fate));
        Ok(())
    }
}

/// The case of a scene that has not run, because it or another cannot be used.
fn unrun((path, loaded): (&PathBuf, &Result<Loaded, SceneError>)) -> TestCase {
    match loaded {
        Ok(loaded) => case(path, &loaded.scene.name, &Fate::Skipped),
        Err(error) => {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            case(path, &name, &Fate::Unusable(&error.to_string()))
        }
    }
}

/// Least width of the names' column.
const LEAST_WIDTH: usize = 24;
const HEADER: &str = "    λ mm     rms %  valid  felt right  felt wrong  actuators Hz  of v/λ̂ Hz  phase rms  × real time";

/// A scene's line, up to whether it is as expected.
fn row(name: &str, width: usize, judgement: &Judgement) -> String {
    let summary = &judgement.verdict.summary;
    let actuators = &judgement.verdict.actuators;
    format!(
        "{name:<width$} {:>8} {:>8}  {:>5}  {:>10}  {:>10}  {:>12}  {:>9}  {:>9}  {:>11}",
        number(summary.mean_mm, 3),
        number(summary.rms_percent, 2),
        number(summary.valid_share, 2),
        number(summary.felt_right_share, 2),
        number(summary.felt_wrong_share, 3),
        number(actuators.frequency_hz, 3),
        number(actuators.truth_hz, 3),
        number(actuators.phase_error_rms_cycles, 4),
        pace(judgement.ran.realtime_factor()),
    )
}

fn pace(factor: Option<f64>) -> String {
    let matter = factor.is_some_and(|factor| factor < 10.0);
    number(factor, if matter { 2 } else { 0 })
}
