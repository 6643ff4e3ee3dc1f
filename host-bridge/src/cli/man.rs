//! `host-bridge man`.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::{CommandFactory, ValueHint};

/// How they are read.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge man ~/.local/share/man/man1
  man host-bridge-flash";

/// Where the man pages go.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// The folder, made if it is not there: one page for the program and one for each command
    #[arg(value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    folder: PathBuf,
}

impl Man {
    /// Writes them.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let Self { folder } = self;
        let place = || format!("{}: can't write man pages here", folder.display());
        fs::create_dir_all(&folder).with_context(place)?;
        clap_mangen::generate_to(super::Arguments::command(), &folder).with_context(place)?;
        Ok(ExitCode::SUCCESS)
    }
}
