//! The monitor for pipes and logs: a line now and then, and one at each change.

use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::line;
use super::session::Session;
use crate::clock::micros;
use crate::host_clock::now_us;

/// Longest wait until a signal, or a line of a log, is seen.
const LOOK: Duration = Duration::from_millis(20);

/// What the lines are to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// JSON instead of columns.
    pub is_json: bool,
    /// Time between two lines.
    pub every: Duration,
}

impl Default for Format {
    /// Columns, a line a second.
    fn default() -> Self {
        Self {
            is_json: false,
            every: Duration::from_secs(1),
        }
    }
}

/// Writes lines until `ended`, for `limit` at most, until the source has ended, or until nobody reads them any
/// more.
///
/// True if a board was there, or if nobody reads any more. Fails if they can't be written for another reason.
pub fn run(
    mut session: Session,
    format: &Format,
    limit: Option<Duration>,
    ended: &AtomicBool,
    output: &mut impl Write,
) -> io::Result<bool> {
    match write_lines(&mut session, format, limit, ended, output) {
        // Who reads no more has seen enough.
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(true),
        written => written.map(|()| session.has_met()),
    }
}

fn write_lines(
    session: &mut Session,
    format: &Format,
    limit: Option<Duration>,
    ended: &AtomicBool,
    output: &mut impl Write,
) -> io::Result<()> {
    let begun_us = now_us();
    let every_us = micros(format.every).max(1);
    let mut next_us = begun_us + every_us;
    let end_us = limit.map(|limit| begun_us.saturating_add(micros(limit)));
    if !format.is_json {
        writeln!(output, "{}", line::HEADING)?;
        output.flush()?;
    }
    loop {
        let now = now_us();
        let wait = Duration::from_micros(next_us.saturating_sub(now)).min(LOOK);
        session.wait(wait);
        session.take();
        let now = now_us();
        let log_entries = session.dashboard.take_log_entries();
        let is_due = now >= next_us;
        let is_over = session.is_over()
            || ended.load(Ordering::Acquire)
            || end_us.is_some_and(|end_us| now >= end_us);
        for log_entry in &log_entries {
            if format.is_json {
                writeln!(output, "{}", line::happening_json(log_entry))?;
            } else {
                writeln!(output, "{}", line::log_entry(log_entry))?;
            }
        }
        if is_due {
            // One line stands for those that would have been due while nobody took them.
            next_us = (next_us + every_us).max(now);
            if format.is_json {
                writeln!(output, "{}", line::second_json(&session.dashboard))?;
            } else {
                writeln!(output, "{}", line::second(&session.dashboard))?;
            }
        }
        if is_due || !log_entries.is_empty() {
            output.flush()?;
        }
        if is_over {
            return Ok(());
        }
    }
}
