//! Reads the messages of one topic of an MCAP file: JSON, or messages of ROS 2; numbers by the names of their
//! fields.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use mcap::io::MessageReader;
use mcap::sans_io::linear_reader::LinearReaderOptions;
use mcap::{Channel, McapError};
use ros2msg::{Definition, decode};
use serde_json::Value;

use super::block;
use super::tape::Refusal;
use crate::scene::SceneError;

/// Longer records are none of a recording: a damaged length must not ask for all memory.
const LONGEST_RECORD: usize = 1 << 26;

/// Where a message's time is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum When<'t> {
    /// The time at which it was recorded.
    Logged,
    /// In a field, so many s or mm a unit.
    Field(&'t str, f64),
    /// The messages are evenly spaced by so much.
    Every(f64),
}

/// Hands `fields` of each message on `topic` to `take`, with its time or place: since the first message's,
/// unless it `is_place`. Only messages count that were recorded between two times, in s since the recording's start. A file that was cut off is read as far as it goes.
pub fn each(
    path: &Path,
    topic: &str,
    fields: &[&str],
    (when, is_place, (from_s, to_s)): (When<'_>, bool, (f64, f64)),
    mut take: impl FnMut(f64, &[f64]) -> Result<(), Refusal>,
) -> Result<(), SceneError> {
    let refuse = |key: String, message: String| SceneError::of(path.display(), key, message);
    let file = File::open(path).map_err(|error| {
        refuse(
            String::new(),
            format!("cannot be read: {error}: give an MCAP file"),
        )
    })?;
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LONGEST_RECORD);
    let mut topics: Vec<String> = Vec::new();
    let mut count: u64 = 0;
    let (mut start_ns, mut first_ns, mut first) = (None, None, None);
    let mut format: Option<Format> = None;
    let mut logged_extent_s: Option<(f64, f64)> = None;
    let mut row = vec![0.0; fields.len()];
    for message in MessageReader::new_with_options(BufReader::new(file), options) {
        let message = match message {
            Ok(message) => message,
            Err(McapError::UnexpectedEof) => break,
            // What is damaged lies behind the piece that is wanted.
            Err(_) if logged_extent_s.is_some_and(|(_, last_s)| last_s > to_s) => break,
            Err(error) => {
                let key = format!("after message {count} of {topic}");
                return Err(refuse(key, format!("damaged: {error}: give a sound file")));
            }
        };
        let start_ns = *start_ns.get_or_insert(message.log_time);
        let found = &message.channel.topic;
        if found != topic {
            if !topics.contains(found) {
                topics.push(found.clone());
            }
            continue;
        }
        let logged_s = message.log_time.saturating_sub(start_ns) as f64 / 1e9;
        logged_extent_s = logged_extent_s.map_or(Some((logged_s, logged_s)), |(first_s, _)| {
            Some((first_s, logged_s))
        });
        if !(from_s..=to_s).contains(&logged_s) {
            continue;
        }
        let key = |count: u64, field: &str| format!("message {count} of {topic}{field}");
        let format = match &mut format {
            Some(format) => format,
            none => none.insert(
                Format::of(&message.channel).map_err(|message| refuse(key(count, ""), message))?,
            ),
        };
        let value = format
            .read(&message.data)
            .map_err(|message| refuse(key(count, ""), message))?;
        // A block of samples is as many messages, 1 ms apart.
        let (samples, step_ns) = match block::samples(&value).filter(|_| format.is_block) {
            Some(samples) => (samples, 1_000_000),
            None => (vec![value], 0),
        };
        for (log_time, value) in (message.log_time..).step_by(step_ns.max(1)).zip(samples) {
            let number = |field: &str| {
                number(&value, field).ok_or_else(|| {
                    let message = format!("is no number there: {}", known(&value));
                    refuse(key(count, &format!(", field {field}")), message)
                })
            };
            for (value, field) in row.iter_mut().zip(fields) {
                *value = number(field)?;
            }
            let at = match when {
                // A difference of whole ns: an epoch in s would be rounded to 0.2 µs.
                When::Logged => {
                    let first_ns = *first_ns.get_or_insert(log_time);
                    (i128::from(log_time) - i128::from(first_ns)) as f64 * 1e-9
                }
                When::Field(field, per_unit) => {
                    let raw = number(field)?;
                    let first = *first.get_or_insert(if is_place { 0.0 } else { raw });
                    (raw - first) * per_unit
                }
                When::Every(step) => count as f64 * step,
            };
            take(at, &row).map_err(|(column, message)| match column.checked_sub(1) {
                None => refuse(key(count, ""), format!("{at} {message}")),
                Some(column) => refuse(
                    key(count, &format!(", field {}", fields[column])),
                    format!("{} {message}", row[column]),
                ),
            })?;
            count += 1;
        }
    }
    if count == 0 {
        topics.sort_unstable();
        let message = if let Some((first_s, last_s)) = logged_extent_s {
            format!(
                "has messages on {topic} from {first_s} to {last_s} s, none between logged_from_s and logged_to_s: give others"
            )
        } else if topics.is_empty() {
            "holds no messages: give an MCAP file that does".to_owned()
        } else {
            format!(
                "has no messages on {topic}: give topic as one of {}",
                topics.join(", ")
            )
        };
        return Err(refuse(String::new(), message));
    }
    Ok(())
}

/// How the messages of a topic are written.
struct Format {
    /// None: JSON.
    definition: Option<Definition>,
    /// Each holds several samples of our gauges.
    is_block: bool,
}

impl Format {
    /// What a channel says of itself; words for a person if it is not read.
    fn of(channel: &Channel<'_>) -> Result<Self, String> {
        let schema = channel.schema.as_deref();
        let definition = match (channel.message_encoding.as_str(), schema) {
            ("json", _) => None,
            ("cdr", Some(schema)) if schema.encoding == "ros2msg" => {
                let text = String::from_utf8_lossy(&schema.data);
                let definition = Definition::parse(&schema.name, &text);
                Some(definition.map_err(|error| {
                    format!("has a definition that can't be read: {error}: mend the recording")
                })?)
            }
            (encoding, _) => {
                return Err(format!(
                    "is encoded as {encoding:?}, and only JSON and ROS 2's CDR with ros2msg are read: convert it \
                     to one of them, or to CSV"
                ));
            }
        };
        Ok(Self {
            definition,
            is_block: schema.is_some_and(|schema| schema.name == block::SCHEMA),
        })
    }

    fn read(&self, data: &[u8]) -> Result<Value, String> {
        match &self.definition {
            None => serde_json::from_slice(data)
                .map_err(|error| format!("is no JSON: {error}: mend the recording")),
            Some(definition) => decode(definition, data).map_err(|error| {
                format!("is not as its definition says: {error}: mend the recording")
            }),
        }
    }
}

/// The number at a path of fields with dots between them, indices of lists among them.
fn number(json: &Value, field: &str) -> Option<f64> {
    let mut value = json;
    for name in field.split('.') {
        value = match value {
            Value::Array(list) => list.get(name.parse::<usize>().ok()?)?,
            _ => value.get(name)?,
        };
    }
    value.as_f64()
}

/// What fields of numbers a message has, for error messages.
fn known(json: &Value) -> String {
    let mut names = Vec::new();
    collect(json, String::new(), &mut names);
    if names.is_empty() {
        "the message holds no numbers".to_owned()
    } else {
        format!("there are {}", names.join(", "))
    }
}

fn collect(json: &Value, path: String, names: &mut Vec<String>) {
    /// More would not be read.
    const MOST: usize = 24;
    let join = |name: &str| {
        if path.is_empty() {
            name.to_owned()
        } else {
            format!("{path}.{name}")
        }
    };
    match json {
        _ if names.len() >= MOST => {}
        Value::Number(_) => names.push(path),
        Value::Object(map) => map
            .iter()
            .for_each(|(name, value)| collect(value, join(name), names)),
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(index, value)| collect(value, join(&index.to_string()), names)),
        _ => {}
    }
}
