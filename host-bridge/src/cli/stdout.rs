//! Results on standard output.

use std::io::{self, ErrorKind, Write};

use anyhow::Context;

/// Prints `text`. A reader that has seen enough and has gone is no error.
pub fn print(text: &[u8]) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(error).context("standard output can't be written")
        }
        _ => Ok(()),
    }
}
