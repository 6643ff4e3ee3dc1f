//! `hil-sim fuzz`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use hil_sim_core::run::batch;
use hil_sim_studies::fuzz::{Draw, Trial};

use super::files::{create_folder, write_all};
use super::say::say;
use super::{Elves, EngineName, at_least_one, status, threads};

#[derive(Debug, clap::Args)]
#[command(after_help = "\
Seed, engine and --faults decide a scene. Each that fails is written as fuzz-SEED.toml and told of at once.")]
pub(super) struct Fuzz {
    /// The first scene's seed; each next scene has the next one
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many scenes, 1 to a million
    #[arg(long, default_value_t = 100, value_parser = scenes)]
    scenes: usize,
    /// The most faults of a scene, 0 to 20
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=20))]
    faults: u8,
    /// Where to write the scenes that fail
    #[arg(long, value_name = "DIR", default_value = "target/fuzz")]
    out: PathBuf,
    /// What runs the firmware
    #[arg(long, value_enum, default_value_t = EngineName::Native)]
    engine: EngineName,
    /// Scenes to run at a time; 0: one per core. The results and their order are the same
    #[arg(short, long, value_name = "N", default_value_t = 1)]
    jobs: usize,
    #[command(flatten)]
    elves: Elves,
}

fn scenes(text: &str) -> Result<usize, String> {
    const MOST: usize = 1_000_000;
    match at_least_one(text)? {
        count if count <= MOST => Ok(count),
        _ => Err(format!(
            "give {MOST} at most, and other seeds the next time"
        )),
    }
}

impl Fuzz {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let draw = Draw {
            engine: self.engine.engine(),
            most_faults: self.faults.into(),
        };
        let bench = self.engine.bench(&self.elves)?;
        create_folder(&self.out)?;
        let seeds = (0..self.scenes).map(|number| self.seed.wrapping_add(number as u64));
        let seeds: Vec<u64> = seeds.collect();
        let name = |seed: u64| format!("fuzz-{seed}");
        let started = Instant::now();
        let work = |&seed: &u64| anyhow::Ok(Trial::run(&name(seed), draw.text(seed), &bench));
        let (mut faults, mut unjudged, mut failed) = (0, 0, 0);
        batch::in_order(&seeds, threads(self.jobs), work, |number, trial| {
            let trial = trial?;
            faults += trial.faults;
            unjudged += trial.unjudged;
            if trial.unmet.is_empty() {
                return Ok(());
            }
            failed += 1;
            let file = name(seeds[number]) + ".toml";
            say!("{}", self.out.join(&file).display());
            for line in &trial.unmet {
                say!("  not as expected: {line}");
            }
            write_all(&self.out, [(file.as_str(), trial.text)])
        })?;
        say!(
            "{} scenes with {faults} faults in {:.0} s: {failed} not as expected; {unjudged} times something was not judged",
            seeds.len(),
            started.elapsed().as_secs_f64()
        );
        Ok(status(failed == 0))
    }
}
