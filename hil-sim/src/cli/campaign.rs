//! `hil-sim campaign`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::bail;
use hil_sim_core::scene::fault::Kind;
use hil_sim_studies::campaign::{Plan, Shift, Tally, Trial, unmet};
use hil_sim_studies::display::rendering_of_word;

use protocol::Rendering;

use super::files::{Format, Results};
use super::say::say;
use super::{Elves, at_least_one, number, status, threads, under_bar};

#[derive(Debug, clap::Args)]
pub(super) struct Campaign {
    /// Kinds to try, as `hil-sim faults` names them [default: all]
    #[arg(long, value_name = "KIND", value_delimiter = ',', num_args = 1..)]
    kinds: Vec<String>,
    /// How many times each, 1 or more
    #[arg(long, default_value_t = 25, value_parser = at_least_one)]
    instants: usize,
    /// Decides the instants, and what the kinds leave to chance
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How much of the surface the display plays: fundamental, shape or texture
    #[arg(long, value_name = "RENDERING", default_value = "fundamental", value_parser = rendering_of_word)]
    rendering: Rendering,
    /// Runs at a time, each of which takes up to two processors; 0: one per core
    #[arg(long, value_name = "RUNS", default_value_t = 0)]
    jobs: usize,
    /// Where to write the table as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write every trial as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    elves: Elves,
}

impl Campaign {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let plan = Plan {
            kinds: self.kinds()?,
            instants: self.instants,
            seed: self.seed,
            rendering: self.rendering,
        };
        let firmwares = self.elves.read()?;
        let json = Results::wanted(self.json.as_deref(), Format::JsonList)?;
        let csv = Results::wanted(self.csv.as_deref(), Format::Csv("kind"))?;

        let shifts = plan.shifts();
        let virtual_s: f64 = shifts.iter().map(|shift| shift.scene.duration_s).sum();
        let started = Instant::now();
        let work = |shift: &Shift| shift.run(&firmwares);
        let trials = under_bar(&shifts, threads(self.jobs), "scenes", work)?.concat();
        let tallies = plan.kinds.iter().map(|&kind| Tally::of(kind, &trials));
        let tallies: Vec<Tally> = tallies.collect();

        say!("{HEADER}");
        for tally in &tallies {
            say!("{}", line(tally));
        }
        let wall_s = started.elapsed().as_secs_f64();
        say!(
            "{} faults of {} kinds in {virtual_s:.0} s of virtual time, {} runs; {wall_s:.0} s, {:.2} × real time",
            trials.len(),
            tallies.len(),
            shifts.len(),
            virtual_s / wall_s
        );
        for trial in &trials {
            let unmet = trial.unmet();
            if !unmet.is_empty() {
                let fault = &trial.finding.fault;
                say!(
                    "  {} at {:.6} s of {} ({}, {}){}: {}",
                    fault.kind.name(),
                    fault.at_s,
                    trial.scene,
                    trial.motion,
                    trial.mode,
                    keys(trial),
                    unmet.join("; ")
                );
            }
        }
        let unmet = unmet(&tallies);
        for line in &unmet {
            say!("not met: {line}");
        }
        if let Some(json) = json {
            json.write_json(&tallies)?;
        }
        if let Some(csv) = csv {
            csv.write(&csv_of(&trials))?;
        }
        Ok(status(unmet.is_empty()))
    }

    fn kinds(&self) -> anyhow::Result<Vec<Kind>> {
        if self.kinds.is_empty() {
            return Ok(Kind::all().collect());
        }
        let kind = |name: &String| match Kind::from_name(name) {
            Some(kind) => Ok(kind),
            None => bail!("{name}: no such kind: give some of those in `hil-sim faults`"),
        };
        let mut kinds = Vec::new();
        for name in &self.kinds {
            let kind = kind(name)?;
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        Ok(kinds)
    }
}

const HEADER: &str = "\
kind                    expected  tried   on  seen  first sign ms       0 V in time  0 V after ms     stuck  resets  again  against  unmet";

fn line(tally: &Tally) -> String {
    let times = |times: Option<[f64; 2]>| {
        let [middle, worst] = [0, 1].map(|at| number(times.map(|times| times[at]), 2));
        format!("{middle:>7} {worst:>8}")
    };
    let in_time = format!("{}/{}", tally.safe, tally.injected);
    let in_time = tally.safe_within_ms.map_or("–", |_| &in_time);
    format!(
        "{:<23} {:<8} {:>6} {:>4} {:>5}  {}  {:>12}  {}  {:>5}  {:>6}  {:>5}  {:>7}  {:>5}",
        tally.kind,
        tally.expected,
        tally.injected,
        tally.driving,
        tally.seen,
        times(tally.detected_ms),
        in_time,
        times(tally.safe_ms),
        tally.stuck,
        tally.resets,
        tally.drove_again,
        tally.restarts,
        tally.unmet,
    )
}

fn keys(trial: &Trial) -> String {
    let fault = &trial.finding.fault;
    let keys = fault.kind.row().keys.iter().zip(fault.values);
    keys.map(|(key, value)| format!(" {} = {value}", key.name))
        .collect()
}

fn csv_of(trials: &[Trial]) -> String {
    let ms = |ms: Option<f64>| ms.map_or(String::new(), |ms| format!("{ms:.4}"));
    let mut text = "kind,scene,motion,mode,at_s,keys,was_driving,detected_ms,sign,safe_ms,stuck,resets,drives_again,unmet\n".to_owned();
    for trial in trials {
        let Trial {
            scene,
            motion,
            mode,
            finding,
            stray: _,
        } = trial;
        text += &format!(
            "{},{scene},{motion},{mode},{:.6},{},{},{},\"{}\",{},{},{},{},\"{}\"\n",
            finding.fault.kind.name(),
            finding.fault.at_s,
            keys(trial).trim(),
            finding.was_driving,
            ms(finding.detected_ms()),
            finding.sign,
            ms(finding.safe_ms()),
            finding.stuck,
            finding.resets,
            finding.drives_again,
            trial.unmet().join("; ")
        );
    }
    text
}
