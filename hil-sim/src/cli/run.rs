//! `hil-sim run`.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, bail};
use hil_sim::json::to_json;
use hil_sim::outcome::Outcome;
use hil_sim::report::html;
use hil_sim::scene::Scene;
use hil_sim::{elf, native};

use super::{EngineName, Run, number};

impl Run {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let scenes = self.load()?;
        let firmwares = match self.engine {
            EngineName::Native => None,
            EngineName::Elf => Some(self.elves.read()?),
        };
        // Opened first: a run is not to be lost for a folder that is not there.
        let json = self.json.as_deref().map(create).transpose()?;
        let report = self.report.as_deref().map(create).transpose()?;

        println!("{HEADER}");
        let mut outcomes = Vec::with_capacity(scenes.len());
        for scene in scenes {
            let recording = match &firmwares {
                None => native::run(&scene)?,
                Some(firmwares) => elf::run(&scene, firmwares)?.0,
            };
            let outcome = Outcome::new(scene, recording);
            println!("{}", row(&outcome));
            for line in &outcome.unmet {
                println!("  not as expected: {line}");
            }
            outcomes.push(outcome);
        }

        if let Some((mut file, path)) = json {
            let results: Vec<_> = outcomes.iter().map(Outcome::result).collect();
            let text = to_json(&results)?;
            file.write_all(text.as_bytes())
                .with_context(|| format!("{}", path.display()))?;
        }
        if let Some((mut file, path)) = report {
            let chapters: Vec<_> = outcomes.iter().map(Outcome::chapter).collect();
            let page = html(&chapters)?;
            file.write_all(page.as_bytes())
                .with_context(|| format!("{}", path.display()))?;
            println!("report: {}", path.display());
        }
        let met = outcomes.iter().all(|outcome| outcome.unmet.is_empty());
        Ok(if met {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(1)
        })
    }

    /// All scenes, or every reason why not.
    fn load(&self) -> anyhow::Result<Vec<Scene>> {
        let mut scenes = Vec::with_capacity(self.scenes.len());
        let mut refusals = Vec::new();
        for path in &self.scenes {
            match Scene::load(path) {
                Ok(scene) => scenes.push(scene),
                Err(error) => refusals.push(error.to_string()),
            }
        }
        if refusals.is_empty() {
            Ok(scenes)
        } else {
            bail!(refusals.join("\n"))
        }
    }
}

fn create(path: &Path) -> anyhow::Result<(File, &Path)> {
    let file = File::create(path).with_context(|| {
        format!(
            "{}: cannot be written: give a file in a folder that exists",
            path.display()
        )
    })?;
    Ok((file, path))
}

const HEADER: &str = "\
scene                       λ mm     rms %  valid  actuators Hz  of v/λ̂ Hz  phase rms  × real time";

fn row(outcome: &Outcome) -> String {
    let summary = &outcome.verdict.summary;
    let actuators = &outcome.verdict.actuators;
    format!(
        "{:<24} {:>8} {:>8}  {:>5}  {:>12}  {:>9}  {:>9}  {:>11}  {}",
        outcome.scene.name,
        number(summary.mean_mm, 3),
        number(summary.rms_percent, 2),
        number(summary.valid_share, 2),
        number(actuators.frequency_hz, 3),
        number(actuators.truth_hz, 3),
        number(actuators.phase_error_rms_cycles, 4),
        pace(outcome.recording.realtime_factor()),
        if outcome.unmet.is_empty() {
            "ok"
        } else {
            "FAILED"
        },
    )
}

/// A multiple of real time, with decimals where they matter.
fn pace(factor: Option<f64>) -> String {
    number(
        factor,
        if factor.is_some_and(|factor| factor < 10.0) {
            2
        } else {
            0
        },
    )
}
