//! What a section says of the file that it names, and the file's rows.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::super::csv_rows::{CsvRows, cut_list};
use super::super::read_bytes;
use super::super::table::{Column, Table};
use super::tape::{Check, Conversion, Tape, plain, too_few};
use super::topic;
use super::topic::When;
use super::wav::Wav;
use crate::hjif::{Channel, Experience, HjifError};
use crate::scene::SceneError;
use crate::scene::Series;

/// The keys that say where rows lie, and the column that does if none of them is given.
pub struct Words {
    /// Names a column.
    pub column: &'static str,
    /// In s or mm a unit of that column.
    pub scale: &'static str,
    /// Says that the rows are evenly spaced, and how.
    pub every: &'static str,
    pub default: &'static str,
}

/// Which messages of a recording count, by the time at which they were recorded, in s since its start.
const LOGGED: [&str; 2] = ["logged_from_s", "logged_to_s"];

/// A file's format, and what of it is open.
pub enum Format {
    /// The whole file.
    Csv(Vec<u8>),
    Wav(Wav),
    Mcap,
    /// The whole file.
    Hjif(Experience),
}

/// What a section says of its file.
pub struct Source<'t> {
    pub format: Format,
    pub channels: Option<Vec<Column<'t>>>,
    path: PathBuf,
    words: &'static Words,
    headers: Vec<String>,
    topic: Option<&'t str>,
    column: Option<Column<'t>>,
    per_unit: Option<f64>,
    /// From row to row, in s or mm.
    every: Option<f64>,
    /// From and to which time since a recording's start its messages count, in s.
    logged_s: (f64, f64),
}

impl<'t> Source<'t> {
    /// Reads the keys, and looks at the file. `headers` are the first lines that a CSV file may have if nothing
    /// is said of its columns.
    pub fn of(
        table: &mut Table<'t>,
        words: &'static Words,
        headers: &[&str],
    ) -> Result<Self, SceneError> {
        let path = table.file(&format!(
            "give a CSV file with the columns {}, or a WAV or MCAP{} file",
            headers[0],
            if words.every == "rate_hz" {
                ""
            } else {
                " or .hjif"
            }
        ))?;
        let format = format(table, &path)?;
        let source = Self {
            channels: table.columns("channels")?,
            topic: table.text("topic")?,
            column: table.column(words.column)?,
            per_unit: table.number(words.scale)?,
            every: table.number(words.every)?.map(|every| {
                if words.every == "rate_hz" {
                    every.recip()
                } else {
                    every
                }
            }),
            logged_s: (
                table.number(LOGGED[0])?.unwrap_or(f64::NEG_INFINITY),
                table.number(LOGGED[1])?.unwrap_or(f64::INFINITY),
            ),
            headers: headers.iter().map(|&header| header.to_owned()).collect(),
            format,
            path,
            words,
        };
        source.check(table)?;
        Ok(source)
    }

    /// Refuses keys that do not go with the file or with each other.
    fn check(&self, table: &Table<'_>) -> Result<(), SceneError> {
        let words = self.words;
        let is_wav = matches!(self.format, Format::Wav(_));
        let is_mcap = matches!(self.format, Format::Mcap);
        for key in ["topic"].into_iter().chain(LOGGED) {
            if table.contains(key) && !is_mcap {
                return Err(table.refuse(key, "the file is no MCAP: take it out"));
            }
        }
        if is_wav {
            let given = [words.column, words.scale].into_iter();
            // A WAV file knows its samples' times, but not their places.
            let given = given.chain((words.every == "rate_hz").then_some(words.every));
            for key in given {
                if table.contains(key) {
                    return Err(table.refuse(key, "a WAV file has none but its own: take it out"));
                }
            }
            if words.every != "rate_hz" && self.every.is_none() {
                let message =
                    "is missing: say how far apart the WAV file's samples lie on the surface";
                return Err(table.refuse(words.every, message));
            }
        }
        if matches!(self.format, Format::Hjif(_)) {
            if words.every == "rate_hz" {
                let message = "a texture is a function of place, not of time: give it to [surface], or a CSV, WAV or MCAP file here";
                return Err(table.refuse("file", message));
            }
            for key in [words.column, words.scale, words.every] {
                if table.contains(key) {
                    let message = "an .hjif file has places of its own: take it out";
                    return Err(table.refuse(key, message));
                }
            }
        }
        if self.per_unit.is_some() && self.column.is_none() {
            let message = format!("is no column's: give {} too", words.column);
            return Err(table.refuse(words.scale, message));
        }
        if self.every.is_some() && self.column.is_some() {
            let message = format!("there is {} already: give one of the two", words.column);
            return Err(table.refuse(words.every, message));
        }
        Ok(())
    }

    /// Whether it is a CSV file whose columns are the scene's own.
    pub fn is_plain(&self) -> bool {
        matches!(self.format, Format::Csv(_))
            && self.channels.is_none()
            && self.column.is_none()
            && self.every.is_none()
    }

    /// What is wrong with a texture, as a scene says it.
    pub fn refuse(&self, error: HjifError) -> SceneError {
        refuse(&self.path, error)
    }

    /// The topic, `default` if none is named; none if the file is no MCAP.
    pub fn topic_or(&self, default: &'t str) -> Option<&'t str> {
        matches!(self.format, Format::Mcap).then(|| self.topic.unwrap_or(default))
    }

    /// The rows of `columns` within `window`, two or more, and the first and last time or place of all. On the
    /// topic of `own` time is in the field that `own` names, if the section does not say otherwise.
    pub fn read(
        self,
        table: &Table<'_>,
        columns: Vec<Column<'t>>,
        own: (&'static str, (&'static str, f64)),
        window: (f64, f64),
        conversion: Conversion,
        check: Check<'_>,
    ) -> Result<(Series, (f64, f64)), SceneError> {
        let is_plain = self.is_plain();
        let file = self.path.display().to_string();
        let tape = |width| Tape::new(width, window, conversion);
        let tape = match self.format {
            Format::Csv(ref bytes) if is_plain => {
                // Columns that are named are no volts unless it is said.
                let volts = if self.headers[0].contains("g0") {
                    ", with offset_v = 0 if they hold volts"
                } else {
                    ""
                };
                let otherwise = format!(
                    ", or name other columns by channels and {} in the scene{volts}",
                    self.words.column
                );
                plain(
                    CsvRows::open(&self.path, bytes)?,
                    &self.headers,
                    &otherwise,
                    &tape,
                    check,
                )?
            }
            Format::Csv(ref bytes) => {
                let rows = CsvRows::open(&self.path, bytes)?;
                self.chosen(table, rows, &columns, &tape, check)?
            }
            Format::Wav(wav) => {
                let numbers = numbers(table, &columns, wav.channels())?;
                let step = self.every.unwrap_or_else(|| wav.rate_hz().recip());
                let rate_hz = wav.rate_hz();
                let mut tape = tape(numbers.len());
                wav.each(&numbers, |t_s, row| {
                    // As many steps as samples: times in s would be rounded.
                    tape.take((t_s * rate_hz).round() * step, row, check)
                })?;
                tape
            }
            Format::Hjif(ref file) => {
                let texture = file.texture().map_err(|error| self.refuse(error))?;
                let channels = texture.channels();
                let [column] = columns[..] else {
                    return Err(table.refuse("channels", "names several: name one"));
                };
                let is_named = |channel: &Channel| match column {
                    Column::Numbered(id) => channel.id as usize == id,
                    Column::Named(name) => channel.description == name,
                };
                let Some(at) = channels.iter().position(is_named) else {
                    let message = format!("{column} is the id or the description of no channel");
                    return Err(table.refuse("channels", message));
                };
                let heights = texture.heights(at).map_err(|error| self.refuse(error))?;
                let mut tape = tape(1);
                for (x_mm, height) in heights {
                    tape.take(x_mm, &[height], check).map_err(|(_, message)| {
                        let place = format!("channel {column} at {x_mm} mm");
                        refuse(&self.path, HjifError::at(place, message))
                    })?;
                }
                tape
            }
            Format::Mcap => {
                let fields = names(table, &columns)?;
                let Some(topic) = self.topic.or((!own.0.is_empty()).then_some(own.0)) else {
                    let message = "is missing: name the topic whose messages are to be read";
                    return Err(table.refuse("topic", message));
                };
                let when = match (self.column, self.every) {
                    (Some(Column::Named(field)), _) => {
                        When::Field(field, self.per_unit.unwrap_or(1.0))
                    }
                    (Some(Column::Numbered(_)), _) => {
                        let message = "is a number: messages have fields with names";
                        return Err(table.refuse(self.words.column, message));
                    }
                    (None, Some(every)) => When::Every(every),
                    (None, None) if topic == own.0 => When::Field(own.1.0, own.1.1),
                    (None, None) if self.words.every == "rate_hz" => When::Logged,
                    (None, None) => {
                        let message = format!(
                            "is missing: name the field with the place in mm, or give {}",
                            self.words.every
                        );
                        return Err(table.refuse(self.words.column, message));
                    }
                };
                let is_place = self.words.every != "rate_hz";
                let mut tape = tape(fields.len());
                let piece = (when, is_place, self.logged_s);
                topic::each(&self.path, topic, &fields, piece, |at, row| {
                    tape.take(at, row, check)
                })?;
                tape
            }
        };
        let extent = tape.extent();
        let rows = tape.into_rows();
        match extent {
            Some(extent) if rows.at.len() >= 2 => Ok((rows, extent)),
            // There are rows, but the scene is elsewhere: the section says so.
            Some(extent) if extent.0 < extent.1 => Ok((Series::empty(1), extent)),
            _ => Err(too_few(&file, &rows)),
        }
    }

    /// A CSV file of whatever columns.
    fn chosen(
        &self,
        table: &Table<'_>,
        rows: CsvRows<'_>,
        channels: &[Column<'_>],
        tape: &dyn Fn(usize) -> Tape,
        check: Check<'_>,
    ) -> Result<Tape, SceneError> {
        if channels.is_empty() {
            let message = "is missing: name the CSV file's columns, such as [\"ax\"] or [1]";
            return Err(table.refuse("channels", message));
        }
        let find = |key: &'static str, column: Column<'_>| {
            if let Column::Named(name) = column {
                let alike = rows.first().iter().filter(|cell| *cell == name).count();
                if alike > 1 {
                    let message =
                        format!("{column} is the name of {alike} columns: give numbers, from 0 on");
                    return Err(table.refuse(key, message));
                }
            }
            let found = match column {
                Column::Numbered(number) => (number < rows.first().len()).then_some(number),
                Column::Named(name) => rows.first().iter().position(|cell| cell == name),
            };
            found.ok_or_else(|| {
                let message = if rows.is_bare() {
                    format!(
                        "{column} is no column: the file's first line holds numbers, so give numbers from 0 to {}",
                        rows.first().len() - 1
                    )
                } else {
                    format!("{column} is no column: there are {}", cut_list(&rows.first().join(", ")))
                };
                table.refuse(key, message)
            })
        };
        let mut columns = Vec::with_capacity(channels.len() + 1);
        match (self.column, self.every) {
            (Some(column), _) => columns.push(find(self.words.column, column)?),
            (None, Some(_)) => {}
            (None, None) => {
                let default = rows
                    .first()
                    .iter()
                    .position(|cell| cell == self.words.default);
                columns.push(default.ok_or_else(|| {
                    let message = format!(
                        "is missing: name the column, or give {} if the rows are evenly spaced",
                        self.words.every
                    );
                    table.refuse(self.words.column, message)
                })?);
            }
        }
        let has_place = columns.len();
        for &channel in channels {
            columns.push(find("channels", channel)?);
        }
        let bare = rows.is_bare();
        let mut tape = tape(channels.len());
        let mut count = 0.0;
        rows.each(&columns, bare, |row| {
            let at = match (has_place, self.every) {
                (0, Some(every)) => count * every,
                _ => row[0] * self.per_unit.unwrap_or(1.0),
            };
            count += 1.0;
            // Without a column of places, the first column is the first channel.
            let columns_from = |(column, message): (usize, String)| {
                ((column + has_place).saturating_sub(1), message)
            };
            tape.take(at, &row[has_place..], check)
                .map_err(columns_from)
        })?;
        Ok(tape)
    }
}

/// What the file is, by its first bytes; text is read as a whole.
fn format(table: &Table<'_>, path: &Path) -> Result<Format, SceneError> {
    let refuse_file = |error: std::io::Error| table.unreadable(path, &error);
    let mut first = Vec::new();
    // What comes out of a pipe comes once, and is text.
    if fs::metadata(path).map_err(refuse_file)?.is_file() {
        fs::File::open(path)
            .and_then(|file| file.take(8).read_to_end(&mut first))
            .map_err(refuse_file)?;
    }
    if first.starts_with(b"RIFF") {
        Wav::open(path).map(Format::Wav)
    } else if first.starts_with(b"\x89MCAP") {
        Ok(Format::Mcap)
    } else {
        let text = read_bytes(path).map_err(refuse_file)?;
        if is_json(&text) {
            let file = Experience::parse(&text).map_err(|error| refuse(path, error))?;
            return Ok(Format::Hjif(file));
        }
        Ok(Format::Csv(text))
    }
}

/// Whether a text is a JSON object, whatever blanks are before it: no table begins so.
fn is_json(text: &[u8]) -> bool {
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    text.trim_ascii_start().starts_with(b"{")
}

fn refuse(path: &Path, error: HjifError) -> SceneError {
    SceneError {
        file: path.display().to_string(),
        line: error.line,
        key: error.place,
        message: error.message,
    }
}

fn numbers(
    table: &Table<'_>,
    columns: &[Column<'_>],
    channels: usize,
) -> Result<Vec<usize>, SceneError> {
    let number = |column: &Column<'_>| match *column {
        Column::Numbered(number) if number < channels => Ok(number),
        column => {
            let message = format!(
                "{column} is no channel of the WAV file: give numbers from 0 to {}",
                channels - 1
            );
            Err(table.refuse("channels", message))
        }
    };
    columns.iter().map(number).collect()
}

fn names<'t>(table: &Table<'_>, columns: &[Column<'t>]) -> Result<Vec<&'t str>, SceneError> {
    let name = |column: &Column<'t>| match *column {
        Column::Named(name) => Ok(name),
        Column::Numbered(number) => {
            let message =
                format!("{number} is a number: name the messages' fields, such as [\"g0_v\"]");
            Err(table.refuse("channels", message))
        }
    };
    columns.iter().map(name).collect()
}
