//! A folder of CSV files, one a channel, that are being written.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::error::RecordingError;
use super::json_schema::{cells, columns};
use super::row::{CHANNELS, Kind, channel};
use super::row_builder::Entry;
use super::sink::{Sink, SinkWriter};

const NS_PER_S: u64 = 1_000_000_000;
/// Some hundred lines.
const BUFFER_BYTES: usize = 1 << 16;

/// A folder that is being written. A channel's file is made when something is said on it.
pub struct CsvFolder {
    folder: PathBuf,
    force: bool,
    files: [Option<Channel>; CHANNELS.len()],
}

struct Channel {
    sink: Sink,
    writer: csv::Writer<SinkWriter>,
    cells: Vec<String>,
    dirty: bool,
}

/// A channel's file within the folder.
pub fn file_name(at: usize) -> String {
    let (role, kind) = CHANNELS[at];
    format!("{}-{}.csv", role.name(), kind.name())
}

impl CsvFolder {
    /// Makes the folder. `force` takes one that is not empty, and removes the files of a recording.
    ///
    /// # Errors
    /// If there is one with anything in it, or it can't be made.
    pub fn create(folder: &Path, force: bool) -> Result<Self, RecordingError> {
        let not_made = |source| RecordingError::not_made(folder, source);
        fs::create_dir_all(folder).map_err(not_made)?;
        let full = fs::read_dir(folder).map_err(not_made)?.next().is_some();
        if full && !force {
            return Err(RecordingError::Exists {
                path: folder.to_owned(),
            });
        }
        for at in 0..CHANNELS.len() {
            let path = folder.join(file_name(at));
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(RecordingError::NotMade { path, source });
                }
                _ => {}
            }
        }
        Ok(Self {
            folder: folder.to_owned(),
            force,
            files: [const { None }; CHANNELS.len()],
        })
    }

    /// Writes an entry. It is safe after the next [`CsvFolder::sync`].
    ///
    /// # Errors
    /// If its file can't be made, or does not take it.
    pub fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        let kind = entry.row.kind();
        let Some(at) = channel(entry.role, kind) else {
            return Ok(());
        };
        let file = match &mut self.files[at] {
            Some(file) => file,
            none => none.insert(Channel::create(
                &self.folder.join(file_name(at)),
                kind,
                self.force,
            )?),
        };
        file.write(entry)
    }

    /// Makes everything written so far safe.
    ///
    /// # Errors
    /// If a file does not take it, or was removed.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        self.files.iter_mut().flatten().try_for_each(Channel::sync)
    }

    /// Bytes that are safe.
    pub fn safe_bytes(&self) -> u64 {
        let files = self.files.iter().flatten();
        files.map(|file| file.sink.safe_bytes()).sum()
    }

    /// Takes away what is not safe, so that each file ends with a whole line.
    pub fn abandon(self) {
        for file in self.files.into_iter().flatten() {
            file.sink.cut();
        }
    }
}

impl Channel {
    fn create(path: &Path, kind: Kind, force: bool) -> Result<Self, RecordingError> {
        let sink = Sink::create(path, force)?;
        let writer = sink.writer()?;
        let mut channel = Self {
            sink,
            writer: csv::WriterBuilder::new()
                .buffer_capacity(BUFFER_BYTES)
                .from_writer(writer),
            cells: Vec::new(),
            dirty: true,
        };
        channel.cells = ["log_time_s", "publish_time_s"].map(str::to_owned).to_vec();
        channel.cells.append(&mut columns(kind.shape()));
        channel.write_cells()?;
        Ok(channel)
    }

    fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        self.cells.clear();
        for ns in [entry.log_ns, entry.publish_ns] {
            let text = format!("{}.{:09}", ns / NS_PER_S, ns % NS_PER_S);
            self.cells.push(text);
        }
        let value = entry
            .row
            .value()
            .map_err(|error| self.failed(error.into()))?;
        cells(entry.row.kind().shape(), Some(&value), &mut self.cells);
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
        self.sink.sync()
    }

    fn failed(&self, source: io::Error) -> RecordingError {
        self.sink.failed(source)
    }
}
