//! `host-bridge doctor`.

use std::process::ExitCode;

/// What `doctor` is asked for.
#[derive(Debug, clap::Args)]
pub struct Doctor {
    #[command(flatten)]
    boards: super::Where,
}

impl Doctor {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        anyhow::bail!("doctor is being built: {bench:?}")
    }
}
