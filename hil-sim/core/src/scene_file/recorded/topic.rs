//! Reads the messages of one topic of an MCAP file: JSON, numbers by the names of their fields.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use mcap::McapError;
use mcap::io::MessageReader;
use mcap::sans_io::linear_reader::LinearReaderOptions;
use serde_json::Value;

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
    let refuse = |key: String, message: String| SceneError {
        file: path.display().to_string(),
        line: None,
        key,
        message,
    };
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
    let mut row = vec![0.0; fields.len()];
    for message in MessageReader::new_with_options(BufReader::new(file), options) {
        let message = match message {
            Ok(message) => message,
            Err(McapError::UnexpectedEof) => break,
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
        if !(from_s..=to_s).contains(&logged_s) {
            continue;
        }
        let key = |field: &str| format!("message {count} of {topic}{field}");
        let encoding = &message.channel.message_encoding;
        if encoding != "json" {
            let message = format!(
                "is encoded as {encoding:?}, and only JSON is read: convert it to JSON, or to CSV"
            );
            return Err(refuse(key(""), message));
        }
        let json: Value = serde_json::from_slice(&message.data)
            .map_err(|error| refuse(key(""), format!("is no JSON: {error}: mend the recording")))?;
        let number = |field: &str| {
            number(&json, field).ok_or_else(|| {
                let message = format!("is no number there: {}", known(&json));
                refuse(key(&format!(", field {field}")), message)
            })
        };
        for (value, field) in row.iter_mut().zip(fields) {
            *value = number(field)?;
        }
        let at = match when {
            // A difference of whole ns: an epoch in s would be rounded to 0.2 µs.
            When::Logged => {
                let first_ns = *first_ns.get_or_insert(message.log_time);
                (i128::from(message.log_time) - i128::from(first_ns)) as f64 * 1e-9
            }
            When::Field(field, per_unit) => {
                let raw = number(field)?;
                let first = *first.get_or_insert(if is_place { 0.0 } else { raw });
                (raw - first) * per_unit
            }
            When::Every(step) => count as f64 * step,
        };
        take(at, &row).map_err(|(column, message)| match column.checked_sub(1) {
            None => refuse(key(""), format!("{at} {message}")),
            Some(column) => refuse(
                key(&format!(", field {}", fields[column])),
                format!("{} {message}", row[column]),
            ),
        })?;
        count += 1;
    }
    if count == 0 {
        topics.sort_unstable();
        let message = if topics.is_empty() {
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
