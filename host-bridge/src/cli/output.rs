//! Results on standard output.

use std::io::{self, Write};

use anyhow::Context;

/// Prints `text` and ends its line. A reader that has gone away has seen enough.
///
/// # Errors
/// If it can't be written for another reason.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("standard output can't be written"),
    }
}
