//! `host-bridge relay`.

use std::process::ExitCode;

/// What `relay` is asked for.
#[derive(Debug, clap::Args)]
pub struct Relay {
    #[command(flatten)]
    boards: super::Where,
}

impl Relay {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        anyhow::bail!("relay is being built: {bench:?}")
    }
}
