//! `host-bridge completions`.

use std::fmt::Write;
use std::process::ExitCode;

use clap::{Command, CommandFactory};
use clap_complete::Shell;

use super::output;

/// Where each shell looks for them.
pub const EXAMPLES: &str = "\
Examples:
  bash   host-bridge completions bash > ~/.local/share/bash-completion/completions/host-bridge
  fish   host-bridge completions fish > ~/.config/fish/completions/host-bridge.fish
  zsh    host-bridge completions zsh > FOLDER/_host-bridge, with FOLDER in fpath before compinit";

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
        let mut script = String::from_utf8(script)?;
        match self.shell {
            // clap_complete 4.6 spells a program's hyphen in two ways, so that bash completes nothing
            // behind a command: https://github.com/clap-rs/clap/issues/6421.
            Shell::Bash => script = script.replace("host__subcmd__bridge", "host__bridge"),
            Shell::Fish => script.push_str(&choices(&command)?),
            _ => {}
        }
        output::print(&script)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// What may stand behind each command without an option before it, which clap_complete leaves out for fish.
fn choices(command: &Command) -> Result<String, std::fmt::Error> {
    let mut lines = String::new();
    for command in command.get_subcommands() {
        for argument in command.get_positionals() {
            for value in argument.get_possible_values() {
                let help = value.get_help().map(ToString::to_string);
                writeln!(
                    lines,
                    "complete -c host-bridge -n \"__fish_host_bridge_using_subcommand {}\" -a \"{}\" -d '{}'",
                    command.get_name(),
                    value.get_name(),
                    help.unwrap_or_default().replace('\'', "\\'"),
                )?;
            }
        }
    }
    Ok(lines)
}
