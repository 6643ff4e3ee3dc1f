//! `hil-sim goals`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_core::judge::Summary;
use hil_sim_core::judge::outcome::{Judgement, Outcome};
use hil_sim_core::scene::Scene;
use hil_sim_studies::bench::Bench;
use hil_sim_studies::estimators::family::Family;
use hil_sim_studies::study::{Record, Table, short};

use super::run_options;
use super::say::say;
use super::{Elves, EngineName, number, status, threads, under_bar};

/// Every family of scenes, judged by what its scenes expect, as a table
#[derive(Debug, clap::Args)]
pub(super) struct Goals {
    /// The scenes: a folder with a folder for each family
    #[arg(
        long,
        value_name = "FOLDER",
        default_value = "hil-sim/scenes/estimation"
    )]
    scenes: PathBuf,
    /// What runs the firmware
    #[arg(long, value_enum, default_value_t = EngineName::Native)]
    engine: EngineName,
    #[command(flatten)]
    elves: Elves,
}

/// A scene's numbers, and what it did not meet.
type Judged = (Summary, Vec<String>);

impl Goals {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let families = run_options::families(&self.scenes)?;
        let bench = self.engine.bench(&self.elves)?;
        let scenes: Vec<&Scene> = families.iter().flat_map(|family| &family.scenes).collect();
        let judged = run(&scenes, &bench)?;

        let mut rest = judged.iter();
        let rows = families.iter().map(|family| {
            let summaries = rest.by_ref().take(family.scenes.len());
            row(
                family,
                &summaries.map(|(summary, _)| *summary).collect::<Vec<_>>(),
            )
        });
        say!("{}", Table::from_iter(rows));
        let mut met = true;
        for (scene, (_, unmet)) in scenes.iter().zip(&judged) {
            for line in unmet {
                met = false;
                say!("{}: not as expected: {line}", scene.name);
            }
        }
        Ok(status(met))
    }
}

/// Runs the scenes, on all cores: an emulated pair keeps two of them half busy.
fn run(scenes: &[&Scene], bench: &Bench) -> anyhow::Result<Vec<Judged>> {
    under_bar(scenes, threads(0), "scenes", |&scene| {
        let judgement = match bench {
            Bench::Native => Judgement::of(scene, false)?,
            Bench::Elf(_) => Outcome::new(scene.clone(), bench.run(scene)?).judgement(false),
        };
        Ok((judgement.verdict.summary, judgement.unmet))
    })
}

fn row(family: &Family, summaries: &[Summary]) -> Record {
    let of = |number: fn(&Summary) -> Option<f64>| summaries.iter().filter_map(number);
    let most = |number| of(number).reduce(f64::max);
    let least = |number| of(number).reduce(f64::min);
    let mean = |number| {
        let numbers: Vec<f64> = of(number).collect();
        (!numbers.is_empty()).then(|| numbers.iter().sum::<f64>() / numbers.len() as f64)
    };
    let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share), 2);
    Record::default()
        .with("scenes", family.title)
        .with("how many:", short(summaries.len()))
        .with(
            "worst rms, %:",
            number(most(|summary| summary.rms_percent), 2),
        )
        .with("goal:", number(family.goal_percent(), 2))
        .with(
            "least valid share:",
            number(least(|summary| summary.valid_share), 3),
        )
        .with("its mean:", number(mean(|summary| summary.valid_share), 3))
        .with(
            "valid yet > 10 % off, worst, %:",
            percent(most(|summary| summary.wrong_share)),
        )
        .with(
            "least felt right:",
            number(least(|summary| summary.felt_right_share), 3),
        )
        .with(
            "most felt wrong, %:",
            percent(most(|summary| summary.felt_wrong_share)),
        )
        .with(
            "longest to settle, ms:",
            number(most(|summary| summary.settling_ms), 0),
        )
        .with(
            "the paper's count, worst rms, %:",
            number(most(|summary| summary.counted_rms_percent), 0),
        )
}
