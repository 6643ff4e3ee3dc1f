//! `host-bridge export`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::SystemTime;

use crate::export::{Settings, write};
use anyhow::bail;
use clap::ValueHint;

use super::output;

/// What the command does.
pub const ABOUT: &str = "\
Takes a recording or a scene out to what other programs read.

A name that ends in .hjif gets a texture of ISO/IEC 23090-31 (MPEG haptics): what is felt over place. Of a scene that \
is its surface; of a recording the five gauges over the longest way that the arm goes in one direction. A name that \
ends in .wav gets a file for each group of channels: NAME-gauges.wav, NAME-arm.wav and so on; of a scene the surface, \
the hand and the fifty actuators as well, as `hil-sim run` has them. For each file the lines are printed by which a \
scene reads it, if one can.";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge export rubbing.mcap rubbing.hjif
  host-bridge export rubbing.mcap rubbing.wav --from 2 --to-time 5
  host-bridge export first.toml first.hjif

Exit status: 0 exported; 2 not, or not all of it.";

/// What `export` is asked for.
#[derive(Debug, clap::Args)]
pub struct Export {
    /// The recording, FILE.mcap, or the scene, FILE.toml
    #[arg(value_name = "FROM", value_hint = ValueHint::FilePath)]
    from: PathBuf,
    /// The file, ending in .hjif, or what the files' names begin with, ending in .wav
    #[arg(value_name = "TO", value_hint = ValueHint::FilePath)]
    to: PathBuf,
    /// Of a recording: from so many seconds after its start on
    #[arg(long = "from", value_name = "SECONDS", value_parser = super::place_s, allow_negative_numbers = true)]
    from_s: Option<f64>,
    /// Of a recording: to so many seconds after its start
    #[arg(long = "to-time", value_name = "SECONDS", value_parser = super::place_s, allow_negative_numbers = true)]
    to_s: Option<f64>,
    /// Writes over files that are there already
    #[arg(long)]
    force: bool,
}

impl Export {
    /// Exports.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let from_s = self.from_s.unwrap_or(0.0);
        if let Some(to_s) = self.to_s
            && to_s <= from_s
        {
            bail!("--to-time {to_s}: give a time after --from");
        }
        let date = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
        let exported = write(&Settings {
            from: self.from,
            to: self.to,
            from_s: self.from_s,
            to_s: self.to_s,
            date,
            force: self.force,
        })?;
        let mut told: Vec<String> = exported
            .files
            .iter()
            .map(|file| {
                let section = file.section.as_deref().map(indented).unwrap_or_default();
                format!("{}: {}{section}", file.path.display(), file.holds)
            })
            .collect();
        if exported.is_cut {
            told.push("the recording was cut off: this is what there is of it".to_owned());
        }
        output::print(&told.join("\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The lines of a scene below what they are of.
fn indented(section: &str) -> String {
    section.lines().map(|line| format!("\n  {line}")).collect()
}
