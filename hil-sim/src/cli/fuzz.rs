//! `hil-sim fuzz`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use hil_sim_studies::fuzz::{Draw, Trial};

use super::files::{create_folder, write_all};
use super::run_options::RunOptions;
use super::say::say;
use super::{at_least_one, status, under_bar};

#[derive(Debug, clap::Args)]
pub(super) struct Fuzz {
    /// The first scene's seed; each next scene has the next one
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many scenes, 1 or more
    #[arg(long, default_value_t = 100, value_parser = at_least_one)]
    scenes: usize,
    /// The most faults of a scene
    #[arg(long, default_value_t = 2)]
    faults: usize,
    /// Where to write the scenes that fail
    #[arg(long, value_name = "DIR", default_value = "target/fuzz")]
    out: PathBuf,
    #[command(flatten)]
    way: RunOptions,
}

impl Fuzz {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let draw = Draw {
            engine: self.way.engine(),
            most_faults: self.faults,
        };
        let bench = self.way.ready()?;
        create_folder(&self.out)?;
        let seeds: Vec<u64> = (self.seed..).take(self.scenes).collect();
        let started = Instant::now();
        let name = |seed: u64| format!("fuzz-{seed}");
        let work = |&seed: &u64| anyhow::Ok(Trial::run(&name(seed), draw.text(seed), &bench));
        let trials = under_bar(&seeds, self.way.threads(), "scenes", work)?;
        let mut failed = 0;
        for (&seed, trial) in seeds.iter().zip(&trials) {
            if trial.unmet.is_empty() {
                continue;
            }
            failed += 1;
            let file = name(seed) + ".toml";
            say!("{}", self.out.join(&file).display());
            for line in &trial.unmet {
                say!("  not as expected: {line}");
            }
            write_all(&self.out, [(file.as_str(), trial.text.clone())])?;
        }
        let faults: usize = trials.iter().map(|trial| trial.faults).sum();
        let unjudged: usize = trials.iter().map(|trial| trial.unjudged).sum();
        say!(
            "{} scenes with {faults} faults in {:.0} s: {failed} not as expected; {unjudged} times something was not judged",
            trials.len(),
            started.elapsed().as_secs_f64()
        );
        Ok(status(failed == 0))
    }
}
