//! Writes WAV.

use std::io;
use std::path::Path;

use hound::{SampleFormat, WavSpec, WavWriter};

use super::{Group, Samples};
use crate::output_file::OutputFileError;

/// Writes a group's file. Fails if it can't be written.
pub fn write(path: &Path, group: &Group) -> Result<(), OutputFileError> {
    write_samples(path, group).map_err(|error| {
        let source = match error {
            hound::Error::IoError(source) => source,
            other => io::Error::other(other),
        };
        OutputFileError::not_written(path, source)
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
