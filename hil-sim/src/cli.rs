//! The command line.

use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;

use clap::{Parser, Subcommand, ValueEnum};
use hil_sim_boards::{Firmware, FirmwareError, Firmwares};
use hil_sim_core::run::batch;
use hil_sim_core::run::recording::Engine;
use hil_sim_studies::bench::Bench;
use hil_sim_studies::study::number;
use indicatif::{ProgressBar, ProgressStyle};
use protocol::Role;

mod budget;
mod campaign;
mod chart;
mod cost;
mod demo;
mod faults;
mod files;
mod fuzz;
mod goals;
mod golden;
mod init;
mod jury;
mod map;
mod on_target;
mod paper;
mod people;
mod run;
mod run_options;
mod say;
mod scene_files;
#[cfg(target_os = "linux")]
mod serve;
mod size;
mod soak;

/// Ridgelink's simulator.
#[derive(Debug, Parser)]
#[command(name = "hil-sim", version, about)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs scenes and judges them by what they expect: exit status 0 if all is as expected, 1 if
    /// not, 2 if a scene or a file cannot be used
    Run(run::Run),
    /// Writes a first scene, with comments, to start from
    Init(init::Init),
    /// Compares the hashes of scenes' runs with golden ones, or renews those
    #[command(subcommand)]
    Golden(golden::Command),
    /// Rubs the paper's four specimens at its three speeds on the ELFs and prints Table I three times
    /// over: the paper's, predicted, and this ELF's
    Demo(demo::Demo),
    /// Prints what the two ELFs take of flash and RAM
    Size(Elves),
    /// Counts instructions a millisecond on an emulated board: the filters beside others', the whole
    /// sensor
    Cost(cost::Cost),
    /// Counts what the display's ELF spends its instructions on, update by update and part by part, on an
    /// emulated board: exit status 1 if it is more than 15 % of them at 2 kHz
    Budget(budget::Budget),
    /// Maps where the methods fail: error, valid share and wrong share over grids of scenes, as CSV and
    /// heat maps. Run again, it goes on where it was stopped
    Map(map::Maps),
    /// Judges λ on surfaces that the simulator has not made: drawn at random, or a folder of recordings.
    /// Right, wrong and silent by class, with intervals
    Jury(jury::Jury),
    /// Runs the estimation scenes and prints, family by family, how far the default estimator is off:
    /// exit status 1 if a scene is not as expected
    Goals(goals::Goals),
    /// Lists the kinds of faults that a scene may have: what they mean, where they are injected, their
    /// keys and defaults, and what is expected of the boards
    Faults,
    /// Tries every kind of fault at random instants on the ELFs and prints what came of it: exit status
    /// 1 if a goal is missed
    Campaign(campaign::Campaign),
    /// Draws scenes at random over nearly all keys, with faults at random instants, runs them and keeps those
    /// that are not as the table of faults says: exit status 1 if there is one
    Fuzz(fuzz::Fuzz),
    /// Draws what the estimators give against what they cost, what the display does, and what the contact
    /// models are worth
    #[command(subcommand)]
    Chart(chart::Chart),
    /// Measures when the display's outputs change, on its ELF: jitter of the LDAC edges, skew of the
    /// channels, hand to output at 2 and 4 kHz over links of all sorts. Exit status 1 if p99 is above 0.6 ms
    /// at 2 kHz. Writes timing.csv and timing.svg
    Timing(chart::OfDisplay),
    /// Sets up a bench to try things on: both ELFs on emulated boards, held to real time, each board's
    /// console as a pseudo-terminal, until it is told to quit
    #[cfg(target_os = "linux")]
    Serve(serve::Serve),
    /// Runs a program of tests for a board on an emulated one, with the jumper wires that it asks for, and prints what
    /// it logs: exit status 1 if a test fails. cargo takes it for a runner
    OnTarget(on_target::OnTarget),
    /// The paper, figure by figure: Tables I to IV and Figs 4 to 8, ours beside the paper's, as one HTML page
    /// with a CSV for each
    Paper(paper::Paper),
    /// The paper's experiments with people, simulated: an observer with Table II's limens feels the
    /// actuators' real voltages. Prints Tables II to IV beside the paper's, and writes them as CSV
    People(people::People),
    /// Runs both ELFs for long, with random strokes over several specimens through bad weather, and holds
    /// every counter against what was seen: exit status 1 if one does not fit
    Soak(soak::Soak),
}

/// Where the boards' firmwares are.
#[derive(Debug, clap::Args)]
struct Elves {
    /// The sensor board's ELF
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumbv7em-none-eabihf/release/firmware-sensor"
    )]
    sensor_elf: PathBuf,
    #[command(flatten)]
    display: DisplayElf,
}

#[derive(Debug, clap::Args)]
struct DisplayElf {
    /// The display board's ELF
    #[arg(
        long,
        value_name = "ELF",
        default_value = "target/thumbv7em-none-eabihf/release/firmware-display"
    )]
    display_elf: PathBuf,
}

impl DisplayElf {
    fn read(&self) -> Result<Firmware, FirmwareError> {
        Firmware::read(&self.display_elf, Role::Display)
    }
}

impl Elves {
    fn read(&self) -> Result<Firmwares, FirmwareError> {
        Ok(Firmwares {
            sensor: Firmware::read(&self.sensor_elf, Role::Sensor)?,
            display: self.display.read()?,
        })
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EngineName {
    /// The firmware's libraries, on this computer
    Native,
    /// The flashed ELFs, on emulated boards
    Elf,
}

impl EngineName {
    fn engine(self) -> Engine {
        match self {
            Self::Native => Engine::Native,
            Self::Elf => Engine::Elf,
        }
    }

    /// The engine, with the ELFs if it needs them.
    fn bench(self, elves: &Elves) -> Result<Bench, FirmwareError> {
        Ok(match self {
            Self::Native => Bench::Native,
            Self::Elf => Bench::Elf(Box::new(elves.read()?)),
        })
    }
}

impl Arguments {
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        match self.command {
            Command::Run(run) => run.execute(),
            Command::Init(init) => init.execute(),
            Command::Golden(golden) => golden.execute(),
            Command::Demo(demo) => demo.execute(),
            Command::Size(elves) => size::execute(&elves),
            Command::Cost(cost) => cost.execute(),
            Command::Budget(budget) => budget.execute(),
            Command::Map(maps) => maps.execute(),
            Command::Jury(jury) => jury.execute(),
            Command::Goals(goals) => goals.execute(),
            Command::Faults => Ok(faults::execute()),
            Command::Campaign(campaign) => campaign.execute(),
            Command::Fuzz(fuzz) => fuzz.execute(),
            Command::Chart(chart) => chart.execute(),
            Command::Timing(timing) => timing.timing(),
            #[cfg(target_os = "linux")]
            Command::Serve(serve) => serve.execute(),
            Command::OnTarget(tests) => tests.execute(),
            Command::Paper(paper) => paper.execute(),
            Command::People(people) => people.execute(),
            Command::Soak(soak) => soak.execute(),
        }
    }
}

/// Exit status 0, or 1 if something is not as it is to be.
fn status(is_met: bool) -> ExitCode {
    ExitCode::from(u8::from(!is_met))
}

/// So many at a time; 0: one per core.
fn threads(jobs: usize) -> NonZero<usize> {
    NonZero::new(jobs)
        .or_else(|| thread::available_parallelism().ok())
        .unwrap_or(NonZero::<usize>::MIN)
}

/// How many of something, for an option that nothing can be done without.
fn at_least_one(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|&count| count > 0);
    count.ok_or_else(|| "give a whole number of 1 or more".to_owned())
}

/// What `work` makes of each of these, in their order, so many at a time and under a bar; or its first error.
fn under_bar<I: Sync, O: Send, E: Send>(
    inputs: &[I],
    threads: NonZero<usize>,
    things: &str,
    work: impl Fn(&I) -> Result<O, E> + Sync,
) -> Result<Vec<O>, E> {
    let bar = progress(inputs.len() as u64, things);
    let mut made = Vec::new();
    batch::in_order(inputs, threads, work, |_, one| {
        made.push(one?);
        bar.inc(1);
        Ok(())
    })?;
    bar.finish_and_clear();
    Ok(made)
}

/// A bar for so many things, on standard error; none if that is not a terminal.
fn progress(count: u64, things: &str) -> ProgressBar {
    let template = format!("{{bar:40}} {{pos}} of {{len}} {things}, {{eta}} to go");
    let style = ProgressStyle::with_template(&template);
    ProgressBar::new(count).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
