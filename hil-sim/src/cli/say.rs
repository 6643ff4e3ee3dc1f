//! Results on standard output, and what else there is to tell on standard error.

use std::fmt::Arguments;
use std::io::{self, Write};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};

/// Prints a line. A reader that has gone away (`| head`) has seen enough: the work goes on, and what it
/// writes to files is whole.
macro_rules! say {
    ($($text:tt)*) => {
        $crate::cli::say::text(format_args!("{}\n", format_args!($($text)*)))
    };
}
pub(super) use say;

/// Prints a line on standard error, if that can be written.
macro_rules! tell {
    ($($text:tt)*) => {
        // Results count, and the exit status.
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("{}\n", format_args!($($text)*)),
        );
    };
}
pub(super) use tell;

/// Whether a result is written to standard output.
static KEPT: AtomicBool = AtomicBool::new(false);

/// Standard output is for one result alone: what is said from now on goes to standard error. False if another result
/// has it already.
pub(super) fn keep_standard_output() -> bool {
    !KEPT.swap(true, Ordering::Relaxed)
}

/// Prints `text` as it is. If it can't be written, for another reason than that nobody reads it, the
/// program ends with a complaint and exit status 2.
pub(super) fn text(text: Arguments<'_>) {
    if KEPT.load(Ordering::Relaxed) {
        let _ = io::stderr().write_fmt(text);
        return;
    }
    let mut out = io::stdout().lock();
    if let Err(error) = out.write_fmt(text).and_then(|()| out.flush())
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        tell!("standard output can't be written: {error}");
        process::exit(2);
    }
}
