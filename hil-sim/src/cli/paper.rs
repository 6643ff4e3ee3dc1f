//! `hil-sim paper`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context, bail};
use hil_sim_studies::paper::{jobs, report};
use hil_sim_studies::psychophysics::{Job, Plan, run};

use super::files::{Format, Results, write_all};
use super::say::{say, tell};
use super::{Elves, EngineName, status};

#[derive(Debug, clap::Args)]
pub(super) struct Paper {
    /// What runs the firmware
    #[arg(long, value_enum, default_value_t = EngineName::Elf)]
    engine: EngineName,
    /// Where to write the page. Its CSVs go to a folder beside it, named as it is without its ending
    #[arg(long, value_name = "FILE.html", default_value = "target/paper.html")]
    out: PathBuf,
    /// All chance comes from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    elves: Elves,
}

impl Paper {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let started = Instant::now();
        let bench = self.engine.bench(&self.elves)?;
        let (folder, name) = folder(&self.out)?;
        // First: runs are not to be lost for a folder that cannot be.
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let page = Results::create(&self.out, Format::Html)?;

        let plan = Plan {
            seed: self.seed,
            ..Plan::default()
        };
        let jobs = jobs(&plan);
        let done = AtomicUsize::new(0);
        let recordings = run(&bench, &jobs, |job| {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let what = match job {
                Job::Pair(scene) => scene.name.as_str(),
                Job::Display(_) => "the display alone, wavelengths given",
            };
            let took_s = started.elapsed().as_secs_f64();
            tell!("{done:>3} of {} after {took_s:>4.0} s: {what}", jobs.len());
        })?;

        let report = report(plan, &recordings, &name)?;
        write_all(&folder, report.files)?;
        page.write(&report.html)?;
        say!(
            "Tables I to IV and Figs 4 to 8, ours beside the paper's: {}\nTheir numbers as CSV: {}\n{:.0} s in all",
            self.out.display(),
            folder.display(),
            started.elapsed().as_secs_f64(),
        );
        for line in &report.contradicted {
            say!("not borne out by these runs: {line}");
        }
        Ok(status(report.contradicted.is_empty()))
    }
}

/// Where the CSVs go, and what the page calls it.
fn folder(page: &Path) -> anyhow::Result<(PathBuf, String)> {
    let folder = page.with_extension("");
    let name = page.file_stem().and_then(|stem| stem.to_str());
    match name {
        Some(name) if folder != page && !page.is_dir() => Ok((folder, name.to_owned())),
        _ => bail!(
            "--out {}: this is no name of a page: give a file that ends in .html",
            page.display()
        ),
    }
}
