//! Reads a recording back, from start to end, without holding it in memory. One that was cut off is read
//! as far as it goes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use protocol::Role;

use super::files::CONFIGURATION;
use super::mcap_file::{ABOUT, FORMAT, PROFILE};
use super::row::{CHANNELS, Kind, Row, topic};
use super::row_builder::Entry;

/// Read at a time.
const READ_BYTES: usize = 1 << 16;
/// Longer records are none of a recording: a damaged length must not ask for all memory.
const LONGEST_RECORD: usize = 1 << 26;
const NS_PER_S: f64 = 1e9;

/// Why a recording can't be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file can't be read at all.
    #[error("{path}: can't be read: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The file is no MCAP, or another program's.
    #[error("{path}: {what}: give an MCAP file that `host-bridge record` has made")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        what: String,
    },
    /// The file is of a later version of this program.
    #[error(
        "{path}: its format is {format}, this program reads {FORMAT}: take the program that made it"
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: String,
    },
    /// The file is damaged.
    #[error("{path}: damaged after {after}: {source}")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The last that could be read: its channel and its time.
        after: String,
        /// What is wrong.
        source: McapError,
    },
    /// What is on a channel does not belong there.
    #[error("{path}: {topic} at {at_s:.3} s: {source}")]
    Row {
        /// The file.
        path: PathBuf,
        /// The channel.
        topic: String,
        /// Its time since the recording's start, in s.
        at_s: f64,
        /// What is wrong.
        source: serde_json::Error,
    },
}

/// A recording that is being read.
pub struct Reader {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    channels: BTreeMap<u16, (Role, Kind)>,
    first_ns: Option<u64>,
    /// The last that was read, for error messages.
    last: Option<(String, f64)>,
    ended: Option<Ending>,
    /// Configurations that a later part of a recording tells at its beginning.
    told: Vec<(Role, Row)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    Whole,
    Cut,
}

impl Reader {
    /// Opens a recording.
    ///
    /// # Errors
    /// If it can't be read or is none.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let unreadable = |source| ReadError::Unreadable {
            path: path.to_owned(),
            source,
        };
        let file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.is_dir() {
            return Err(unreadable(io::ErrorKind::IsADirectory.into()));
        }
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(LONGEST_RECORD);
        let mut reader = Self {
            path: path.to_owned(),
            file,
            reader: LinearReader::new_with_options(options),
            channels: BTreeMap::new(),
            first_ns: None,
            last: None,
            ended: None,
            told: Vec::new(),
        };
        reader.read_head()?;
        Ok(reader)
    }

    /// Reads up to the record that tells whose it is.
    fn read_head(&mut self) -> Result<(), ReadError> {
        let foreign = |path: &Path, what: &str| ReadError::Foreign {
            path: path.to_owned(),
            what: what.to_owned(),
        };
        let mut profile = None;
        loop {
            let record = match self.next_record() {
                Err(ReadError::Damaged { path, .. }) if profile.is_none() => {
                    return Err(foreign(&path, "is no MCAP file"));
                }
                record => record?,
            };
            match record {
                None => return Err(foreign(&self.path, "ends before anything was recorded")),
                Some(Record::Header(header)) if header.profile != PROFILE => {
                    let what = format!("was made by another program ({})", header.library);
                    return Err(foreign(&self.path, &what));
                }
                Some(Record::Header(header)) => profile = Some(header.profile),
                Some(Record::Metadata(metadata)) if metadata.name == ABOUT => {
                    let format = metadata.metadata.get("format").cloned().unwrap_or_default();
                    if format != FORMAT {
                        let path = self.path.clone();
                        return Err(ReadError::Newer { path, format });
                    }
                    return Ok(());
                }
                Some(_) => {}
            }
        }
    }

    /// The file's name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the end was reached, and is not the end that a recording has: it was cut off.
    pub fn is_cut(&self) -> bool {
        self.ended == Some(Ending::Cut)
    }

    /// A time of an entry in s since the recording's first; 0 for samples that were taken some ms before it.
    pub fn since_start_s(&self, log_ns: u64) -> f64 {
        let first_ns = self.first_ns.unwrap_or(log_ns);
        log_ns.saturating_sub(first_ns) as f64 / NS_PER_S
    }

    /// The next entry, in the order in which they were heard; none at the end.
    ///
    /// # Errors
    /// If the file can't be read, is damaged, or holds what it should not.
    pub fn next_entry(&mut self) -> Result<Option<Entry>, ReadError> {
        loop {
            let Some(record) = self.next_record()? else {
                return Ok(None);
            };
            let Record::Message { header, data } = record else {
                continue;
            };
            let Some(&(role, kind)) = self.channels.get(&header.channel_id) else {
                continue;
            };
            self.first_ns.get_or_insert(header.log_time);
            let at_s = self.since_start_s(header.log_time);
            let row = kind.read(&data).map_err(|source| ReadError::Row {
                path: self.path.clone(),
                topic: topic(role, kind),
                at_s,
                source,
            })?;
            self.last = Some((topic(role, kind), at_s));
            return Ok(Some(Entry {
                role,
                row,
                log_ns: header.log_time,
                publish_ns: header.publish_time,
            }));
        }
    }

    /// The configurations that the file told so far of boards that reported them in an earlier part.
    pub fn take_told(&mut self) -> Vec<(Role, Row)> {
        std::mem::take(&mut self.told)
    }

    fn next_record(&mut self) -> Result<Option<Record<'static>>, ReadError> {
        while self.ended.is_none() {
            let error = match self.reader.next_event() {
                None => {
                    self.ended = Some(Ending::Cut);
                    break;
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                    let room = self.reader.insert(wanted.max(READ_BYTES));
                    let count = self.file.read(room).map_err(|source| {
                        let path = self.path.clone();
                        ReadError::Unreadable { path, source }
                    })?;
                    self.reader.notify_read(count);
                    continue;
                }
                // What a file system may leave where it lost power.
                Some(Ok(LinearReadEvent::Record { opcode: 0, .. })) => McapError::UnexpectedEof,
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    match mcap::parse_record(opcode, data).map(Record::into_owned) {
                        Ok(Record::Footer(_)) => {
                            self.ended = Some(Ending::Whole);
                            break;
                        }
                        Ok(record) => {
                            self.note(&record);
                            return Ok(Some(record));
                        }
                        Err(error) => error,
                    }
                }
                Some(Err(error)) => error,
            };
            self.ended = Some(Ending::Cut);
            if !matches!(error, McapError::UnexpectedEof) {
                return Err(ReadError::Damaged {
                    path: self.path.clone(),
                    after: self.last.as_ref().map_or_else(
                        || "its beginning".to_owned(),
                        |(topic, at_s)| format!("{topic} at {at_s:.3} s"),
                    ),
                    source: error,
                });
            }
        }
        Ok(None)
    }

    fn note(&mut self, record: &Record<'_>) {
        match record {
            Record::Channel(found) => {
                let known = CHANNELS
                    .into_iter()
                    .find(|&(role, kind)| topic(role, kind) == found.topic);
                self.channels
                    .extend(known.map(|channel| (found.id, channel)));
            }
            Record::Metadata(metadata) => {
                let configurations = [
                    (Role::Sensor, Kind::SensorConfiguration),
                    (Role::Display, Kind::DisplayConfiguration),
                ];
                let told = configurations
                    .into_iter()
                    .find(|(role, _)| role.name() == metadata.name);
                if let (Some((role, kind)), Some(json)) =
                    (told, metadata.metadata.get(CONFIGURATION))
                    && let Ok(row) = kind.read(json.as_bytes())
                {
                    self.told.push((role, row));
                }
            }
            _ => {}
        }
    }
}
