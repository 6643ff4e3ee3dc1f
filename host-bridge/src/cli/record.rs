//! `host-bridge record`.

use std::process::ExitCode;

/// What `record` is asked for.
#[derive(Debug, clap::Args)]
pub struct Record {
    #[command(flatten)]
    boards: super::Where,
}

impl Record {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        anyhow::bail!("record is being built: {bench:?}")
    }
}
