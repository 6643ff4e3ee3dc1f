//! A folder of scenes with truths: whoever's recordings, judged as strangers are.
//!
//! `index.json` is a list; beside it is a scene for each entry, `NAME.toml`.
//!
//! | key | what |
//! | --- | --- |
//! | `name` | the scene's file without its ending |
//! | `truth` | λ in mm; 0: there is no period; or a list of `[t_s, mm]`, each from its instant on |
//! | `family` | optional: what it is counted with; else the name up to the first `-F` with a digit or `-mat` |
//! | `note` | optional, for people |
//!
//! The truth is the index's, whatever the scene says of its surface: a recorded one is not known there.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use hil_sim_core::judge::felt;
use hil_sim_core::judge::phase::DuePhase;
use hil_sim_core::judge::truth::Truth as Ground;
use hil_sim_core::run::observer::{RunEvent, RunObserver, replay_to};
use hil_sim_core::run::recording::Recording;

use super::counts::{Counts, Worth};

/// The name of the list.
pub const INDEX: &str = "index.json";
/// Estimates count from here on: by then the filters have settled.
const FROM_S: f64 = 1.0;
const FORM: &str = "give a list of {\"name\": …, \"truth\": …}";
const FORM_OF_TRUTH: &str =
    "give λ in mm, 0 where there is no period, or a list of [t_s, mm] in rising order of t_s";

/// A scene and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Of the scene's file.
    pub name: String,
    /// What it is counted with.
    pub family: String,
    /// The scene.
    pub scene: PathBuf,
    /// What is under the fingertip.
    pub truth: Truth,
}

/// λ over time: from each instant in s on, in mm; 0 where there is no period. Never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth(Vec<(f64, f64)>);

/// Why a folder cannot be judged.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The list cannot be read.
    #[error("{}: cannot be read, and a folder to judge has this list of its scenes and their truths", path.display())]
    NoIndex {
        /// The list.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The list is no JSON.
    #[error("{}: no JSON", path.display())]
    NotJson {
        /// The list.
        path: PathBuf,
        /// Where, and why.
        source: serde_json::Error,
    },
    /// The list is none, or there is nothing in it.
    #[error("{}: not a list with anything in it: {FORM}", path.display())]
    NoList {
        /// The list.
        path: PathBuf,
    },
    /// An entry without a name that a file may have.
    #[error("{}: entry {number}: no usable name: {FORM}, the name of a scene's file without .toml", path.display())]
    BadName {
        /// The list.
        path: PathBuf,
        /// Which entry, counted from 1.
        number: usize,
    },
    /// An entry without a truth that can be used.
    #[error("{}: {name}: truth is {said}: {FORM_OF_TRUTH}", path.display())]
    BadTruth {
        /// The list.
        path: PathBuf,
        /// The entry.
        name: String,
        /// What stands there.
        said: String,
    },
    /// An entry whose scene is not there.
    #[error("{}: no such scene, though {} has {name}: put it there, or take the entry out", scene.display(), path.display())]
    NoScene {
        /// The list.
        path: PathBuf,
        /// The entry.
        name: String,
        /// Where its scene should be.
        scene: PathBuf,
    },
}

/// Reads a folder's list, in its order.
///
/// # Errors
/// The first thing in it that cannot be used.
pub fn read(folder: &Path) -> Result<Vec<Entry>, FolderError> {
    let path = folder.join(INDEX);
    let text = fs::read_to_string(&path).map_err(|source| FolderError::NoIndex {
        path: path.clone(),
        source,
    })?;
    // As editors on Windows write it: TOML and CSV let it pass too.
    let json = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let value: Value = serde_json::from_str(json).map_err(|source| FolderError::NotJson {
        path: path.clone(),
        source,
    })?;
    match value {
        Value::Array(entries) if !entries.is_empty() => entries
            .iter()
            .enumerate()
            .map(|(index, value)| entry(folder, &path, index + 1, value))
            .collect(),
        _ => Err(FolderError::NoList { path }),
    }
}

fn entry(folder: &Path, path: &Path, number: usize, value: &Value) -> Result<Entry, FolderError> {
    let nothing = Map::new();
    let keys = value.as_object().unwrap_or(&nothing);
    // A name with a path in it would lead out of the folder.
    let name = keys
        .get("name")
        .and_then(Value::as_str)
        .filter(|name| !name.is_empty() && !name.contains(['/', '\\']))
        .ok_or_else(|| FolderError::BadName {
            path: path.to_owned(),
            number,
        })?;
    let said = keys.get("truth");
    let truth = said.and_then(truth).ok_or_else(|| FolderError::BadTruth {
        path: path.to_owned(),
        name: name.to_owned(),
        said: said.map_or("missing".to_owned(), Value::to_string),
    })?;
    let scene = folder.join(format!("{name}.toml"));
    if !scene.is_file() {
        return Err(FolderError::NoScene {
            path: path.to_owned(),
            name: name.to_owned(),
            scene,
        });
    }
    let family = keys.get("family").and_then(Value::as_str);
    Ok(Entry {
        family: family.unwrap_or_else(|| family_of(name)).to_owned(),
        name: name.to_owned(),
        scene,
        truth,
    })
}

fn truth(value: &Value) -> Option<Truth> {
    let wavelength = |value: &Value| value.as_f64().filter(|mm| *mm >= 0.0);
    if let Some(mm) = wavelength(value) {
        return Some(Truth(vec![(0.0, mm)]));
    }
    let pair = |value: &Value| match value.as_array()?.as_slice() {
        [from_s, mm] => Some((from_s.as_f64()?, wavelength(mm)?)),
        _ => None,
    };
    let pairs: Vec<(f64, f64)> = value.as_array()?.iter().map(pair).collect::<Option<_>>()?;
    let rises = pairs.is_sorted_by(|one, next| one.0 < next.0);
    (rises && !pairs.is_empty()).then_some(Truth(pairs))
}

/// A name's part before the force or the specimen's number: up to `-F` with a digit, or `-mat`.
fn family_of(name: &str) -> &str {
    let ends = |(at, _): &(usize, &str)| {
        let rest = &name[at + 2..];
        name[*at..].starts_with("-mat") || rest.starts_with(|next: char| next.is_ascii_digit())
    };
    let forces = name.match_indices("-F");
    let mats = name.match_indices("-mat");
    let first = forces
        .chain(mats)
        .filter(ends)
        .map(|(at, _)| at)
        .min()
        .unwrap_or(name.len());
    &name[..first]
}

impl Truth {
    /// λ in mm at an instant in s; 0 where there is no period. Before the first instant it is the first.
    pub fn at(&self, t_s: f64) -> f64 {
        let passed = self.0.partition_point(|(from_s, _)| *from_s <= t_s);
        self.0[passed.saturating_sub(1)].1
    }

    /// Judges a run's estimates, each an instant in s and the λ in mm that is stood by: all of them from 1 s
    /// on.
    pub fn judge(&self, said: impl IntoIterator<Item = (f64, Option<f64>)>) -> Counts {
        let mut counts = Counts::default();
        for (t_s, said_mm) in said {
            if t_s > FROM_S {
                counts.count(Worth::of(said_mm, self.at(t_s)));
            }
        }
        counts
    }

    /// What is felt of a run on boards that are set as `ground` says, over the whole of it.
    pub fn felt(&self, ground: &Ground<'_>, recording: &Recording) -> felt::Felt {
        let mut finger = Finger {
            truth: self,
            due: DuePhase::new(ground),
            felt: felt::Judge::default(),
        };
        replay_to(recording, &mut finger);
        finger.felt.finish()
    }
}

/// Feels what is played, and knows the truth.
struct Finger<'a> {
    truth: &'a Truth,
    due: DuePhase,
    felt: felt::Judge,
}

impl RunObserver for Finger<'_> {
    fn see(&mut self, event: RunEvent<'_>) {
        self.due.see(event);
        match event {
            RunEvent::Tick(tick) => {
                let under_mm = self.truth.at(tick.at_ns as f64 * 1e-9);
                let waves = felt::Waves {
                    in_force_per_mm: self.due.in_force_per_mm(),
                    under_mm: Some(under_mm).filter(|&mm| mm > 0.0),
                };
                self.felt.tick(tick, waves);
            }
            RunEvent::Output(output) => self.felt.output(output),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Option<Truth> {
        truth(&serde_json::from_str(text).unwrap())
    }

    #[test]
    fn the_truth_is_a_number_or_changes_at_instants() {
        let steady = parsed("3.99").unwrap();
        assert_eq!((steady.at(0.0), steady.at(60.0)), (3.99, 3.99));
        let steps = parsed("[[0.5, 2.0], [1.5, 0], [2.5, 4]]").unwrap();
        let at = [0.0, 1.0, 1.5, 2.4, 2.5, 9.0].map(|t_s| steps.at(t_s));
        assert_eq!(at, [2.0, 2.0, 0.0, 0.0, 4.0, 4.0]);
        for bad in [
            "-1",
            "\"2\"",
            "null",
            "[]",
            "[2.0]",
            "[[0, 2, 3]]",
            "[[1, 2], [1, 3]]",
            "[[0, -2]]",
        ] {
            assert_eq!(parsed(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_byte_order_mark_in_front_of_the_list_is_no_part_of_it() {
        let name = format!("hil-sim-{}-marked-list", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        let list = "\u{feff}[{\"name\": \"a\", \"truth\": 2}]\r\n";
        fs::write(folder.join(INDEX), list).unwrap();
        fs::write(folder.join("a.toml"), "").unwrap();
        let entries = read(&folder);
        fs::remove_dir_all(&folder).unwrap();
        let entries = entries.unwrap();
        assert_eq!(entries.len(), 1);
        assert_eq!((&*entries[0].name, entries[0].truth.at(0.0)), ("a", 2.0));
    }

    #[test]
    fn a_family_ends_at_the_force_or_the_mat() {
        for (name, family) in [
            ("fabric-F120-v5x5", "fabric"),
            ("sense-PLA2-F15-v20x2", "sense-PLA2"),
            ("tip-mat3-F2", "tip"),
            ("woven-Fine-F3", "woven-Fine"),
            ("plain", "plain"),
            ("a-F", "a-F"),
        ] {
            assert_eq!(family_of(name), family, "{name}");
        }
    }

    #[test]
    fn estimates_count_from_one_second_on_against_the_truth_of_their_instant() {
        let truth = Truth(vec![(0.0, 2.0), (2.0, 0.0)]);
        let counts = truth.judge([
            (0.9, Some(7.0)),
            (1.1, Some(2.01)),
            (1.2, Some(2.15)),
            (1.3, Some(2.5)),
            (1.4, None),
            (2.1, Some(2.0)),
            (2.2, None),
        ]);
        let expected = Counts {
            all: 6,
            right: 1,
            wrong: 2,
            silent: 2,
        };
        assert_eq!(counts, expected);
    }
}
