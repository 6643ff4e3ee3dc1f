//! What the boards say, watched: as a dashboard in a terminal, or line by line.
//!
//! ```text
//! links, or a recording ─> Source ─> Dashboard ─┬─> draw ─> terminal
//!                                       ^       └─> line ─> pipe, file
//!                    firmware_log ──────┘
//! ```
//!
//! The [`dashboard`] knows neither boards nor terminals: it is fed events, and says what is to be said.
//! A recording that a key has begun gets them from whoever hears the boards, by a [`RecordingFeed`].

pub(crate) mod board;
pub mod dashboard;
pub mod draw;
pub mod fingertip;
pub(crate) mod firmware_log;
pub(crate) mod keys;
pub(crate) mod line;
pub mod log_entry;
pub mod orders;
pub(crate) mod screen;
pub(crate) mod session;
pub mod settings;
pub mod theme;
pub mod trace;
pub mod view;

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

pub use session::{RecordingFeed, Source};

use crate::recording::RecordingError;
use line::Format;
use session::Session;

/// How the boards are watched.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Lines instead of a dashboard; also where there is no terminal.
    pub plain: Option<Format>,
    /// Ends after so long.
    pub limit: Option<Duration>,
    /// The folder for recordings that a key begins.
    pub folder: PathBuf,
}

impl Options {
    /// How lines are written; none where a dashboard is drawn.
    pub fn lines(&self) -> Option<Format> {
        match self.plain {
            None if io::stdout().is_terminal() => None,
            plain => Some(plain.unwrap_or_default()),
        }
    }
}

/// Why the watching ended before its time.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum MonitorError {
    #[error("can't write to standard output: {0}")]
    Output(#[from] io::Error),
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Watches what `source` tells, until a key or `ended` ends it; lines end with the source, too. True if somebody
/// watched, or if a board was there to be written of. Fails if standard output takes no more, unless nobody reads
/// it any more, or if a recording can't be written.
pub fn run(
    source: Source,
    options: &Options,
    ended: &Arc<AtomicBool>,
) -> Result<bool, MonitorError> {
    let session = Session::new(source, options.folder.clone());
    match options.lines() {
        Some(format) => {
            let mut output = io::stdout().lock();
            Ok(line::run(
                session,
                &format,
                options.limit,
                ended,
                &mut output,
            )?)
        }
        None => screen::run(session, options.limit, ended).map(|()| true),
    }
}
