//! One MCAP file that is being written.
//!
//! It is only ever appended to, chunk by chunk, so that whatever cuts it off leaves whole chunks behind.
//! The writer keeps some 600 bytes of index a chunk until the end, which is why a long recording goes on
//! in a new file from time to time: see [`super::Settings::part`].
//!
//! It is written as ROS 2 writes its own: the profile `ros2`, schemas in `ros2msg`, messages in CDR.

use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::ros2::CdrEncoder;
use super::row_builder::Entry;
use super::sink::{Sink, SinkWriter};
use crate::recording::RecordingError;

/// What stands in the file's header: it can be read as a recording of ROS 2.
pub const PROFILE: &str = "ros2";
/// What stands in the file's header before this program's version.
pub const LIBRARY: &str = "host-bridge ";
/// The metadata record that tells of the recording as a whole.
pub const ABOUT: &str = "ridgelink";
/// The key of a board's configuration, as JSON, in what a later part tells of it.
pub const CONFIGURATION: &str = "configuration";
/// The version of the rows: raised when one changes so that older programs can't read it.
pub const FORMAT: &str = "2";
/// Before it is compressed: more than a second of everything, so that what closes a chunk is the time.
const CHUNK_BYTES: u64 = 1 << 20;
/// zstd's.
const COMPRESSION_LEVEL: u32 = 6;
/// The other keys of a channel in a recording of ROS 2.
const QOS: (&str, &str) = ("offered_qos_profiles", "");

/// A file that is being written.
pub struct McapFile {
    sink: Sink,
    writer: Writer<BufWriter<SinkWriter>>,
    encoder: CdrEncoder,
    /// The channels' numbers in the file.
    ids: Vec<u16>,
    cdr: Vec<u8>,
    dirty: bool,
}

fn reason(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(error),
    }
}

impl McapFile {
    /// Makes a file, with all schemas and channels in it; `force` takes the place of one that is there, at
    /// [`McapFile::keep`]. Fails if there is one already, or it can't be made or written; then none is made.
    pub fn create(
        path: &Path,
        force: bool,
        about: BTreeMap<String, String>,
    ) -> Result<Self, RecordingError> {
        let sink = Sink::create(path, force)?;
        Self::begin(sink, about)
    }

    /// What was made goes with the sink if this fails.
    fn begin(sink: Sink, about: BTreeMap<String, String>) -> Result<Self, RecordingError> {
        let encoder = CdrEncoder::new().map_err(|error| sink.failed(io::Error::other(error)))?;
        let writer = BufWriter::new(sink.writer()?);
        let writer = WriteOptions::new()
            .profile(PROFILE)
            .library(format!("{LIBRARY}{}", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(COMPRESSION_LEVEL)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            // Chunks are made in memory: nothing that is in the file is ever touched again.
            .disable_seeking(true)
            .create(writer)
            .map_err(|error| sink.failed(reason(error)))?;
        let mut mcap = Self {
            sink,
            writer,
            encoder,
            ids: Vec::new(),
            cdr: Vec::new(),
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
        let keys = BTreeMap::from([(QOS.0.to_owned(), QOS.1.to_owned())]);
        for channel in self.encoder.channels() {
            let text = channel.schema.as_bytes();
            let schema = self
                .writer
                .add_schema(&channel.schema_name, "ros2msg", text)?;
            let id = self
                .writer
                .add_channel(schema, &channel.topic, "cdr", &keys)?;
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

    /// Writes a record of facts. Fails if the file does not take it.
    pub fn tell(
        &mut self,
        name: &str,
        facts: BTreeMap<String, String>,
    ) -> Result<(), RecordingError> {
        self.dirty = true;
        self.add_metadata(name, facts)
            .map_err(|error| self.failed(reason(error)))
    }

    /// Writes an entry. It is safe after the next [`McapFile::sync`]. Fails if the file does not take it.
    pub fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        self.cdr.clear();
        let encoded = self.encoder.encode(entry, &mut self.cdr);
        let Some(at) = encoded.map_err(|error| self.failed(io::Error::other(error)))? else {
            return Ok(());
        };
        self.dirty = true;
        let header = MessageHeader {
            channel_id: self.ids[at],
            // None: messages that can be lost carry their own, and this one would take 6 % of the file.
            sequence: 0,
            log_time: entry.log_ns,
            publish_time: entry.log_ns,
        };
        self.writer
            .write_to_known_channel(&header, &self.cdr)
            .map_err(|error| self.failed(reason(error)))
    }

    /// Closes the chunk and makes everything written so far safe. Fails if the file does not take it, or was
    /// removed.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        if std::mem::take(&mut self.dirty) {
            self.writer
                .flush()
                .map_err(|error| self.failed(reason(error)))?;
        }
        self.sink.sync()
    }

    /// The file stays, and stands in the place of the one that was there; until then dropping it takes it away.
    /// Fails if it can't get that place.
    pub fn keep(&mut self) -> Result<(), RecordingError> {
        self.sink.keep()
    }

    pub const fn safe_bytes(&self) -> u64 {
        self.sink.safe_bytes()
    }

    /// Ends the file as it should end, with index and summary, and makes it safe. Returns its length. Fails if the
    /// file does not take it. What was safe before is.
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

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use protocol::{
        CHANNELS, Contact, Estimate, GAUGE_BLOCK, GaugeHealth, GaugeSample, Gauges, Message,
        Motion, Range, Role,
    };

    use super::super::row_builder::{Note, RowBuilder};
    use super::*;
    use crate::clock::unix_ns;
    use crate::link::Event;

    const MINUTE_US: u64 = 60_000_000;
    /// Of the gauges' noise, in sixteenths.
    const ADC_STEP: f64 = 16.0;

    /// Numbers as noise has them, the same each time: a generator of Lehmer's, twelve draws a number.
    struct Noise(u64);

    impl Noise {
        fn of(&mut self, deviation: f64) -> f64 {
            let sum: f64 = (0..12)
                .map(|_| {
                    self.0 = self.0 * 48_271 % 0x7fff_ffff;
                    self.0 as f64 / f64::from(0x7fff_ffff_u32)
                })
                .sum();
            (sum - 6.0) * deviation
        }
    }

    /// What both boards say at `at_us` of a minute of rubbing: 50 mm/s at 0.5 Hz over 2 mm.
    fn said(at_us: u64, noise: &mut Noise) -> Vec<(Role, Message)> {
        let place_um = |us: u64| 16_000.0 * (TAU * 0.5 * us as f64 / 1e6).sin();
        let speed_um_s = TAU * 0.5 * 16_000.0 * (TAU * 0.5 * at_us as f64 / 1e6).cos();
        let mut said = Vec::new();
        if at_us.is_multiple_of(2_000) {
            let motion = Motion {
                sequence: (at_us / 2_000) as u32,
                instant_us: 7_000_000 + at_us,
                // The encoder's steps.
                position_um: (place_um(at_us) / 5.0) as i64 * 5,
                velocity_um_s: (speed_um_s + noise.of(300.0)) as i32,
            };
            said.push((Role::Display, Message::Motion(motion)));
        }
        if at_us.is_multiple_of(8_000) {
            let samples = std::array::from_fn(|sample| {
                let us = at_us + sample as u64 * 1_000;
                let codes = std::array::from_fn::<_, CHANNELS, _>(|gauge| {
                    let turn = TAU * (place_um(us) / 2_000.0 + gauge as f64 / 5.0);
                    (32_768.0 + 3_000.0 * turn.sin() + noise.of(ADC_STEP)) as u16
                });
                GaugeSample {
                    codes,
                    travel_um: (place_um(us) - place_um(us.saturating_sub(1_000))) as i16,
                }
            });
            let gauges = Gauges {
                first_sample: (at_us / 8_000) as u32 * GAUGE_BLOCK as u32,
                instant_us: 9_000_000 + at_us,
                position_um: place_um(at_us) as i64,
                samples,
            };
            said.push((Role::Sensor, Message::Gauges(gauges)));
        }
        if at_us.is_multiple_of(10_000) {
            let estimate = Estimate {
                sequence: (at_us / 10_000) as u32,
                instant_us: 9_000_000 + at_us,
                wavelength_mm: Some(2.0 + noise.of(0.01) as f32),
                confidence: 0.9 + noise.of(0.02) as f32,
                valid: true,
                range: Range::T1,
                contact: Contact::Slip,
                counted_mm: Some(2.0 + noise.of(0.1) as f32),
                amplitude_lsb: 90.0 + noise.of(5.0) as f32,
                velocity_um_s: speed_um_s as i32,
                lag_um: Some(noise.of(50.0) as i32),
                gauges_used: 0b1_1111,
                health: [GaugeHealth::Good; 5],
            };
            said.push((Role::Sensor, Message::Estimate(estimate)));
        }
        said
    }

    #[test]
    fn an_hour_of_everything_is_no_larger_than_it_was() {
        // Not kept: it goes with its end.
        let path = std::env::temp_dir().join(format!("minute-{}.mcap", std::process::id()));
        let made = McapFile::create(&path, true, BTreeMap::new());
        let mut file = made.unwrap_or_else(|error| panic!("{error}"));
        let once = file.safe_bytes();
        let mut rows = RowBuilder::default();
        let mut noise = Noise(1);
        // How a minute packs depends on the bytes of its times, by some 2 %: so always the same moment after one whose
        // lower 40 bits are 0, which is a whole number of µs as well.
        let moment_ns = unix_ns(0).next_multiple_of(125 << 40) + 345_678_000;
        let start_us = (moment_ns - unix_ns(0)) / 1_000;
        for at_us in (0..MINUTE_US).step_by(1_000) {
            for (role, message) in said(at_us, &mut noise) {
                let at_us = start_us + at_us;
                let note = Note::Event(Event::Heard { at_us, message });
                for entry in rows.enter(role, at_us, &note) {
                    file.write(&entry).unwrap_or_else(|error| panic!("{error}"));
                }
            }
            // As often as a recording makes safe what it has.
            if at_us % 1_000_000 == 999_000 {
                file.sync().unwrap_or_else(|error| panic!("{error}"));
            }
        }
        assert_eq!(rows.tally().messages, 60 * (500 + 125 + 100));
        let bytes = file.finish().unwrap_or_else(|error| panic!("{error}"));
        let hour_mb = (bytes - once) as f64 * 60.0 / 1e6;
        println!("{hour_mb:.1} MB an hour");
        assert!(
            (100.0..=136.0).contains(&hour_mb),
            "{hour_mb:.1} MB an hour"
        );
    }
}
