//! What is worth a line of its own.

use std::fmt;

use protocol::{ArmState, DisplayState, Role, Trip};
use serde::{Deserialize, Serialize};

use crate::state::{Advised, State};

/// How grave a line can be, in defmt's words.
const LEVELS: [&str; 5] = ["trace", "debug", "info", "warn", "error"];

/// Something that happened at one of the boards.
#[derive(Clone, Debug, PartialEq)]
pub struct LogEntry {
    /// When, in µs of [`crate::clock::now_us`].
    pub at_us: u64,
    /// Where.
    pub role: Role,
    /// What.
    pub what: LogEvent,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum LogEvent {
    /// The link stands differently.
    Link(State),
    /// The supervisor's state is another.
    Safety(DisplayState),
    /// The sensor board's arm drive is off for good.
    ArmStopped(Trip),
    /// The board has started anew.
    Restarted,
    /// The board's firmware has logged a line.
    Log {
        /// How grave it is, in defmt's words; none for what was printed without a level.
        level: Option<&'static str>,
        /// The line.
        text: String,
    },
    /// Its log can't be read at the moment, or begins anew.
    LogLost(String),
}

/// What comes of a log, as it is told to other programs and to the other site.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LogLine {
    /// See [`LogEvent::Log`].
    Line {
        /// How grave it is, in defmt's words.
        level: Option<String>,
        /// The line.
        text: String,
    },
    /// See [`LogEvent::LogLost`].
    Lost(String),
}

impl LogLine {
    /// The line of `event`, or as much of it as `longest` bytes hold; none if the event is not a log's.
    pub fn of(event: LogEvent, longest: usize) -> Option<Self> {
        let cut = |mut text: String| {
            text.truncate(text.floor_char_boundary(longest));
            text
        };
        match event {
            LogEvent::Log { level, text } => Some(Self::Line {
                level: level.map(ToOwned::to_owned),
                text: cut(text),
            }),
            LogEvent::LogLost(reason) => Some(Self::Lost(cut(reason))),
            _ => None,
        }
    }
}

/// It comes from elsewhere: what no text has is taken out of it.
impl From<LogLine> for LogEvent {
    fn from(line: LogLine) -> Self {
        let plain = |text: String| text.replace(char::is_control, " ");
        match line {
            LogLine::Line { level, text } => Self::Log {
                level: LEVELS
                    .into_iter()
                    .find(|known| level.as_deref() == Some(known)),
                text: plain(text),
            },
            LogLine::Lost(reason) => Self::LogLost(plain(reason)),
        }
    }
}

impl LogEvent {
    /// One word for its kind; never changes.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Link(_) => "link",
            Self::Safety(_) => "safety",
            Self::ArmStopped(_) => "arm-stopped",
            Self::Restarted => "restarted",
            Self::Log { .. } => "log",
            Self::LogLost { .. } => "log-lost",
        }
    }

    /// What a recording keeps as the board's log: its lines, with defmt's level, and where some are missing.
    pub fn line(&self) -> Option<(Option<&'static str>, String)> {
        match self {
            Self::Log { level, text } => Some((*level, text.clone())),
            Self::LogLost(_) => Some((Some("warn"), self.to_string())),
            _ => None,
        }
    }

    /// Whether something is wrong.
    pub fn is_bad(&self) -> bool {
        match self {
            Self::Link(state) => state.advice().is_some(),
            Self::Safety(state) => matches!(state, DisplayState::Stopped(_)),
            Self::ArmStopped(_) | Self::Restarted | Self::LogLost { .. } => true,
            Self::Log { level, .. } => matches!(level, Some("error" | "warn")),
        }
    }
}

/// The entry in one line, with the advice if there is one.
impl fmt::Display for LogEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(state) => write!(f, "{}", Advised(state)),
            Self::Safety(state) => write!(f, "{state}"),
            Self::ArmStopped(trip) => write!(f, "arm {}", ArmState::Stopped(*trip)),
            Self::Restarted => f.write_str("has started anew"),
            Self::Log { level, text } => match level {
                Some(level) => write!(f, "{level}: {text}"),
                None => f.write_str(text),
            },
            Self::LogLost(reason) => write!(f, "its log is interrupted: {reason}"),
        }
    }
}
