//! `hil-sim init`.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use super::say::say;
use anyhow::Context;

const FIRST: &str = include_str!("first_scene.toml");

#[derive(Debug, clap::Args)]
pub(super) struct Init {
    /// Where to write it: a file that is not there yet
    #[arg(value_name = "FILE", default_value = "scene.toml")]
    file: PathBuf,
}

impl Init {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let name = self.file.display();
        let mut file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&self.file)
            .with_context(|| {
                format!(
                    "{name}: cannot be made: give a file that is not there yet, in a folder that is"
                )
            })?;
        if let Err(error) = file.write_all(FIRST.as_bytes()) {
            // So that it can be tried again.
            let _ = std::fs::remove_file(&self.file);
            return Err(error).with_context(|| format!("{name}: cannot be written"));
        }
        say!("{name}: written; now: hil-sim run {name} --report report.html");
        Ok(ExitCode::SUCCESS)
    }
}
