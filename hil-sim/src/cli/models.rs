//! `hil-sim chart models` and `hil-sim chart stability`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_studies::contact::{models, stability};

use super::files::{create_folder, keep};
use super::progress;

#[derive(Debug, clap::Args)]
pub(super) struct Models {
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(super) struct Stability {
    /// Where to write CSV and SVG
    #[arg(long, value_name = "FOLDER", default_value = "target/chart")]
    out: PathBuf,
}

impl Models {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        create_folder(&self.out)?;
        let progress = progress(models::runs(), "runs");
        let rows = models::measure(|| progress.inc(1));
        progress.finish_and_clear();
        keep(&rows[..], &self.out)
    }
}

impl Stability {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        create_folder(&self.out)?;
        let progress = progress(stability::runs(), "runs");
        let maps = stability::measure(stability::GRID, || progress.inc(1));
        progress.finish_and_clear();
        keep(&maps[..], &self.out)
    }
}
