//! Reads a recording back, from start to end, without holding it in memory. One that was cut off is read
//! as far as it goes.
//!
//! | format | profile | messages |
//! | --- | --- | --- |
//! | 2 | `ros2` | CDR, by the file's own `ros2msg` schemas: fields that are new or gone are no matter |
//! | 1 | `ridgelink` | JSON; a row for each sample of the gauges |

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use protocol::{GAUGE_BLOCK, PROTOCOL_VERSION, Role};
use ros2msg::{DecodeError, Definition, DefinitionError, decode};

use super::mcap_file::{ABOUT, CONFIGURATION, FORMAT, LIBRARY, PROFILE};
use super::ros2;
use super::row::{CHANNELS, GaugeRow, Kind, Row, block, topic};
use super::row_builder::Entry;

/// The profile of recordings of format 1, and that format.
const OLD: (&str, &str) = ("ridgelink", "1");
const READ_BYTES: usize = 1 << 16;
/// Longer records are none of a recording: a damaged length must not ask for all memory.
const LONGEST_RECORD: usize = 1 << 26;
const NS_PER_S: f64 = 1e9;

/// Why a recording can't be read.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum ReadError {
    #[error("{0}: can't be read: {1}")]
    Unreadable(PathBuf, #[source] io::Error),
    #[error("{0}: {1}: give an MCAP file that `host-bridge record` has made")]
    Foreign(PathBuf, String),
    #[error("{0}: its format is {1}, this program reads {FORMAT}: take the program that made it")]
    Newer(PathBuf, String),
    #[error("{path}: damaged after {after}: {reason}: {advice}")]
    Damaged {
        path: PathBuf,
        after: String,
        reason: String,
        advice: String,
    },
    #[error(
        "{path}: ends at {last_s:.3} s, and is to be read from {from_s} s on: give an earlier moment"
    )]
    Ended {
        path: PathBuf,
        /// In s since the recording's start.
        last_s: f64,
        from_s: f64,
    },
    #[error("{path}: the schema of {topic}: {source}")]
    Schema {
        path: PathBuf,
        topic: String,
        source: DefinitionError,
    },
    #[error("{path}: {topic} at {at_s:.3} s: {source}")]
    Row {
        path: PathBuf,
        topic: String,
        /// Its time since the recording's start, in s.
        at_s: f64,
        source: RowError,
    },
}

/// What is wrong with a row.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum RowError {
    #[error(transparent)]
    Bytes(#[from] DecodeError),
    #[error(transparent)]
    Fields(#[from] serde_json::Error),
}

/// A recording that is being read.
pub struct Reader {
    path: PathBuf,
    /// Read as far as `reader` has needed, and no further.
    file: BufReader<File>,
    reader: LinearReader,
    schemas: BTreeMap<u16, (String, String)>,
    channels: BTreeMap<u16, Channel>,
    /// The protocol's version that the boards were to speak.
    protocol: u16,
    part: u32,
    passed_over: u64,
    /// Samples of format 1 that are no whole block yet, and the first one's time.
    samples: (u64, Vec<GaugeRow>),
    first_ns: Option<u64>,
    /// The last that was read, for error messages.
    last: Option<(String, f64)>,
    /// The time of the last samples of gauges, in s since the recording's start.
    last_gauges_s: Option<f64>,
    /// The record behind the last of what was recorded has been read.
    has_all_data: bool,
    ended: Option<Ending>,
    /// Configurations that a later part of a recording tells at its beginning.
    told: Vec<(Role, Row)>,
}

struct Channel {
    role: Role,
    kind: Kind,
    /// None if its messages are JSON.
    definition: Option<Definition>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    Whole,
    Cut,
}

impl Reader {
    /// Opens a recording. Fails if it can't be read or is none.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let unreadable = |source| ReadError::Unreadable(path.to_owned(), source);
        let file = File::open(path).map_err(unreadable)?;
        if file.metadata().map_err(unreadable)?.is_dir() {
            return Err(unreadable(io::ErrorKind::IsADirectory.into()));
        }
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            // What lies between the chunks, and their heads, has no other.
            .with_validate_data_section_crc(true)
            .with_record_length_limit(LONGEST_RECORD);
        let mut reader = Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(READ_BYTES, file),
            reader: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            protocol: 0,
            part: 1,
            passed_over: 0,
            samples: (0, Vec::with_capacity(GAUGE_BLOCK)),
            first_ns: None,
            last: None,
            last_gauges_s: None,
            has_all_data: false,
            ended: None,
            told: Vec::new(),
        };
        reader.read_head()?;
        Ok(reader)
    }

    /// Reads up to the record that tells whose it is.
    fn read_head(&mut self) -> Result<(), ReadError> {
        let foreign =
            |path: &Path, what: &str| ReadError::Foreign(path.to_owned(), what.to_owned());
        let mut format = None;
        loop {
            let record = match self.next_record() {
                Err(ReadError::Damaged { path, .. }) if format.is_none() => {
                    return Err(foreign(&path, "is no MCAP file"));
                }
                record => record?,
            };
            match record {
                None => return Err(foreign(&self.path, "ends before anything was recorded")),
                Some(Record::Header(header)) => {
                    format = Some(match header.profile.as_str() {
                        PROFILE if header.library.starts_with(LIBRARY) => FORMAT,
                        profile if profile == OLD.0 => OLD.1,
                        _ => {
                            let what = format!("was made by another program ({})", header.library);
                            return Err(foreign(&self.path, &what));
                        }
                    });
                }
                Some(Record::Metadata(metadata)) if metadata.name == ABOUT => {
                    let told = |key: &str| metadata.metadata.get(key).cloned().unwrap_or_default();
                    let told_format = told("format");
                    if format != Some(told_format.as_str()) {
                        let path = self.path.clone();
                        return Err(ReadError::Newer(path, told_format));
                    }
                    self.protocol = told("protocol").parse().unwrap_or(0);
                    self.part = told("part").parse().unwrap_or(1);
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

    /// Which part of its recording the file is, from 1 on.
    pub fn part(&self) -> u32 {
        self.part
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

    /// The next entry, in the order in which they were heard; none at the end. Fails if the file can't be read, is
    /// damaged, or holds what it should not.
    pub fn next_entry(&mut self) -> Result<Option<Entry>, ReadError> {
        loop {
            let Some(record) = self.next_record()? else {
                return Ok(None);
            };
            let Record::Message { header, data } = record else {
                continue;
            };
            let Some(channel) = self.channels.get(&header.channel_id) else {
                continue;
            };
            let (role, kind) = (channel.role, channel.kind);
            let read = channel.read(&data);
            let log_ns = header.log_time;
            self.first_ns.get_or_insert(log_ns);
            let at_s = self.since_start_s(log_ns);
            self.last = Some((topic(role, kind), at_s));
            if kind == Kind::Gauges {
                self.last_gauges_s = Some(at_s);
            }
            let (row, log_ns) = match read {
                Ok(Read::Row(row)) => (row, log_ns),
                Ok(Read::Sample(sample)) => match self.gather(sample, log_ns) {
                    Some(whole) => whole,
                    None => continue,
                },
                // What an older board said may be no word of this version any more.
                Err(RowError::Fields(_)) if self.protocol < PROTOCOL_VERSION => {
                    self.passed_over += 1;
                    continue;
                }
                Err(source) => {
                    return Err(ReadError::Row {
                        path: self.path.clone(),
                        topic: topic(role, kind),
                        at_s,
                        source,
                    });
                }
            };
            return Ok(Some(Entry { role, row, log_ns }));
        }
    }

    /// Takes a sample of format 1; the block that it completes, and the time of its first.
    fn gather(&mut self, sample: GaugeRow, log_ns: u64) -> Option<(Row, u64)> {
        let (first_ns, samples) = &mut self.samples;
        let follows = samples
            .first()
            .is_some_and(|first| first.block == sample.block);
        if !follows {
            samples.clear();
            *first_ns = log_ns;
        }
        samples.push(sample);
        if samples.len() < GAUGE_BLOCK {
            return None;
        }
        let whole = block(samples);
        samples.clear();
        Some((Row::Gauges((&whole?).into()), *first_ns))
    }

    /// Rows of an older protocol that say nothing in this version's, so far.
    pub const fn passed_over(&self) -> u64 {
        self.passed_over
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
                    let room = self.reader.insert(wanted);
                    let count = self.file.read(room).map_err(|source| {
                        let path = self.path.clone();
                        ReadError::Unreadable(path, source)
                    })?;
                    self.reader.notify_read(count);
                    continue;
                }
                // What a file system may leave at the end where it lost power; elsewhere it is damage.
                Some(Ok(LinearReadEvent::Record { opcode: 0, data })) => {
                    if data.is_empty() && self.only_zeros_follow()? {
                        Some(McapError::UnexpectedEof)
                    } else {
                        None
                    }
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    match mcap::parse_record(opcode, data).map(Record::into_owned) {
                        // What it was is missing, with all that lies behind it.
                        Ok(Record::Footer(_)) if !self.has_all_data => Some(McapError::BadFooter),
                        Ok(Record::Footer(_)) => {
                            self.ended = Some(Ending::Whole);
                            break;
                        }
                        Ok(record) => {
                            self.has_all_data |= matches!(record, Record::DataEnd(_));
                            self.note(&record)?;
                            return Ok(Some(record));
                        }
                        Err(error) => Some(error),
                    }
                }
                Some(Err(error)) => Some(error),
            };
            self.ended = Some(Ending::Cut);
            if !matches!(error, Some(McapError::UnexpectedEof)) {
                return Err(ReadError::Damaged {
                    path: self.path.clone(),
                    after: self.last.as_ref().map_or_else(
                        || "its beginning".to_owned(),
                        |(topic, at_s)| format!("{topic} at {at_s:.3} s"),
                    ),
                    advice: match error {
                        Some(McapError::BadDataCrc { .. }) => {
                            format!("some of it may be missing: {}", self.advice())
                        }
                        _ => self.advice(),
                    },
                    reason: error.map_or_else(|| "zeros, and more behind them".to_owned(), words),
                });
            }
        }
        Ok(None)
    }

    /// Whether the rest of the file, which is passed over, is nothing but zeros.
    fn only_zeros_follow(&mut self) -> Result<bool, ReadError> {
        let unreadable = |source| ReadError::Unreadable(self.path.clone(), source);
        loop {
            let bytes = self.file.fill_buf().map_err(unreadable)?;
            let length = bytes.len();
            if length == 0 {
                return Ok(true);
            }
            if bytes.iter().any(|&byte| byte != 0) {
                return Ok(false);
            }
            self.file.consume(length);
        }
    }

    /// What to do about damage: rows behind that time have been read.
    fn advice(&self) -> String {
        let last_s = self.last.as_ref().map(|&(_, at_s)| at_s);
        match self.last_gauges_s.or(last_s) {
            Some(last_s) if last_s > 0.001 => format!(
                "what lies before can be had with --to-time {:.3}",
                last_s - 0.001
            ),
            _ => "nothing that lies before can be had".to_owned(),
        }
    }

    fn note(&mut self, record: &Record<'_>) -> Result<(), ReadError> {
        match record {
            Record::Schema { header, data } if header.encoding == "ros2msg" => {
                let text = String::from_utf8_lossy(data).into_owned();
                self.schemas.insert(header.id, (header.name.clone(), text));
            }
            Record::Channel(found) => {
                let is_it = |&(role, kind): &(Role, Kind)| topic(role, kind) == found.topic;
                if let Some((role, kind)) = CHANNELS.into_iter().find(is_it) {
                    let schema = self.schemas.get(&found.schema_id);
                    let schema = schema.filter(|_| found.message_encoding == "cdr");
                    let definition = schema
                        .map(|(name, text)| Definition::parse(name, text))
                        .transpose()
                        .map_err(|source| ReadError::Schema {
                            path: self.path.clone(),
                            topic: found.topic.clone(),
                            source,
                        })?;
                    self.channels.insert(
                        found.id,
                        Channel {
                            role,
                            kind,
                            definition,
                        },
                    );
                }
            }
            Record::Metadata(metadata) => {
                let (role, kind) = match metadata.name.as_str() {
                    "sensor" => (Role::Sensor, Kind::SensorConfiguration),
                    "display" => (Role::Display, Kind::DisplayConfiguration),
                    _ => return Ok(()),
                };
                if let Some(json) = metadata.metadata.get(CONFIGURATION)
                    && let Ok(row) = serde_json::from_str(json).and_then(|json| kind.row(json))
                {
                    self.told.push((role, row));
                }
            }
            _ => {}
        }
        Ok(())
    }
}

enum Read {
    Row(Row),
    /// Of format 1, which has a message for each.
    Sample(GaugeRow),
}

impl Channel {
    fn read(&self, data: &[u8]) -> Result<Read, RowError> {
        let Some(definition) = &self.definition else {
            return Ok(match self.kind {
                Kind::Gauges => Read::Sample(serde_json::from_slice(data)?),
                kind => Read::Row(kind.row(serde_json::from_slice(data)?)?),
            });
        };
        let value = decode(definition, data)?;
        let json = ros2::inward(self.kind.shape(), value);
        Ok(Read::Row(self.kind.row(json)?))
    }
}

/// What is wrong, without the trace that the parser adds for its authors.
fn words(error: McapError) -> String {
    match error {
        McapError::Parse(error) => error.root_cause().to_string(),
        error => error.to_string(),
    }
}
