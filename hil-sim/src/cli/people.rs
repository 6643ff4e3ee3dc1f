//! `hil-sim people`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::ValueEnum;
use hil_sim_studies::psychophysics::bench::Bench;
use hil_sim_studies::psychophysics::study;
use hil_sim_studies::psychophysics::study::{Friction, Plan, Study};
use hil_sim_studies::psychophysics::{record, tables};

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
    #[arg(long, value_enum, default_value_t = FrictionName::None)]
    friction: FrictionName,
    /// Where to write a CSV for each table
    #[arg(long, value_name = "FOLDER", default_value = "target/people")]
    out: PathBuf,
    /// Print JSON instead of tables
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    elves: Elves,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FrictionName {
    None,
    Mild,
    Strong,
}

/// The engine by its name, with the ELFs if it needs them.
pub(super) fn bench(engine: EngineName, elves: &Elves) -> anyhow::Result<Bench> {
    Ok(match engine {
        EngineName::Native => Bench::Native,
        EngineName::Elf => Bench::Elf(Box::new(elves.read()?)),
    })
}

impl People {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = bench(self.engine, &self.elves)?;
        // First: a study is not to be lost for a folder that cannot be.
        std::fs::create_dir_all(&self.out).with_context(|| self.out.display().to_string())?;
        let plan = Plan {
            seed: self.seed,
            trials: self.trials,
            friction: match self.friction {
                FrictionName::None => Friction::None,
                FrictionName::Mild => Friction::Mild,
                FrictionName::Strong => Friction::Strong,
            },
            ..Plan::default()
        };
        let jobs = study::jobs(&plan);
        let progress = progress(jobs.len() as u64, "runs");
        let recordings = bench.run(&jobs, |_| progress.inc(1))?;
        progress.finish_and_clear();
        let study = Study::new(plan, &recordings)?;
        for (name, text) in record::csvs(&study)? {
            let path = self.out.join(name);
            std::fs::write(&path, text).with_context(|| path.display().to_string())?;
        }
        if self.json {
            say!("{}", record::json(&study)?);
        } else {
            say::text(format_args!("{}", tables::text(&study)));
            say!("\nEvery number as CSV: {}", self.out.display());
        }
        Ok(ExitCode::SUCCESS)
    }
}
