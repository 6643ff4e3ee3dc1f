//! The scene's TOML, and what the recorded estimates let it expect.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use protocol::{Configuration, DisplayConfiguration, Estimate, SensorConfiguration};

use super::excerpt::Excerpt;
use super::{Piece, SceneError, valid_mm};
use crate::monitor::settings::{self, Setting};

/// The longest name that a scene may have.
const NAME: usize = 64;
/// Of the sensor's settings those that a scene's `[estimator]` has.
const ESTIMATOR: usize = 6;

/// The scene at `path`, with the name of the recording.
pub fn toml(
    path: &Path,
    piece: &Piece<'_>,
    excerpt: &Excerpt,
    wavelength_mm: f64,
    expected: Option<&Expectation>,
) -> Result<String, SceneError> {
    let recorded = recorded(path, piece);
    let mut text = format!(
        "# Made by `host-bridge replay` of a recording.
name = \"{}\"
duration_s = {:?}

[surface]
# What the estimates are compared with; it is not rubbed, the voltages are recorded.
specimens = [{{ wavelength_mm = {wavelength_mm:.4} }}]

[motion]
{recorded}offset_mm = {:.4}

[gauges]
{recorded}filtered = true
",
        name(path),
        piece.duration_s,
        piece.offset_mm,
    );
    if let Some(sensor) = &excerpt.sensor {
        text += &force(sensor, piece.recording)?;
        text += "\n[estimator]\n";
        let settings = &settings::SENSOR[..ESTIMATOR];
        text += &lines(settings, &Configuration::Sensor(*sensor));
        if sensor.force_channel && sensor.stiffness_n_per_m == 0 {
            text += "stiffness = \"estimated\"\n";
        }
    }
    if let Some(display) = &excerpt.display {
        text += "\n[display]\n";
        if display.actuators != DisplayConfiguration::DEFAULT.actuators {
            text += "# The board had another description of the actuators, which no board tells: name its file here.\n";
        }
        text += &lines(&settings::DISPLAY, &Configuration::Display(*display));
    }
    if let Some(expected) = expected {
        text += &format!(
            "\n[expect]\nmean_mm = {:.4}\nmean_tolerance_mm = {:.4}\n",
            expected.mean_mm, expected.mean_tolerance_mm
        );
        if let Some(share) = expected.valid_share_min {
            text += &format!("valid_share_min = {share:.2}\n");
        }
    }
    Ok(text)
}

/// A name that can stand in a file's name everywhere.
fn name(scene: &Path) -> String {
    let plain = |letter: char| match letter {
        'A'..='Z' | 'a'..='z' | '0'..='9' | '_' | '-' => letter,
        _ => '-',
    };
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = stem.chars().map(plain).take(NAME).collect();
    if name.is_empty() {
        "recorded".to_owned()
    } else {
        name
    }
}

fn recorded(scene: &Path, piece: &Piece<'_>) -> String {
    let file = file_beside(scene, piece.recording);
    let file = file.to_string_lossy();
    let file = file.replace('\\', "\\\\").replace('"', "\\\"");
    let (from_s, to_s) = piece.logged_s;
    let to = to_s.map(|to_s| format!("logged_to_s = {to_s:?}\n"));
    format!(
        "kind = \"recorded\"\nfile = \"{file}\"\nlogged_from_s = {from_s:?}\n{}start_s = {:.6}\n",
        to.unwrap_or_default(),
        piece.start_s
    )
}

/// What the scene calls a recording: names are relative to the scene's own folder.
fn file_beside(scene: &Path, recording: &Path) -> PathBuf {
    let folder = |path: &Path| {
        let parent = path
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty());
        parent.unwrap_or(Path::new(".")).canonicalize().ok()
    };
    match (folder(scene), folder(recording), recording.file_name()) {
        (Some(scene), Some(found), Some(name)) if scene == found => name.into(),
        (_, Some(found), Some(name)) => found.join(name),
        _ => recording.to_owned(),
    }
}

fn force(sensor: &SensorConfiguration, path: &Path) -> Result<String, SceneError> {
    let mut text = format!("tangential = {}\n", sensor.force_channel);
    if !sensor.force_channel {
        return Ok(text);
    }
    let n_per_v = f64::from(sensor.force_mn_per_v) / 1_000.0;
    if !(0.05..=20.0).contains(&n_per_v) {
        return Err(SceneError::Setting {
            path: path.to_owned(),
            setting: "the force channel's scale",
            value: n_per_v,
            give: "0.05 to 20 N/V",
        });
    }
    text += &format!("tangential_n_per_v = {n_per_v:?}\n");
    match sensor.stiffness_n_per_m {
        0 => {}
        stiffness @ 10..=10_000 => text += &format!("stiffness_n_per_m = {stiffness}\n"),
        stiffness => {
            return Err(SceneError::Setting {
                path: path.to_owned(),
                setting: "the fingertip's stiffness",
                value: stiffness.into(),
                give: "10 to 10 000 N/m",
            });
        }
    }
    Ok(text)
}

/// A board's settings, by their names in scenes.
fn lines(settings: &[Setting], configuration: &Configuration) -> String {
    let mut text = String::new();
    for setting in settings {
        let value = setting.value(configuration).unwrap_or_default();
        // A text takes what is written.
        let _ = match setting.name {
            "method" | "mode" | "rendering" => writeln!(text, "{} = \"{value}\"", setting.name),
            "update_rate" => writeln!(text, "update_rate_hz = {value}"),
            "gauges" => {
                let gauges: Vec<String> = value.chars().map(String::from).collect();
                writeln!(text, "gauges = [{}]", gauges.join(", "))
            }
            name => writeln!(text, "{name} = {value}"),
        };
    }
    text
}

/// What the scene's estimators may take until they begin, in s: they know nothing of what was before.
const BEGINNING_S: f64 = 0.6;
/// What λ may differ by, relative: the samples are rounded once more.
const MEAN_TOLERANCE: f64 = 0.01;
/// What the share of valid estimates may differ by.
const SHARE_TOLERANCE: f64 = 0.05;
/// An arm that is faster counts as moving, in µm/s: what the simulator counts.
const MOVING_UM_S: u32 = 5_000;
const ESTIMATES_PER_S: f64 = 100.0;

/// Bounds for the scene's summary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expectation {
    /// Mean of the valid λ, in mm.
    pub mean_mm: f64,
    /// How far it may be off, in mm.
    pub mean_tolerance_mm: f64,
    /// The least share of the time in motion with a valid estimate; none if it is next to nothing.
    pub valid_share_min: Option<f64>,
}

impl Expectation {
    /// What these estimates, in order, let expect of a scene of `duration_s`; none if none of them is
    /// valid.
    pub fn of(estimates: &[Estimate], duration_s: f64) -> Option<Self> {
        let beginning = (BEGINNING_S * ESTIMATES_PER_S) as usize;
        let mean = |from: usize| {
            let valid: Vec<f64> = estimates.iter().skip(from).filter_map(valid_mm).collect();
            (!valid.is_empty()).then(|| valid.iter().sum::<f64>() / valid.len() as f64)
        };
        let mean_mm = mean(0)?;
        // The scene's valid ones begin somewhere in its beginning.
        let without_mm = mean(beginning).unwrap_or(mean_mm);
        let moving = estimates
            .iter()
            .filter(|estimate| estimate.velocity_um_s.unsigned_abs() > MOVING_UM_S);
        let (moving, valid) = moving.fold((0, 0), |(moving, valid), estimate| {
            (moving + 1, valid + usize::from(estimate.valid))
        });
        let share = valid as f64 / f64::max(moving.into(), 1.0);
        let least = share - SHARE_TOLERANCE - BEGINNING_S / duration_s;
        Some(Self {
            mean_mm,
            mean_tolerance_mm: MEAN_TOLERANCE * mean_mm + (without_mm - mean_mm).abs(),
            valid_share_min: (least > 0.0).then_some((least * 100.0).floor() / 100.0),
        })
    }
}
