//! Makes a scene for the simulator of a recording, so that what happened on a bench becomes a test.
//!
//! The recorded samples come from behind the sensor's anti-aliasing filter, which delays them by 4 ms; the
//! sensor itself dates them, with the arm's place, 4 ms back, so that the two belong together. In the scene
//! stand voltages at the ADC's pins at that instant, such that the same filter makes the same samples of them
//! again: see [`super::pins`]. Each sample is placed so that the scene's sensor gives it the number it had,
//! up to whole estimates: the scene's estimates come at the same samples as the recorded ones.
//!
//! The hand and the arm both move as the recorded arm did: it is the arm that the gauges belong to.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use protocol::{Estimate, GAUGES};

use super::pins::Pins;
use crate::recording::reader::{ReadError, Reader};
use crate::recording::row::GaugeRow;

mod document;
mod expectation;
mod tape;

use expectation::Expectation;
use tape::Tape;

/// The longest scene, in s.
const LONGEST_S: f64 = 600.0;
/// Samples that make an estimate.
const SAMPLES_PER_ESTIMATE: u32 = 10;
/// What the sensor's filter delays a sample by, in samples.
const DELAY_SAMPLES: u32 = 4;
/// Scans for a sample.
const SCANS: usize = 4;
const SCAN_S: f64 = 250e-6;
const SCAN_US: i64 = 250;
/// A step of a recorded code is a sixteenth of a step of the ADC.
const CODES_PER_STEP: f64 = 16.0;
const STEPS: f64 = 4_096.0;
const VOLTS_PER_STEP: f64 = 3.3 / STEPS;
/// Half a count of the encoder: in the middle of a count no rounding takes it to the next.
const HALF_COUNT_MM: f64 = 0.002_5;
/// Why no scene can be made of a recording.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The recording can't be read.
    #[error(transparent)]
    Unread(#[from] ReadError),
    /// There are no samples of the gauges, or too few.
    #[error(
        "{path}: {count} samples of the gauges there: record without --no-gauges, and give --from and --to-time that leave some"
    )]
    NoSamples {
        /// The recording.
        path: PathBuf,
        /// How many there are.
        count: usize,
    },
    /// Samples are missing.
    #[error(
        "samples are missing at {at_s:.3} s, and a scene has no gaps: the longest piece without is --from {from_s:.3} --to-time {to_s:.3}"
    )]
    Gap {
        /// Where the first gap is.
        at_s: f64,
        /// Where the longest piece without begins.
        from_s: f64,
        /// Where it ends.
        to_s: f64,
    },
    /// The sensor was configured otherwise in the middle of it.
    #[error(
        "the sensor was configured anew at {at_s:.3} s, and a scene has one configuration: end before it or begin after it, with --from and --to-time"
    )]
    Reconfigured {
        /// When.
        at_s: f64,
    },
    /// It is too long.
    #[error(
        "{duration_s:.1} s are too long for a scene: give --from and --to-time, {LONGEST_S} s apart at most"
    )]
    TooLong {
        /// How long.
        duration_s: f64,
    },
    /// Nothing is known of the surface.
    #[error("no valid estimate tells what was rubbed: give its wavelength with --wavelength")]
    NoWavelength,
    /// The board was set as no scene can be.
    #[error("{setting} was {value}, which a scene can't have: give {give}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        give: &'static str,
    },
    /// A file is there already.
    #[error("{path}: is there already: give another name, or --force to write over it")]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// A file can't be written.
    #[error("{path}: can't be written: {source}")]
    NotWritten {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
}

/// What is made of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The scene's file; the CSV files stand beside it.
    pub path: PathBuf,
    /// From where on, in s since the recording's start.
    pub from_s: f64,
    /// To where; none to the end.
    pub to_s: Option<f64>,
    /// The true wavelength in mm; none: the median of the valid estimates.
    pub wavelength_mm: Option<f64>,
    /// Whether the scene expects what was recorded.
    pub expect: bool,
    /// Whether to write over files that are there.
    pub force: bool,
}

/// The scene that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Made {
    /// Its files: the scene, the gauges, the motion.
    pub files: [PathBuf; 3],
    /// Its length in s.
    pub duration_s: f64,
    /// The wavelength of its surface in mm.
    pub wavelength_mm: f64,
    /// The recorded instant of the sensor, in µs, at which it begins: an estimate of instant i is the
    /// scene's of (i − this).
    pub begin_us: i64,
    /// Recorded estimates within it that are valid, and all.
    pub estimates: (usize, usize),
    /// Whether the recording was cut off.
    pub cut: bool,
}

/// Writes the scene of a recording.
///
/// # Errors
/// If none can be made of it, or a file can't be written.
pub fn write(recording: Reader, settings: &Settings) -> Result<Made, SceneError> {
    let recording_path = recording.path().to_owned();
    let files = files(&settings.path);
    if let Some(path) = files.iter().find(|path| path.exists() && !settings.force) {
        return Err(SceneError::Exists { path: path.clone() });
    }
    let tape = Tape::take(
        recording,
        settings.from_s,
        settings.to_s.unwrap_or(f64::INFINITY),
    )?;
    let count = tape.samples.len();
    let layout = Layout::of(&tape.samples).ok_or(SceneError::NoSamples {
        path: recording_path,
        count,
    })?;
    if layout.duration_s > LONGEST_S {
        return Err(SceneError::TooLong {
            duration_s: layout.duration_s,
        });
    }
    let within: Vec<Estimate> = tape
        .estimates
        .iter()
        .filter(|estimate| layout.holds(estimate.instant_us))
        .copied()
        .collect();
    let valid: Vec<f64> = within.iter().filter_map(valid_mm).collect();
    let wavelength_mm = settings
        .wavelength_mm
        .or_else(|| median(&valid))
        .ok_or(SceneError::NoWavelength)?;
    let expected = settings
        .expect
        .then(|| Expectation::of(&within, layout.duration_s))
        .flatten();
    let toml = document::toml(
        &files,
        &tape,
        layout.duration_s,
        wavelength_mm,
        expected.as_ref(),
    )?;
    let has_force = tape.sensor.is_some_and(|sensor| sensor.force_channel);
    let [scene, gauges, motion] = &files;
    save(gauges, |out| {
        write_gauges(out, &tape.samples, &layout, has_force)
    })?;
    save(motion, |out| write_motion(out, &tape.samples, &layout))?;
    save(scene, |out| out.write_all(toml.as_bytes()))?;
    Ok(Made {
        files,
        duration_s: layout.duration_s,
        wavelength_mm,
        begin_us: layout.begin_us,
        estimates: (valid.len(), within.len()),
        cut: tape.cut,
    })
}

/// The scene's file and the CSV files beside it.
fn files(scene: &Path) -> [PathBuf; 3] {
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
    [
        scene.to_owned(),
        scene.with_file_name(format!("{stem}-gauges.csv")),
        scene.with_file_name(format!("{stem}-motion.csv")),
    ]
}

fn save(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), SceneError> {
    let mut out =
        io::BufWriter::new(fs::File::create(path).map_err(|source| not_written(path, source))?);
    write(&mut out)
        .and_then(|()| out.flush())
        .map_err(|source| not_written(path, source))
}

fn not_written(path: &Path, source: io::Error) -> SceneError {
    SceneError::NotWritten {
        path: path.to_owned(),
        source,
    }
}

fn valid_mm(estimate: &Estimate) -> Option<f64> {
    estimate
        .wavelength_mm
        .filter(|_| estimate.valid)
        .map(f64::from)
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Where the samples lie in the scene.
///
/// The board's sample n comes out of its filter at an instant S(n) and belongs to S(n) − 4 ms; an estimate is
/// made with every tenth, at S(n). The scene's sensor reads its sample n at (n + ¾) ms. So that its sample n
/// is the recorded b + n, b a multiple of ten, the recorded sample b + 3 has to lie at −¼ ms, one scan before
/// the scene's start.
struct Layout {
    /// The index among the samples of the one that lies at −¼ ms.
    first: usize,
    duration_s: f64,
    /// The instant of the sensor's clock at the scene's start.
    begin_us: i64,
}

impl Layout {
    /// None if there are too few samples.
    fn of(samples: &[GaugeRow]) -> Option<Self> {
        let start = samples.first()?;
        let begin = start
            .sample
            .saturating_sub(DELAY_SAMPLES - 1)
            .next_multiple_of(SAMPLES_PER_ESTIMATE);
        let first = (begin + DELAY_SAMPLES - 1).checked_sub(start.sample)? as usize;
        let before = samples.get(first)?;
        // A whole number of estimates, so that nothing is cut in the middle.
        let estimates = (samples.len() - 1 - first) / SAMPLES_PER_ESTIMATE as usize;
        (estimates > 0).then_some(Self {
            first,
            duration_s: estimates as f64 / 100.0,
            begin_us: before.instant_us.cast_signed() + SCAN_US,
        })
    }

    /// An instant of the sensor's clock in s since the scene's start.
    fn scene_s(&self, instant_us: u64) -> f64 {
        (instant_us.cast_signed() - self.begin_us) as f64 * 1e-6
    }

    /// Whether an instant of the sensor's clock lies within the scene.
    fn holds(&self, instant_us: u64) -> bool {
        (0.0..=self.duration_s).contains(&self.scene_s(instant_us))
    }

    /// When, in s since the scene's start, the scan comes that lies so many scans after the sample of an
    /// index.
    fn scan_s(&self, index: usize, scan: usize) -> f64 {
        let scans = SCANS as i64 * (index as i64 - self.first as i64) + scan as i64 - 1;
        scans as f64 * SCAN_S
    }
}

/// Volts at the ADC's pins, four rows for a sample, from the last sample before the scene's start on.
fn write_gauges(
    out: &mut dyn Write,
    samples: &[GaugeRow],
    layout: &Layout,
    has_force: bool,
) -> io::Result<()> {
    let force = if has_force { ",tangential" } else { "" };
    writeln!(out, "t_s,g0,g1,g2,g3,g4{force}")?;
    let channels = GAUGES + usize::from(has_force);
    let pins = Pins::default();
    let scans: Vec<Vec<f64>> = (0..channels)
        .map(|channel| {
            let steps = |row: &GaugeRow| f64::from(row.codes()[channel]) / CODES_PER_STEP;
            let steps: Vec<f64> = samples.iter().map(steps).collect();
            pins.scans(&steps, channel as u64)
        })
        .collect();
    for index in layout.first..samples.len() {
        let last = index + 1 == samples.len();
        for scan in 0..if last { 1 } else { SCANS } {
            write!(out, "{:.5}", layout.scan_s(index, scan))?;
            for scans in &scans {
                // The ADC rounds down: half a step more, so that what comes out is rounded to the nearest.
                let steps = (scans[index * SCANS + scan] + 0.5).clamp(0.0, STEPS);
                write!(out, ",{:.5}", steps * VOLTS_PER_STEP)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

/// Where the arm was, a row for a sample.
fn write_motion(out: &mut dyn Write, samples: &[GaugeRow], layout: &Layout) -> io::Result<()> {
    writeln!(out, "t_s,x_mm")?;
    let start_um = samples[layout.first].position_um;
    for (index, sample) in samples.iter().enumerate().skip(layout.first) {
        let x_mm = (sample.position_um - start_um) as f64 / 1_000.0 + HALF_COUNT_MM;
        writeln!(out, "{:.5},{x_mm:.4}", layout.scan_s(index, 0))?;
    }
    Ok(())
}
