//! The scene's TOML.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use protocol::{DisplayConfiguration, GAUGES, Method, Mode, Rendering, SensorConfiguration};

use super::excerpt::Excerpt;
use super::expectation::Expectation;
use super::{Piece, SceneError};

/// The longest name that a scene may have.
const NAME: usize = 64;

/// The scene at `path`, with the name of the recording.
pub fn toml(
    path: &Path,
    piece: &Piece<'_>,
    excerpt: &Excerpt,
    wavelength_mm: f64,
    expected: Option<&Expectation>,
) -> Result<String, SceneError> {
    let mut text = String::new();
    let lines = &mut text;
    line(lines, "# Made by `host-bridge replay` of a recording.");
    line(lines, &format!("name = \"{}\"", name(path)));
    line(lines, &format!("duration_s = {:?}", piece.duration_s));
    line(lines, "");
    line(lines, "[surface]");
    line(
        lines,
        "# What the estimates are compared with; it is not rubbed, the voltages are recorded.",
    );
    line(
        lines,
        &format!("specimens = [{{ wavelength_mm = {wavelength_mm:.4} }}]"),
    );
    line(lines, "");
    line(lines, "[motion]");
    recorded(lines, path, piece);
    line(lines, &format!("offset_mm = {:.4}", piece.offset_mm));
    line(lines, "");
    line(lines, "[gauges]");
    recorded(lines, path, piece);
    line(lines, "filtered = true");
    if let Some(sensor) = &excerpt.sensor {
        force(lines, sensor)?;
        line(lines, "");
        estimator(lines, sensor);
    }
    if let Some(display) = &excerpt.display {
        line(lines, "");
        self::display(lines, display);
    }
    if let Some(expected) = expected {
        line(lines, "");
        expect(lines, expected);
    }
    Ok(text)
}

fn line(lines: &mut String, line: &str) {
    // A text takes what is written.
    let _ = writeln!(lines, "{line}");
}

/// A name that can stand in a file's name everywhere.
fn name(scene: &Path) -> String {
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = stem
        .chars()
        .map(|letter| match letter {
            'A'..='Z' | 'a'..='z' | '0'..='9' | '_' | '-' => letter,
            _ => '-',
        })
        .take(NAME)
        .collect();
    if name.is_empty() {
        "recorded".to_owned()
    } else {
        name
    }
}

/// Which piece of which recording.
fn recorded(lines: &mut String, scene: &Path, piece: &Piece<'_>) {
    line(lines, "kind = \"recorded\"");
    let file = file_beside(scene, piece.recording);
    let file = file.to_string_lossy();
    let file = file.replace('\\', "\\\\").replace('"', "\\\"");
    line(lines, &format!("file = \"{file}\""));
    let (from_s, to_s) = piece.logged_s;
    line(lines, &format!("logged_from_s = {from_s:?}"));
    if let Some(to_s) = to_s {
        line(lines, &format!("logged_to_s = {to_s:?}"));
    }
    line(lines, &format!("start_s = {:.6}", piece.start_s));
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

fn force(lines: &mut String, sensor: &SensorConfiguration) -> Result<(), SceneError> {
    line(lines, &format!("tangential = {}", sensor.force_channel));
    if !sensor.force_channel {
        return Ok(());
    }
    let n_per_v = f64::from(sensor.force_mn_per_v) / 1_000.0;
    if !(0.05..=20.0).contains(&n_per_v) {
        return Err(SceneError::Setting {
            setting: "the force channel's scale",
            value: n_per_v,
            give: "0.05 to 20 N/V",
        });
    }
    line(lines, &format!("tangential_n_per_v = {n_per_v:?}"));
    match sensor.stiffness_n_per_m {
        0 => {}
        stiffness @ 10..=10_000 => line(lines, &format!("stiffness_n_per_m = {stiffness}")),
        stiffness => {
            return Err(SceneError::Setting {
                setting: "the fingertip's stiffness",
                value: stiffness.into(),
                give: "10 to 10 000 N/m",
            });
        }
    }
    Ok(())
}

fn estimator(lines: &mut String, sensor: &SensorConfiguration) {
    let method = match sensor.method {
        Method::Spectrum => "spectrum",
        Method::Counting => "counting",
        Method::AdaptedCounting => "counting-adapted",
        Method::Crossings => "crossings",
    };
    let gauges: Vec<String> = (0..GAUGES)
        .filter(|gauge| sensor.gauges >> gauge & 1 == 1)
        .map(|gauge| gauge.to_string())
        .collect();
    line(lines, "[estimator]");
    line(lines, &format!("method = \"{method}\""));
    line(lines, &format!("window_ms = {}", sensor.window_ms));
    line(lines, &format!("counted_gauge = {}", sensor.counted_gauge));
    line(lines, &format!("gauges = [{}]", gauges.join(", ")));
    line(lines, &format!("waves = {}", sensor.waves));
    line(lines, &format!("valid_percent = {}", sensor.valid_percent));
    if sensor.force_channel && sensor.stiffness_n_per_m == 0 {
        line(lines, "stiffness = \"estimated\"");
    }
}

fn display(lines: &mut String, display: &DisplayConfiguration) {
    let mode = match display.mode {
        Mode::Uniform => "uniform",
        Mode::Travelling => "travelling",
    };
    let rendering = match display.rendering {
        Rendering::Fundamental => "fundamental",
        Rendering::Shape => "shape",
        Rendering::Texture => "texture",
    };
    line(lines, "[display]");
    if display.actuators != DisplayConfiguration::DEFAULT.actuators {
        line(
            lines,
            "# The board had another description of the actuators, which no board tells: name its file here.",
        );
    }
    line(lines, &format!("mode = \"{mode}\""));
    line(lines, &format!("rendering = \"{rendering}\""));
    for (key, value) in [
        ("update_rate_hz", display.update_rate.hz()),
        ("max_age_ms", display.max_age_ms.into()),
        ("fade_in_ms", display.fade_in_ms.into()),
        ("fade_out_ms", display.fade_out_ms.into()),
        ("glide_ms", display.glide_ms.into()),
        ("amplitude_mv", display.amplitude_mv.into()),
        ("reference_lsb", display.reference_lsb.into()),
        ("reference_mn", display.reference_mn.into()),
        ("full_drive_s", display.full_drive_s.into()),
    ] {
        line(lines, &format!("{key} = {value}"));
    }
}

fn expect(lines: &mut String, expected: &Expectation) {
    line(lines, "[expect]");
    line(lines, &format!("mean_mm = {:.4}", expected.mean_mm));
    line(
        lines,
        &format!("mean_tolerance_mm = {:.4}", expected.mean_tolerance_mm),
    );
    if let Some(share) = expected.valid_share_min {
        line(lines, &format!("valid_share_min = {share:.2}"));
    }
}
