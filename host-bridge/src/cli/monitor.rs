//! `host-bridge monitor`.

use std::process::ExitCode;

/// What `monitor` is asked for.
#[derive(Debug, clap::Args)]
pub struct Monitor {
    #[command(flatten)]
    boards: super::Where,
}

impl Monitor {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        anyhow::bail!("monitor is being built: {bench:?}")
    }
}
