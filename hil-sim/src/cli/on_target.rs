//! `hil-sim on-target`: a program of tests for a board, on an emulated one.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use hil_sim_boards::jig::Jumper;
use hil_sim_boards::semihosted;

use super::say::{say, text};
use super::status;

/// What a program of tests is run on.
#[derive(Debug, clap::Args)]
pub struct OnTarget {
    /// The program: an ELF that ends itself by semihosting
    elf: PathBuf,
    /// A jumper wire that is left out; may be given several times
    #[arg(long, value_name = "JUMPER", value_parser = jumpers())]
    without: Vec<Jumper>,
}

fn jumpers() -> impl TypedValueParser<Value = Jumper> {
    PossibleValuesParser::new(Jumper::ALL.map(Jumper::name))
        .map(|name| Jumper::from_name(&name).expect("only these are taken"))
}

impl OnTarget {
    /// Runs it, prints what it logs, and returns whether it ended well.
    pub fn execute(&self) -> anyhow::Result<ExitCode> {
        let jumpers: Vec<Jumper> = Jumper::ALL
            .into_iter()
            .filter(|jumper| !self.without.contains(jumper))
            .collect();
        let said = semihosted::run_with(&self.elf, "PACKAGE --test on_target", &jumpers)?;
        text(format_args!("{}", said.console));
        for line in &said.log {
            say!("{line}");
        }
        Ok(status(said.is_done))
    }
}
