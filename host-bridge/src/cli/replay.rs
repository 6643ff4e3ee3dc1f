//! `host-bridge replay`.

use std::process::ExitCode;

/// What `replay` is asked for.
#[derive(Debug, clap::Args)]
pub struct Replay {
    #[command(flatten)]
    boards: super::Where,
}

impl Replay {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        anyhow::bail!("replay is being built: {bench:?}")
    }
}
