//! `host-bridge doctor`.

use std::io::{self, IsTerminal};
use std::time::Duration;

use super::desk::Desk;
use crate::doctor::report::Style;
use crate::doctor::{findings, json, look, report};

/// What `doctor` is asked for.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Exit status: 0 if all is well, 1 if something is wrong, 2 if it can't be looked at.
A bench that names one board only has only that one, as at one end of a relay.
Other programs of ours may have the ports meanwhile.")]
pub struct Doctor {
    #[command(flatten)]
    boards: super::Where,
    /// How long to listen to the boards, 0.5 to 3600; Ctrl-C ends it early, with what has been seen by then
    #[arg(long = "for", value_name = "SECONDS", default_value = "3", value_parser = seconds, allow_negative_numbers = true)]
    span: Duration,
    /// Prints everything as JSON, for scripts
    #[arg(long)]
    json: bool,
}

fn seconds(text: &str) -> Result<Duration, String> {
    text.parse()
        .ok()
        .filter(|seconds| (0.5..=3_600.0).contains(seconds))
        .map(Duration::from_secs_f64)
        .ok_or_else(|| "give 0.5 to 3600".to_owned())
}

impl Doctor {
    /// Does it at `desk`: the exit status.
    pub fn execute(self, desk: &mut Desk) -> anyhow::Result<u8> {
        let bench = self.boards.find()?;
        if io::stderr().is_terminal() {
            eprintln!("looking for {:.1} s …", self.span.as_secs_f64());
        }
        let examination = look::look(&desk.system, &bench, self.span, &desk.ended);
        let findings = findings::of(&examination);
        let text = if self.json {
            json::write(&examination, &findings) + "\n"
        } else {
            let coloured = io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
            let style = if coloured {
                Style::Terminal
            } else {
                Style::Plain
            };
            report::write(&examination, &findings, style)
        };
        // Whoever has read enough has not found the bench ill by that.
        desk.print(&text)?;
        Ok(u8::from(!findings.is_empty()))
    }
}
