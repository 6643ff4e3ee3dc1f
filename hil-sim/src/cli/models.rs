//! `hil-sim chart models` and `hil-sim chart stability`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_core::scene::Rung;
use hil_sim_studies::contact::{models, stability};

use super::files::{create_folder, write};
use super::runs;
use super::say::say;

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
        let progress = runs(models::runs());
        let rows = models::measure(|| progress.inc(1));
        progress.finish_and_clear();
        say!("| case | rung | virtual s per s | error, % |");
        say!("| --- | --- | ---: | ---: |");
        for row in rows.iter().filter(|row| row.entrant.integrator.is_none()) {
            say!(
                "| {} | {} | {:.0} | {} |",
                row.case,
                row.entrant.rung.name(),
                row.pace,
                match (row.entrant.rung, row.error_percent) {
                    (Rung::Reference, _) => "–".to_owned(),
                    (_, Some(percent)) => format!("{percent:.2e}"),
                    (_, None) => "diverges".to_owned(),
                },
            );
        }
        write(&self.out.join("models.csv"), &models::csv(&rows)?)?;
        write(&self.out.join("models.svg"), &models::picture::draw(&rows))?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Stability {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        create_folder(&self.out)?;
        let progress = runs(stability::runs());
        let maps = stability::measure(stability::GRID, || progress.inc(1));
        progress.finish_and_clear();
        write(&self.out.join("stability.csv"), &stability::csv(&maps)?)?;
        write(
            &self.out.join("stability.svg"),
            &stability::picture::draw(&maps),
        )?;
        Ok(ExitCode::SUCCESS)
    }
}
