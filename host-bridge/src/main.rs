//! The tool at the operator's desk. See the library for what it is made of.

use std::process::ExitCode;

use clap::Parser;

mod cli;

fn main() -> ExitCode {
    match cli::Arguments::parse().execute() {
        Ok(status) => status,
        Err(error) => {
            eprintln!("host-bridge: {error:#}");
            ExitCode::from(2)
        }
    }
}
