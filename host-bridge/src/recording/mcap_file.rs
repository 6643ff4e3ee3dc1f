//! One MCAP file that is being written.
//!
//! It is only ever appended to, chunk by chunk, so that whatever cuts it off leaves whole chunks behind.
//! The writer keeps some 600 bytes of index a chunk until the end, which is why a long recording goes on
//! in a new file from time to time: see [`super::Settings::part`].

use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::error::RecordingError;
use super::json_schema::JsonSchema;
use super::row::{CHANNELS, channel, topic};
use super::row_builder::Entry;
use super::sink::{Sink, SinkWriter};

/// What stands in the file's header, for programs that want to know whom it is of.
pub const PROFILE: &str = "ridgelink";
/// The metadata record that tells of the recording as a whole.
pub const ABOUT: &str = "ridgelink";
/// The version of the rows: raised when one changes so that older programs can't read it.
pub const FORMAT: &str = "1";
/// Before it is compressed. A second of everything is a quarter of it.
const CHUNK_BYTES: u64 = 1 << 20;

/// A file that is being written.
pub struct McapFile {
    sink: Sink,
    writer: Writer<BufWriter<SinkWriter>>,
    ids: Vec<u16>,
    sequences: [u32; CHANNELS.len()],
    json: Vec<u8>,
    dirty: bool,
}

fn reason(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

impl McapFile {
    /// Makes a file, with all schemas and channels in it; `force` writes over one that is there.
    ///
    /// # Errors
    /// If there is one already, or it can't be made or written.
    pub fn create(
        path: &Path,
        force: bool,
        about: BTreeMap<String, String>,
    ) -> Result<Self, RecordingError> {
        let sink = Sink::create(path, force)?;
        let writer = BufWriter::new(sink.writer()?);
        let writer = WriteOptions::new()
            .profile(PROFILE)
            .library(concat!("host-bridge ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            // Chunks are made in memory: nothing that is in the file is ever touched again.
            .disable_seeking(true)
            .create(writer)
            .map_err(|error| sink.failed(reason(error)))?;
        let mut mcap = Self {
            sink,
            writer,
            ids: Vec::with_capacity(CHANNELS.len()),
            sequences: [0; CHANNELS.len()],
            json: Vec::new(),
            dirty: true,
        };
        // First of all whose it is.
        mcap.add_metadata(ABOUT, about)
            .and_then(|()| mcap.add_channels())
            .map_err(|error| mcap.failed(reason(error)))?;
        mcap.sync()?;
        Ok(mcap)
    }

    fn add_channels(&mut self) -> Result<(), McapError> {
        for (role, kind) in CHANNELS {
            let shape = kind.shape();
            let schema = serde_json::to_vec(&JsonSchema(shape)).map_err(io::Error::from)?;
            let name = shape.name.strip_suffix("Row").unwrap_or(shape.name);
            let schema =
                self.writer
                    .add_schema(&format!("ridgelink.{name}"), "jsonschema", &schema)?;
            let id =
                self.writer
                    .add_channel(schema, &topic(role, kind), "json", &BTreeMap::new())?;
            self.ids.push(id);
        }
        Ok(())
    }

    fn add_metadata(
        &mut self,
        name: &str,
        metadata: BTreeMap<String, String>,
    ) -> Result<(), McapError> {
        self.writer.write_metadata(&Metadata {
            name: name.to_owned(),
            metadata,
        })
    }

    /// Writes a record of facts.
    ///
    /// # Errors
    /// If the file does not take it.
    pub fn tell(
        &mut self,
        name: &str,
        facts: BTreeMap<String, String>,
    ) -> Result<(), RecordingError> {
        self.dirty = true;
        self.add_metadata(name, facts)
            .map_err(|error| self.failed(reason(error)))
    }

    /// Writes an entry. It is safe after the next [`McapFile::sync`].
    ///
    /// # Errors
    /// If the file does not take it.
    pub fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        let Some(at) = channel(entry.role, entry.row.kind()) else {
            return Ok(());
        };
        self.dirty = true;
        self.json.clear();
        let header = MessageHeader {
            channel_id: self.ids[at],
            sequence: self.sequences[at],
            log_time: entry.log_ns,
            publish_time: entry.publish_ns,
        };
        self.sequences[at] = self.sequences[at].wrapping_add(1);
        entry
            .row
            .write(&mut self.json)
            .map_err(|error| self.failed(error.into()))?;
        self.writer
            .write_to_known_channel(&header, &self.json)
            .map_err(|error| self.failed(reason(error)))
    }

    /// Closes the chunk and makes everything written so far safe.
    ///
    /// # Errors
    /// If the file does not take it, or was removed.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        if std::mem::take(&mut self.dirty) {
            self.writer
                .flush()
                .map_err(|error| self.failed(reason(error)))?;
        }
        self.sink.sync()
    }

    /// Bytes that are safe.
    pub const fn safe_bytes(&self) -> u64 {
        self.sink.safe_bytes()
    }

    /// Ends the file as it should end, with index and summary, and makes it safe. Returns its length.
    ///
    /// # Errors
    /// If the file does not take it. What was safe before is.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        self.sync()?;
        let ended = self.writer.finish().map_err(reason);
        let mut writer = self.writer.into_inner();
        ended
            .and_then(|_| writer.flush())
            .map_err(|source| self.sink.failed(source))
            .and_then(|()| self.sink.sync())
            .inspect_err(|_| self.sink.cut())
            .map(|()| self.sink.safe_bytes())
    }

    /// Takes away what is not safe, so that the file ends with a whole chunk.
    pub fn abandon(self) {
        self.sink.cut();
        drop(self.writer.into_inner());
    }

    fn failed(&self, source: io::Error) -> RecordingError {
        self.sink.failed(source)
    }
}
