//! `hil-sim goals`.

use std::path::PathBuf;
use std::process::ExitCode;

use hil_sim_boards::Firmwares;
use hil_sim_core::judge::Summary;
use hil_sim_core::judge::outcome::{Judgement, Outcome};
use hil_sim_core::run::batch::on_all_cores;
use hil_sim_core::scene::Scene;
use hil_sim_studies::estimators::family;
use hil_sim_studies::estimators::family::Family;

use hil_sim_studies::study::Table;

use super::say::say;
use super::{Elves, EngineName, number, progress};

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
#[derive(Clone, Debug)]
struct Judged {
    summary: Summary,
    unmet: Vec<String>,
}

impl Goals {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let families = family::load(&self.scenes)?;
        let firmwares = match self.engine {
            EngineName::Native => None,
            EngineName::Elf => Some(self.elves.read()?),
        };
        let scenes: Vec<&Scene> = families.iter().flat_map(|family| &family.scenes).collect();
        let judged = run(&scenes, firmwares.as_ref())?;

        let mut table = Table::new(&HEADS);
        let mut rest = &judged[..];
        for family in &families {
            let (these, others) = rest.split_at(family.scenes.len());
            rest = others;
            table.row(row(family, these));
        }
        say!("{table}");
        let mut met = true;
        for (scene, judged) in scenes.iter().zip(&judged) {
            for line in &judged.unmet {
                met = false;
                say!("{}: not as expected: {line}", scene.name);
            }
        }
        Ok(if met {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(1)
        })
    }
}

/// Runs the scenes, on all cores: an emulated pair keeps two of them half busy.
fn run(scenes: &[&Scene], firmwares: Option<&Firmwares>) -> anyhow::Result<Vec<Judged>> {
    let bar = progress(scenes.len() as u64, "scenes");
    let judged = on_all_cores(scenes, |scene| {
        let judgement = match firmwares {
            None => Judgement::of(scene, false)?,
            Some(firmwares) => {
                let (recording, _) = hil_sim_boards::run(scene, firmwares)?;
                Outcome::new((*scene).clone(), recording).judgement(false)
            }
        };
        bar.inc(1);
        Ok(Judged {
            summary: judgement.verdict.summary,
            unmet: judgement.unmet,
        })
    });
    bar.finish_and_clear();
    judged
}

const HEADS: [&str; 10] = [
    "scenes",
    "how many:",
    "worst rms, %:",
    "goal:",
    "least valid share:",
    "valid yet > 10 % off, worst, %:",
    "least felt right:",
    "most felt wrong, %:",
    "longest to settle, ms:",
    "the paper's count, worst rms, %:",
];

fn row(family: &Family, judged: &[Judged]) -> [String; 10] {
    let most = |number: fn(&Summary) -> Option<f64>| {
        judged
            .iter()
            .filter_map(|judged| number(&judged.summary))
            .reduce(f64::max)
    };
    let least = |number: fn(&Summary) -> Option<f64>| {
        judged
            .iter()
            .filter_map(|judged| number(&judged.summary))
            .reduce(f64::min)
    };
    [
        family.title.to_owned(),
        judged.len().to_string(),
        number(most(|summary| summary.rms_percent), 2),
        number(family.goal_percent(), 1),
        number(least(|summary| summary.valid_share), 3),
        number(
            most(|summary| summary.wrong_share).map(|share| 100.0 * share),
            2,
        ),
        number(least(|summary| summary.felt_right_share), 3),
        number(
            most(|summary| summary.felt_wrong_share).map(|share| 100.0 * share),
            2,
        ),
        number(most(|summary| summary.settling_ms), 0),
        number(most(|summary| summary.counted_rms_percent), 0),
    ]
}
