//! The command line.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};

mod run;

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
    Run(Run),
}

#[derive(Debug, clap::Args)]
struct Run {
    /// Scenes: TOML files
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// What runs the firmware
    #[arg(long, value_enum, default_value_t = EngineName::Native)]
    engine: EngineName,
    /// Where to write every result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write a report with plots, as one HTML page
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EngineName {
    /// The firmware's libraries, on this computer
    Native,
    /// The flashed ELFs, on emulated boards
    Elf,
}

impl Arguments {
    /// Does what was asked for.
    ///
    /// # Errors
    /// If a scene or a file cannot be used.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        match self.command {
            Command::Run(run) => run.execute(),
        }
    }
}
