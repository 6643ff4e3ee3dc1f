//! Reads WAV: samples of any width, integers as a share of full scale.

use std::fs::File;
use std::io::{self, BufReader, Chain, Cursor, Read};
use std::path::Path;

use hound::{SampleFormat, WavReader};

use super::tape::Refusal;
use crate::scene::SceneError;

/// A WAV file, its head read.
pub struct Wav {
    path: String,
    reader: WavReader<Chunks>,
}

/// A head with nothing but the format, and the file from its samples on.
type Chunks = Chain<Cursor<Vec<u8>>, BufReader<File>>;

impl Wav {
    /// Opens a file.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let path_text = path.display().to_string();
        match chunks(path).and_then(WavReader::new) {
            Ok(reader) if reader.spec().sample_rate == 0 => Err(SceneError::of(
                path_text,
                "",
                "its head says 0 samples a second: give a file that says its rate",
            )),
            Ok(reader) => Ok(Self {
                path: path_text,
                reader,
            }),
            Err(error) => Err(SceneError::of(path_text, "", broken(&error))),
        }
    }

    /// Channels.
    pub fn channels(&self) -> usize {
        self.reader.spec().channels.into()
    }

    /// Samples per second and channel.
    pub fn rate_hz(&self) -> f64 {
        self.reader.spec().sample_rate.into()
    }

    /// Hands `channels` of each sample, with its time in s, to `take`.
    pub fn each(
        mut self,
        channels: &[usize],
        mut take: impl FnMut(f64, &[f64]) -> Result<(), Refusal>,
    ) -> Result<(), SceneError> {
        let spec = self.reader.spec();
        let rate_hz = self.rate_hz();
        let full = 2f64.powi(i32::from(spec.bits_per_sample) - 1);
        let mut frame = Vec::with_capacity(self.channels());
        let mut row = vec![0.0; channels.len()];
        let mut frames: u64 = 0;
        let path = self.path;
        let place = |frames: u64| format!("sample {frames} ({:.6} s)", frames as f64 / rate_hz);
        let mut each = |sample: hound::Result<f64>| {
            let sample =
                sample.map_err(|error| SceneError::of(&path, place(frames), broken(&error)))?;
            if !sample.is_finite() {
                let key = format!("{}, channel {}", place(frames), frame.len());
                let message = format!("{sample} is not finite: mend the recording");
                return Err(SceneError::of(&path, key, message));
            }
            frame.push(sample);
            if frame.len() < usize::from(spec.channels) {
                return Ok(());
            }
            for (number, &channel) in row.iter_mut().zip(channels) {
                *number = frame[channel];
            }
            take(frames as f64 / rate_hz, &row).map_err(|(column, message)| {
                let (key, value) = match column.checked_sub(1) {
                    None => (place(frames), frames as f64 / rate_hz),
                    Some(column) => (
                        format!("{}, channel {}", place(frames), channels[column]),
                        row[column],
                    ),
                };
                SceneError::of(&path, key, format!("{value} {message}"))
            })?;
            frame.clear();
            frames += 1;
            Ok(())
        };
        match spec.sample_format {
            SampleFormat::Float => self
                .reader
                .samples::<f32>()
                .try_for_each(|sample| each(sample.map(f64::from))),
            SampleFormat::Int => self
                .reader
                .samples::<i32>()
                .try_for_each(|sample| each(sample.map(|sample| f64::from(sample) / full))),
        }
    }
}

/// What else a file holds before its samples is passed over here: a chunk of odd length has a byte behind it that hound
/// would take for the beginning of the next one.
fn chunks(path: &Path) -> hound::Result<Chunks> {
    let mut file = BufReader::new(File::open(path)?);
    let mut head = vec![0; 12];
    file.read_exact(&mut head)?;
    loop {
        let mut chunk = [0; 8];
        file.read_exact(&mut chunk)?;
        let [name @ .., a, b, c, d] = chunk;
        if name == *b"data" {
            head.extend(chunk);
            return Ok(Cursor::new(head).chain(file));
        }
        let length = u64::from(u32::from_le_bytes([a, b, c, d]));
        let mut content = file.by_ref().take(length + length % 2);
        if name == *b"fmt " {
            head.extend(chunk);
            content.read_to_end(&mut head)?;
        } else {
            io::copy(&mut content, &mut io::sink())?;
        }
    }
}

fn broken(error: &hound::Error) -> String {
    format!(
        "cannot be read as WAV: {error}: give PCM of 8 to 32 bits or floats of 32 bits, and the whole file"
    )
}
