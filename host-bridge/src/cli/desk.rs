//! Where a command is given: what it looks at, what it reads and prints, and what ends it.

use std::io::{self, BufRead, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::output;
use super::signals::{self, Again};
use crate::system::System;

/// A terminal at a computer, or what a test has in its place.
pub struct Desk {
    /// Clock and ports.
    pub system: System,
    /// Where answers come from.
    pub input: Box<dyn BufRead>,
    /// Where results go.
    pub output: Box<dyn Write>,
    /// Set to end what is under way.
    pub ended: Arc<AtomicBool>,
}

impl Desk {
    /// This computer's own, which a signal ends. Fails if the system does not let one listen to signals.
    pub(super) fn own() -> io::Result<Self> {
        Ok(Self {
            system: System::default(),
            input: Box::new(io::stdin().lock()),
            output: Box::new(io::stdout()),
            ended: signals::flag_set_by(&signals::USUAL, Again::EndsAtOnce)?,
        })
    }

    /// Prints `text` and ends its line. A reader that has gone away has seen enough. Fails if it can't be written for
    /// another reason.
    pub(super) fn print(&mut self, text: &str) -> anyhow::Result<()> {
        output::write_on(&mut self.output, text).map(drop)
    }

    pub(super) fn is_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }
}
