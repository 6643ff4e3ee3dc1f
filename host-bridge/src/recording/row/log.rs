//! A line of a firmware's log as a row, in the form that ROS 2 gives its own logs; and texts and numbers as rows have
//! them: texts with a shape, and numbers that may be none.

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, NamedType};
use serde::{Deserialize, Deserializer, Serialize};

/// A line of a firmware's log.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LogRow {
    /// When it was read, for the log carries no time of the board's: the same as log_time.
    pub stamp: Time,
    /// How grave it is, by the constants above; defmt's `trace` is DEBUG, too, and a line that was printed
    /// without a level INFO.
    pub level: u8,
    /// The board: `sensor` or `display`.
    pub name: Text,
    /// The line.
    pub msg: Text,
    /// Always empty.
    pub file: Text,
    /// Always empty.
    pub function: Text,
    /// Always 0.
    pub line: u32,
}

/// An instant, as ROS 2 writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Time {
    /// Whole s since 1970.
    pub sec: i32,
    /// ns beside them.
    pub nanosec: u32,
}

/// The levels of ROS 2.
pub const LEVELS: [(&str, u8); 5] = [
    ("DEBUG", 10),
    ("INFO", 20),
    ("WARN", 30),
    ("ERROR", 40),
    ("FATAL", 50),
];

impl LogRow {
    /// The row of a line of the board `name`, read at `at_ns` since 1970. `level` is defmt's.
    pub fn new(name: &str, level: Option<&str>, text: &str, at_ns: u64) -> Self {
        const NS_PER_S: u64 = 1_000_000_000;
        let level = match level {
            Some("trace" | "debug") => 10,
            Some("warn") => 30,
            Some("error") => 40,
            _ => 20,
        };
        Self {
            stamp: Time {
                sec: i32::try_from(at_ns / NS_PER_S).unwrap_or(i32::MAX),
                nanosec: (at_ns % NS_PER_S) as u32,
            },
            level,
            name: name.into(),
            msg: text.into(),
            file: Text::default(),
            function: Text::default(),
            line: 0,
        }
    }
}

/// A text.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Text(pub String);

impl Schema for Text {
    const SCHEMA: &'static NamedType = &NamedType {
        name: "Text",
        ty: &DataModelType::String,
    };
}

impl<T: Into<String>> From<T> for Text {
    fn from(text: T) -> Self {
        Self(text.into())
    }
}

/// A number; null is NaN, which JSON has not.
pub fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f32::NAN))
}

/// A number that is there; null is NaN. To be used with `default`: a number that is not there is none.
pub fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f32>, D::Error> {
    number(deserializer).map(Some)
}
