//! Takes a recording or a scene out to what others read: textures in ISO/IEC 23090-31's `.hjif`, signals in WAV.
//!
//! ```text
//! recording ─> samples without a gap ─┬─> groups of channels over time ──────────────────┬─> WAV, a file a group
//! scene ─> surface, run by `native` ──┘                                                  │
//!      └─────> a stretch in one direction, the surface: channels over place ─> texture ──┴─> .hjif
//! ```
//!
//! What is written is what is there: nothing is filtered, and codes and words keep their steps.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use hil_sim_core::scene::{Scene, SceneError};

use crate::output_file::{self, OutputFileError, refuse_taken};
use crate::recording::reader::{ReadError, Reader};
use crate::replay::scene::SceneError as ExcerptError;
use crate::replay::scene::excerpt::Excerpt;

mod group;
mod of_recording;
mod of_scene;
mod texture;

pub use group::{Along, Group, Samples};

/// The longest texture, in mm.
const LONGEST_MM: f64 = 10_000.0;

/// Why nothing is exported.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum ExportError {
    #[error(transparent)]
    Unread(#[from] ReadError),
    #[error(transparent)]
    Excerpt(#[from] ExcerptError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{0}: give a name that ends in .hjif or in .wav")]
    Format(PathBuf),
    #[error("{0}: is no UTF-8, and a scene could not name it: give another name")]
    Name(PathBuf),
    #[error("--from and --to-time are a recording's: a scene is as long as its duration_s says")]
    Part,
    #[error(
        "{0}: the arm does not move there, and a texture is a function of place: give another part, or a .wav"
    )]
    AtRest(PathBuf),
    #[error(
        "the way is {length_mm:.0} mm: a texture has {LONGEST_MM:.0} mm at most: give the scene a shorter duration_s"
    )]
    TooLong { length_mm: f64 },
    #[error(
        "{0}: the sensor's clock goes wrong in this scene, so its scans are not evenly spaced, as a WAV file's samples are: take that fault out"
    )]
    Uneven(String),
    #[error(
        "{path}: the arm is {position_um} µm from its start, a WAV sample holds ± 2 147 483 647: give another part"
    )]
    Far { path: PathBuf, position_um: i64 },
    #[error(transparent)]
    File(#[from] OutputFileError),
}

/// What is exported, and where to.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The recording, `.mcap`, or the scene, `.toml`.
    pub from: PathBuf,
    /// The file, `.hjif`, or what the files' names begin with, `.wav`.
    pub to: PathBuf,
    /// From where on, in s since the recording's start; none from its beginning.
    pub from_s: Option<f64>,
    /// To where; none to its end.
    pub to_s: Option<f64>,
    /// When it is made, for the file to say (RFC 3339).
    pub date: String,
    /// Whether to write over files that are there.
    pub force: bool,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The file.
    pub path: PathBuf,
    /// What is in it, in words.
    pub holds: String,
    /// The lines of a scene that read it; none if no scene does.
    pub section: Option<String>,
}

/// What was exported.
#[derive(Clone, Debug, PartialEq)]
pub struct Exports {
    /// The files.
    pub files: Vec<Exported>,
    /// Whether the recording was cut off: there may have been more of it.
    pub is_cut: bool,
}

impl Exports {
    const fn whole(files: Vec<Exported>) -> Self {
        let is_cut = false;
        Self { files, is_cut }
    }
}

/// Writes the files. Fails if there is nothing to export, or a file can't be written; files that were written
/// before stay.
pub fn write(settings: &Settings) -> Result<Exports, ExportError> {
    let ending = |path: &Path| {
        let ending = path.extension()?.to_str()?;
        Some(ending.to_ascii_lowercase())
    };
    let is_texture = match ending(&settings.to).as_deref() {
        Some("hjif") => true,
        Some("wav") => false,
        _ => {
            return Err(ExportError::Format(settings.to.clone()));
        }
    };
    if settings.to.file_name().and_then(OsStr::to_str).is_none() {
        return Err(ExportError::Name(settings.to.clone()));
    }
    if ending(&settings.from).as_deref() == Some("toml") {
        if settings.from_s.is_some() || settings.to_s.is_some() {
            return Err(ExportError::Part);
        }
        let scene = Scene::load(&settings.from)?;
        if is_texture {
            let texture = of_scene::texture(&scene, settings)?;
            return write_texture(settings, texture).map(Exports::whole);
        }
        return write_groups(settings, of_scene::groups(&scene)?).map(Exports::whole);
    }
    let recording = Reader::open(&settings.from)?;
    let to_s = settings.to_s.unwrap_or(f64::INFINITY);
    let excerpt = Excerpt::take(recording, settings.from_s.unwrap_or(0.0), to_s)?;
    if excerpt.samples.len() < 2 {
        return Err(ExportError::Excerpt(ExcerptError::NoSamples {
            path: settings.from.clone(),
            count: excerpt.samples.len(),
        }));
    }
    let files = if is_texture {
        let texture = of_recording::texture(&excerpt, settings)?;
        write_texture(settings, texture)?
    } else {
        write_groups(settings, of_recording::groups(&excerpt, &settings.from)?)?
    };
    let is_cut = excerpt.cut;
    Ok(Exports { files, is_cut })
}

fn write_texture(
    settings: &Settings,
    texture: texture::Made,
) -> Result<Vec<Exported>, ExportError> {
    let path = settings.to.clone();
    refuse_taken(&path, settings.force, &settings.from)?;
    let text = texture
        .experience
        .text()
        .map_err(|error| OutputFileError::not_written(&path, io::Error::other(error)))?;
    output_file::write(&path, &text)?;
    let section = texture.section(&path);
    Ok(vec![Exported {
        path,
        holds: texture.holds,
        section: Some(section),
    }])
}

fn write_groups(settings: &Settings, groups: Vec<Group>) -> Result<Vec<Exported>, ExportError> {
    let stem = settings.to.file_stem().unwrap_or_default();
    let path = |group: &Group| {
        let name = format!("{}-{}.wav", stem.to_string_lossy(), group.name);
        settings.to.with_file_name(name)
    };
    for group in &groups {
        refuse_taken(&path(group), settings.force, &settings.from)?;
    }
    let mut exported = Vec::with_capacity(groups.len());
    for group in groups {
        let path = path(&group);
        group::write(&path, &group)?;
        exported.push(Exported {
            holds: group.holds(),
            section: group.section(&path),
            path,
        });
    }
    Ok(exported)
}

/// A file's name for a scene that stands beside it.
fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    toml::Value::String(name.to_string_lossy().into_owned()).to_string()
}
