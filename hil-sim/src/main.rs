//! `hil-sim`: runs scenes on the firmware, on a host or on emulated boards.

use std::io;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

mod cli;

fn main() -> ExitCode {
    match cli::Arguments::parse().execute() {
        Ok(code) => code,
        Err(error) => {
            // Where nobody can be told, the exit status says it.
            let _ = writeln!(io::stderr(), "{error:#}");
            ExitCode::from(2)
        }
    }
}
