//! `hil-sim people`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use hil_sim_studies::psychophysics::{FRICTIONS, Plan, Study, csvs, jobs, json, run, text};

use super::files::write_all;
use super::say::{self, say};
use super::{Elves, EngineName, progress};

#[derive(Debug, clap::Args)]
pub(super) struct People {
    /// What runs the firmware
    #[arg(long, value_enum, default_value_t = EngineName::Elf)]
    engine: EngineName,
    /// All chance comes from it: the gauges' noise, the hand's strokes, the observers' answers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Trials of each pair of Table III; the paper made 10
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    trials: u32,
    /// How sticky the specimens of Table III are. With friction the fingertip sticks and slips, and its
    /// tangential channel is fitted
    #[arg(long, default_value = "none", value_parser = frictions())]
    friction: &'static str,
    /// Where to write a CSV for each table
    #[arg(long, value_name = "FOLDER", default_value = "target/people")]
    out: PathBuf,
    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    elves: Elves,
}

fn frictions() -> impl TypedValueParser<Value = &'static str> {
    let named = |name: String| FRICTIONS.into_iter().find(|of| *of == name);
    PossibleValuesParser::new(FRICTIONS).map(move |name| named(name).expect("one of them"))
}

impl People {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.engine.bench(&self.elves)?;
        // First: a study is not to be lost for a folder that cannot be.
        std::fs::create_dir_all(&self.out).with_context(|| self.out.display().to_string())?;
        let plan = Plan {
            seed: self.seed,
            trials: self.trials,
            friction: self.friction,
            ..Plan::default()
        };
        let jobs = jobs(&plan);
        let progress = progress(jobs.len() as u64, "runs");
        let recordings = run(&bench, &jobs, |_| progress.inc(1))?;
        progress.finish_and_clear();
        let study = Study::new(plan, &recordings)?;
        write_all(&self.out, csvs(&study))?;
        if self.json {
            say!("{}", json(&study)?);
        } else {
            say::text(format_args!("{}", text(&study)));
            say!("\nEvery number as CSV: {}", self.out.display());
        }
        Ok(ExitCode::SUCCESS)
    }
}
