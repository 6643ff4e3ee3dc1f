//! Standard error: a status line that is written over where that can be, and what is told between.

use std::io::{IsTerminal, Write};

use crossterm::terminal::size;

/// Where the status is shown. That nobody may be looking is no reason to stop.
pub struct Screen {
    /// Whether the terminal takes a line's end as it is.
    is_raw: bool,
    /// Whether the status is written over.
    is_terminal: bool,
    is_shown: bool,
}

impl Screen {
    pub fn new(is_raw: bool) -> Self {
        Self {
            is_raw,
            is_terminal: std::io::stderr().is_terminal(),
            is_shown: false,
        }
    }

    pub fn show(&mut self, status: &str) {
        if !self.is_terminal {
            self.write(&format!("{status}\n"));
            return;
        }
        let columns = size().map_or(80, |(columns, _)| usize::from(columns));
        let status: String = status.chars().take(columns.saturating_sub(1)).collect();
        self.write(&format!("\r\x1b[K{status}"));
        self.is_shown = true;
    }

    pub fn tell(&mut self, text: &str) {
        self.clear();
        self.write(&format!("{text}\n"));
    }

    fn clear(&mut self) {
        if std::mem::take(&mut self.is_shown) {
            self.write("\r\x1b[K");
        }
    }

    fn write(&self, text: &str) {
        let text = if self.is_raw {
            text.replace('\n', "\r\n")
        } else {
            text.to_owned()
        };
        let _ = std::io::stderr().write_all(text.as_bytes());
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if std::mem::take(&mut self.is_shown) {
            self.write("\n");
        }
    }
}
