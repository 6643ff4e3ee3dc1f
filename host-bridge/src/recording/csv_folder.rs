//! A folder of CSV files, one a channel, that are being written; their columns are those of the rows' types.

use std::path::{Path, PathBuf};
use std::{fs, io};

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, NamedType};
use protocol::Gauges;
use serde_json::Value;

use super::row::{CHANNELS, GaugeRow, Kind, Row, SAMPLE_US, channel};
use super::row_builder::Entry;
use super::sink::{Sink, SinkWriter};
use crate::recording::RecordingError;

const NS_PER_S: u64 = 1_000_000_000;
const NS_PER_US: u64 = 1_000;
const BUFFER_BYTES: usize = 1 << 16;

/// A folder that is being written. A channel's file is made when something is said on it.
pub struct CsvFolder {
    folder: PathBuf,
    /// It was made here, and goes if it is not kept.
    fresh: bool,
    files: [Option<Channel>; CHANNELS.len()],
}

struct Channel {
    sink: Sink,
    writer: csv::Writer<SinkWriter>,
    cells: Vec<String>,
    /// The time of the last line, in ns.
    last_ns: u64,
    dirty: bool,
}

/// A channel's file within the folder.
pub fn file_name(at: usize) -> String {
    let (role, kind) = CHANNELS[at];
    format!("{}-{}.csv", role.name(), kind.name())
}

impl CsvFolder {
    /// Makes the folder. `force` takes one that is not empty. Dropping it before [`CsvFolder::keep`] takes away
    /// what was made. Fails if there is one with anything in it, or it can't be made.
    pub fn create(folder: &Path, force: bool) -> Result<Self, RecordingError> {
        let not_made = |source| RecordingError::not_made(folder, source);
        let fresh = !folder.exists();
        if !fresh && !folder.is_dir() {
            return Err(not_made(io::ErrorKind::NotADirectory.into()));
        }
        fs::create_dir_all(folder).map_err(not_made)?;
        let full = fs::read_dir(folder).map_err(not_made)?.next().is_some();
        if full && !force {
            return Err(RecordingError::Exists(folder.to_owned()));
        }
        Ok(Self {
            folder: folder.to_owned(),
            fresh,
            files: [const { None }; CHANNELS.len()],
        })
    }

    /// The folder stays, and the files of an earlier recording go. Fails if one of them can't be removed.
    pub fn keep(&mut self) -> Result<(), RecordingError> {
        for at in 0..CHANNELS.len() {
            let path = self.folder.join(file_name(at));
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(RecordingError::NotMade(path, source));
                }
                _ => {}
            }
        }
        self.fresh = false;
        Ok(())
    }

    /// Writes an entry. It is safe after the next [`CsvFolder::sync`]. Fails if its file can't be made, or does not
    /// take it.
    pub fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        let kind = entry.row.kind();
        let Some(at) = channel(entry.role, kind) else {
            return Ok(());
        };
        let file = match &mut self.files[at] {
            Some(file) => file,
            none => none.insert(Channel::create(&self.folder.join(file_name(at)), kind)?),
        };
        file.write(entry)
    }

    /// Makes everything written so far safe. Fails if a file does not take it, or was removed.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        self.files.iter_mut().flatten().try_for_each(Channel::sync)
    }

    pub fn safe_bytes(&self) -> u64 {
        let files = self.files.iter().flatten();
        files.map(|file| file.sink.safe_bytes()).sum()
    }

    /// Takes away what is not safe, so that each file ends with a whole line.
    pub fn abandon(&mut self) {
        for file in self.files.iter().flatten() {
            file.sink.cut();
        }
    }
}

impl Drop for CsvFolder {
    fn drop(&mut self) {
        if self.fresh {
            // Only an empty one goes.
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// What a line of a channel's file is made of.
fn shape(kind: Kind) -> &'static NamedType {
    match kind {
        Kind::Gauges => GaugeRow::SCHEMA,
        kind => kind.shape(),
    }
}

impl Channel {
    fn create(path: &Path, kind: Kind) -> Result<Self, RecordingError> {
        let sink = Sink::create(path, false)?;
        let writer = sink.writer()?;
        let mut channel = Self {
            sink,
            writer: csv::WriterBuilder::new()
                .buffer_capacity(BUFFER_BYTES)
                .from_writer(writer),
            cells: Vec::new(),
            last_ns: 0,
            dirty: true,
        };
        channel.cells = vec!["time_s".to_owned()];
        channel.cells.append(&mut columns(shape(kind)));
        channel.write_cells()?;
        Ok(channel)
    }

    fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        if let Row::Gauges(block) = &entry.row {
            let mut ns = entry.log_ns;
            for row in GaugeRow::all(&Gauges::from(block)) {
                let value = serde_json::to_value(row);
                let value = value.map_err(|error| self.failed(error.into()))?;
                self.write_line(ns, GaugeRow::SCHEMA, &value)?;
                ns = ns.saturating_add(SAMPLE_US * NS_PER_US);
            }
            return Ok(());
        }
        let value = entry.row.value();
        let value = value.map_err(|error| self.failed(error.into()))?;
        self.write_line(entry.log_ns, entry.row.kind().shape(), &value)
    }

    fn write_line(
        &mut self,
        ns: u64,
        shape: &'static NamedType,
        value: &Value,
    ) -> Result<(), RecordingError> {
        self.cells.clear();
        // A block whose time is when it was heard may begin before the one before has ended.
        self.last_ns = ns.max(self.last_ns);
        let ns = self.last_ns;
        let time = format!("{}.{:09}", ns / NS_PER_S, ns % NS_PER_S);
        self.cells.push(time);
        cells(shape, Some(value), &mut self.cells);
        self.write_cells()
    }

    fn write_cells(&mut self) -> Result<(), RecordingError> {
        self.dirty = true;
        self.writer
            .write_record(&self.cells)
            .map_err(|error| self.failed(error.into()))
    }

    fn sync(&mut self) -> Result<(), RecordingError> {
        if std::mem::take(&mut self.dirty) {
            let flushed = self.writer.flush();
            flushed.map_err(|source| self.failed(source))?;
        }
        self.sink.sync()?;
        self.sink.keep()
    }

    fn failed(&self, source: io::Error) -> RecordingError {
        self.sink.failed(source)
    }
}

/// The CSV columns of a type: fields within fields are joined by `_`, items are numbered from 0.
pub fn columns(named: &'static NamedType) -> Vec<String> {
    let mut names = Vec::new();
    add_columns(named, "", &mut names);
    names
}

fn add_columns(named: &'static NamedType, name: &str, names: &mut Vec<String>) {
    let within = |inner: &str| {
        if name.is_empty() {
            inner.to_owned()
        } else {
            format!("{name}_{inner}")
        }
    };
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
            add_columns(inner, name, names);
        }
        DataModelType::Struct(fields) => {
            for field in *fields {
                add_columns(field.ty, &within(field.name), names);
            }
        }
        DataModelType::Tuple(items) => {
            for (index, item) in items.iter().enumerate() {
                add_columns(item, &within(&index.to_string()), names);
            }
        }
        _ => names.push(name.to_owned()),
    }
}

/// The cells under [`columns`] of a value of the type; those of a field that is missing are empty.
pub fn cells(named: &'static NamedType, value: Option<&Value>, cells: &mut Vec<String>) {
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
            self::cells(inner, value, cells);
        }
        DataModelType::Struct(fields) => {
            for field in *fields {
                self::cells(
                    field.ty,
                    value.and_then(|value| value.get(field.name)),
                    cells,
                );
            }
        }
        DataModelType::Tuple(items) => {
            for (index, item) in items.iter().enumerate() {
                self::cells(item, value.and_then(|value| value.get(index)), cells);
            }
        }
        _ => cells.push(match value {
            None | Some(Value::Null) => String::new(),
            Some(Value::String(text)) => text.clone(),
            Some(value) => value.to_string(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use protocol::{CHANNELS, GAUGE_BLOCK, GaugeSample, Role};

    use super::*;

    #[test]
    fn times_do_not_decrease_where_blocks_come_close_together() {
        let path = std::env::temp_dir().join(format!("csv-folder-{}", std::process::id()));
        let mut folder = CsvFolder::create(&path, true).unwrap();
        // Of a board whose clock is not known yet: by when they were heard, not 8 ms apart.
        for (first_sample, log_ns) in [(0, 50_000_000), (8, 51_000_000), (16, 70_000_000)] {
            let gauges = Gauges {
                first_sample,
                instant_us: 1_000 * u64::from(first_sample),
                position_um: 0,
                samples: [GaugeSample {
                    codes: [0; CHANNELS],
                    travel_um: 0,
                }; GAUGE_BLOCK],
            };
            let entry = Entry {
                role: Role::Sensor,
                row: Row::Gauges((&gauges).into()),
                log_ns,
            };
            folder.write(&entry).unwrap();
        }
        folder.sync().unwrap();
        let text = fs::read_to_string(path.join("sensor-gauges.csv")).unwrap();
        fs::remove_dir_all(&path).unwrap();
        let times: Vec<&str> = text
            .lines()
            .skip(1)
            .filter_map(|line| line.split(',').next())
            .collect();
        assert_eq!(times.len(), 3 * GAUGE_BLOCK);
        assert!(times.is_sorted(), "{times:?}");
        assert_eq!(times[2 * GAUGE_BLOCK], "0.070000000");
    }
}
