//! Makes a scene for the simulator of a recording, so that what happened on a bench becomes a test.
//!
//! The scene names the recording and the piece of it; the simulator reads the samples itself. They come from
//! behind the sensor's anti-aliasing filter, which delays them by 4 ms; the sensor itself dates them, with the
//! arm's place, 4 ms back, so that the two belong together. The simulator finds voltages at the ADC's pins of
//! which the same filter makes the same samples again. Each sample is placed so that the scene's sensor gives it the number it had,
//! up to whole estimates: the scene's estimates come at the same samples as the recorded ones.
//!
//! The hand and the arm both move as the recorded arm did: it is the arm that the gauges belong to.

use std::path::{Path, PathBuf};

use protocol::Estimate;

use crate::output_file::{self, OutputFileError};
use crate::recording::reader::{ReadError, Reader};
use crate::recording::row::GaugeRow;

mod document;
pub(crate) mod excerpt;

use document::Expectation;
use excerpt::Excerpt;

/// The longest scene, in s.
const LONGEST_S: f64 = 600.0;
const SAMPLES_PER_ESTIMATE: u32 = 10;
/// What the sensor's filter delays a sample by, in samples.
const DELAY_SAMPLES: u32 = 4;
const SCAN_US: i64 = 250;
/// Half a count of the encoder: in the middle of a count no rounding takes it to the next.
const HALF_COUNT_MM: f64 = 0.002_5;
/// Why no scene can be made of a recording.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum SceneError {
    #[error(transparent)]
    Unread(#[from] ReadError),
    #[error(
        "{path}: {count} samples of the gauges there: record without --no-gauges, and give --from and --to-time that leave some"
    )]
    NoSamples { path: PathBuf, count: usize },
    #[error(
        "{path}: samples are missing at {at_s:.3} s, and what is made of them has no gaps: the longest piece without is --from {from_s:.3} --to-time {to_s:.3}"
    )]
    Gap {
        path: PathBuf,
        at_s: f64,
        from_s: f64,
        to_s: f64,
    },
    #[error(
        "{path}: the sensor was configured anew at {at_s:.3} s, and what is made of it has one configuration: end before it or begin after it, with --from and --to-time"
    )]
    Reconfigured { path: PathBuf, at_s: f64 },
    #[error("{path}: that is too long: give --from and --to-time, {LONGEST_S} s apart at most")]
    TooLong { path: PathBuf },
    #[error(
        "{path}: no valid estimate tells what was rubbed: give its wavelength with --wavelength"
    )]
    NoWavelength { path: PathBuf },
    #[error("{path}: {setting} was {value}, which a scene can't have: give {give}")]
    Setting {
        path: PathBuf,
        setting: &'static str,
        value: f64,
        give: &'static str,
    },
    #[error(transparent)]
    File(#[from] OutputFileError),
}

/// What is made of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The scene's file.
    pub path: PathBuf,
    /// From where on, in s since the recording's start.
    pub from_s: f64,
    /// To where; none to the end.
    pub to_s: Option<f64>,
    /// The true wavelength in mm; none: the median of the valid estimates.
    pub wavelength_mm: Option<f64>,
    /// Whether the scene expects what was recorded.
    pub expect: bool,
    /// Whether to write over a file that is there.
    pub force: bool,
}

/// The scene that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Made {
    /// Its file.
    pub path: PathBuf,
    /// Its length in s.
    pub duration_s: f64,
    /// The wavelength of its surface in mm.
    pub wavelength_mm: f64,
    /// The recorded instant of the sensor, in µs, at which it begins: an estimate of instant i is the
    /// scene's of (i − this).
    pub begin_us: i64,
    /// Recorded estimates within it that are valid, and all.
    pub estimates: (usize, usize),
    /// Share of the valid ones that are more than a tenth off that wavelength: a scene has but one.
    pub off_share: f64,
    /// Whether the recording was cut off.
    pub cut: bool,
    /// Rows of an older protocol that say nothing in this version's.
    pub passed_over: u64,
}

/// Writes the scene of a recording. Fails if none can be made of it, or a file can't be written.
pub fn write(recording: Reader, settings: &Settings) -> Result<Made, SceneError> {
    let path = settings.path.clone();
    output_file::refuse_taken(&path, settings.force, recording.path())?;
    let recording_path = recording.path().to_owned();
    let to_s = settings.to_s.unwrap_or(f64::INFINITY);
    let excerpt = Excerpt::take(recording, settings.from_s, to_s)?;
    let count = excerpt.samples.len();
    let layout = Layout::of(&excerpt.samples).ok_or(SceneError::NoSamples {
        path: recording_path.clone(),
        count,
    })?;
    if layout.duration_s > LONGEST_S {
        return Err(SceneError::TooLong {
            path: recording_path,
        });
    }
    let within: Vec<Estimate> = excerpt
        .estimates
        .iter()
        .filter(|estimate| layout.holds(estimate.instant_us))
        .copied()
        .collect();
    let valid: Vec<f64> = within.iter().filter_map(valid_mm).collect();
    let wavelength_mm = settings
        .wavelength_mm
        .or_else(|| median(&valid))
        .ok_or_else(|| SceneError::NoWavelength {
            path: recording_path.clone(),
        })?;
    let is_off = |mm: &&f64| (**mm / wavelength_mm - 1.0).abs() > 0.1;
    let off = valid.iter().filter(is_off).count();
    let expected = settings
        .expect
        .then(|| Expectation::of(&within, layout.duration_s))
        .flatten();
    let piece = Piece {
        recording: &recording_path,
        // The simulator is to begin with the same sample.
        logged_s: (settings.from_s.max(excerpt.first_s), settings.to_s),
        start_s: layout.start_s(&excerpt.samples),
        offset_mm: HALF_COUNT_MM - excerpt.samples[layout.first].position_um as f64 / 1_000.0,
        duration_s: layout.duration_s,
    };
    let toml = document::toml(&path, &piece, &excerpt, wavelength_mm, expected.as_ref())?;
    output_file::write(&path, &toml)?;
    Ok(Made {
        path,
        duration_s: layout.duration_s,
        wavelength_mm,
        begin_us: layout.begin_us,
        estimates: (valid.len(), within.len()),
        off_share: off as f64 / valid.len().max(1) as f64,
        cut: excerpt.cut,
        passed_over: excerpt.passed_over,
    })
}

/// The piece of a recording that a scene is made of.
struct Piece<'a> {
    recording: &'a Path,
    /// From and to which time since the recording's start messages count, in s.
    logged_s: (f64, Option<f64>),
    /// When the scene starts, in s since the first sample of the piece.
    start_s: f64,
    /// Added to the arm's places.
    offset_mm: f64,
    duration_s: f64,
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
    /// The instant of the sensor's clock at the scene's start. It wraps, as the clock may.
    begin_us: i64,
}

impl Layout {
    /// None if there are too few samples.
    fn of(samples: &[GaugeRow]) -> Option<Self> {
        let start = samples.first()?;
        let begin = start
            .sample
            .saturating_sub(DELAY_SAMPLES - 1)
            .checked_next_multiple_of(SAMPLES_PER_ESTIMATE)?;
        let first = (begin + DELAY_SAMPLES - 1).checked_sub(start.sample)? as usize;
        let before = samples.get(first)?;
        // A whole number of estimates, so that nothing is cut in the middle.
        let estimates = (samples.len() - 1 - first) / SAMPLES_PER_ESTIMATE as usize;
        (estimates > 0).then_some(Self {
            first,
            duration_s: estimates as f64 / 100.0,
            begin_us: before.instant_us.cast_signed().wrapping_add(SCAN_US),
        })
    }

    /// An instant of the sensor's clock in s since the scene's start.
    fn scene_s(&self, instant_us: u64) -> f64 {
        instant_us.cast_signed().wrapping_sub(self.begin_us) as f64 * 1e-6
    }

    /// Whether an instant of the sensor's clock lies within the scene.
    fn holds(&self, instant_us: u64) -> bool {
        (0.0..=self.duration_s).contains(&self.scene_s(instant_us))
    }

    /// When the scene starts, in s since the first of these samples, a ms apart.
    fn start_s(&self, samples: &[GaugeRow]) -> f64 {
        let first_us = samples.first().map_or(0, |first| first.instant_us);
        self.begin_us.wrapping_sub(first_us.cast_signed()) as f64 * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Forty samples from this number and this instant on.
    fn rows(first: u32, start_us: u64) -> Vec<GaugeRow> {
        let row = |index: u32| GaugeRow {
            sample: first.wrapping_add(index),
            block: 0,
            instant_us: start_us.wrapping_add(1_000 * u64::from(index)),
            position_um: 0,
            travel_um: 0,
            g0_v: 0.0,
            g1_v: 0.0,
            g2_v: 0.0,
            g3_v: 0.0,
            g4_v: 0.0,
            tangential_v: 0.0,
        };
        (0..40).map(row).collect()
    }

    #[test]
    fn samples_whose_numbers_begin_anew_amid_them_are_none_of_a_scene_and_no_trouble() {
        assert!(Layout::of(&rows(u32::MAX - 1, 0)).is_none());
        assert!(Layout::of(&rows(u32::MAX - 60, 0)).is_some());
    }

    #[test]
    fn a_layout_holds_its_instants_wherever_the_clock_stands() {
        for start_us in [0, i64::MAX.cast_unsigned() - 20_000, u64::MAX - 20_000] {
            let rows = rows(0, start_us);
            let layout = Layout::of(&rows).expect("enough of them");
            let first_us = rows[layout.first].instant_us;
            assert!(layout.holds(first_us.wrapping_add(1_000)), "{start_us}");
            assert!(!layout.holds(first_us.wrapping_add(1 << 63)), "{start_us}");
            assert!(layout.start_s(&rows).abs() < 0.1, "{start_us}");
        }
    }
}
