//! Channels that are sampled together, and their WAV file.

use std::io;
use std::path::Path;

use hound::{SampleFormat, WavSpec, WavWriter};

use super::name;
use crate::output_file::{self, OutputFileError};

/// What samples follow each other along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Along {
    /// Time: samples per second.
    Time {
        /// In Hz.
        rate_hz: u32,
    },
    /// Place: a second of the file is a metre of the surface.
    Place {
        /// Samples in a metre.
        per_metre: u32,
        /// Where the first one lies, in mm.
        start_mm: f64,
    },
}

/// Samples, channel beside channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Of 16 bits.
    Bits16(Vec<i16>),
    /// Of 32 bits.
    Bits32(Vec<i32>),
}

/// Channels that are sampled together.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// What the file's name ends in.
    pub name: &'static str,
    /// What they are sampled along.
    pub along: Along,
    /// How many there are.
    pub channels: u16,
    /// What full scale is, in words.
    pub full_scale: String,
    /// The keys of a scene's section that read it, and that section's name; none if no scene does.
    pub keys: Option<(&'static str, String)>,
    /// Sample by sample, each of all channels.
    pub samples: Samples,
}

impl Samples {
    const fn count(&self) -> usize {
        match self {
            Self::Bits16(samples) => samples.len(),
            Self::Bits32(samples) => samples.len(),
        }
    }

    /// Bits of a sample.
    pub const fn bits(&self) -> u16 {
        match self {
            Self::Bits16(_) => 16,
            Self::Bits32(_) => 32,
        }
    }
}

impl Along {
    /// What a WAV file gives as samples per second.
    pub const fn rate(self) -> u32 {
        match self {
            Self::Time { rate_hz } => rate_hz,
            Self::Place { per_metre, .. } => per_metre,
        }
    }
}

impl Group {
    /// What is in its file, in words.
    pub fn holds(&self) -> String {
        let each = self.samples.count() / usize::from(self.channels);
        let spacing = match self.along {
            Along::Time { rate_hz } => format!("at {rate_hz} Hz"),
            Along::Place {
                per_metre,
                start_mm,
            } => format!(
                "{} mm apart from {start_mm} mm on",
                1_000.0 / f64::from(per_metre)
            ),
        };
        let channels = if self.channels == 1 {
            "channel"
        } else {
            "channels"
        };
        format!(
            "{} {channels} of {each} samples {spacing}, {} bits; {}",
            self.channels,
            self.samples.bits(),
            self.full_scale
        )
    }

    /// The lines of a scene that read its file.
    pub fn section(&self, path: &Path) -> Option<String> {
        let (section, keys) = self.keys.as_ref()?;
        Some(format!("[{section}]\n{keys}file = {}", name(path)))
    }
}

/// Writes a group's file. Fails if it can't be written.
pub fn write(path: &Path, group: &Group) -> Result<(), OutputFileError> {
    output_file::made_by(path, |path| {
        write_samples(path, group).map_err(|error| match error {
            hound::Error::IoError(source) => source,
            other => io::Error::other(other),
        })
    })
}

fn write_samples(path: &Path, group: &Group) -> hound::Result<()> {
    let mut file = WavWriter::create(
        path,
        WavSpec {
            channels: group.channels,
            sample_rate: group.along.rate(),
            bits_per_sample: group.samples.bits(),
            sample_format: SampleFormat::Int,
        },
    )?;
    match &group.samples {
        Samples::Bits16(samples) => {
            for &sample in samples {
                file.write_sample(sample)?;
            }
        }
        Samples::Bits32(samples) => {
            for &sample in samples {
                file.write_sample(sample)?;
            }
        }
    }
    file.finalize()
}
