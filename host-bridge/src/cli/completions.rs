//! `host-bridge completions`.

use std::process::ExitCode;

use clap::CommandFactory;
use clap_complete::Shell;

use super::stdout;

/// Which shell is to complete what is typed.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completions {
    /// Prints them.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let mut command = super::Arguments::command();
        let name = command.get_name().to_owned();
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, name, &mut script);
        stdout::print(&script)?;
        Ok(ExitCode::SUCCESS)
    }
}
