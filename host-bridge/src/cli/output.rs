//! Results on standard output.

use std::io::{self, Write};

use anyhow::Context;

/// Prints `text` and ends its line. A reader that has gone away has seen enough. Fails if it can't be written for
/// another reason.
pub fn print(text: &str) -> anyhow::Result<()> {
    print_on(text).map(drop)
}

/// Says something of this program's on standard error, whether anybody reads it or not.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr(), "host-bridge: {text}");
}

/// The same as [`print`], for who goes on printing: false if the reader has gone away. Fails if it can't be written
/// for another reason.
pub fn print_on(text: &str) -> anyhow::Result<bool> {
    write_on(&mut io::stdout().lock(), text)
}

/// The same on `out`.
pub fn write_on(out: &mut dyn Write, text: &str) -> anyhow::Result<bool> {
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(error).context("standard output can't be written"),
    }
}
