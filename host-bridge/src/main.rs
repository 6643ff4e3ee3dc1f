//! The tool at the operator's desk. See the library for what it is made of.

use std::process::ExitCode;

use clap::Parser;

mod cli;

fn main() -> ExitCode {
    match cli::Arguments::parse().execute() {
        Ok(status) => status,
        Err(error) => {
            eprintln!("host-bridge: {}", words(&error));
            ExitCode::from(2)
        }
    }
}

/// An error and its causes, each said once: many errors name their cause themselves.
fn words(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}
