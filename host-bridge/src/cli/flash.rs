//! `host-bridge flash`.

use std::process::ExitCode;

/// What `flash` is asked for.
#[derive(Debug, clap::Args)]
pub struct Flash {
    #[command(flatten)]
    boards: super::Where,
}

impl Flash {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        anyhow::bail!("flash is being built: {bench:?}")
    }
}
