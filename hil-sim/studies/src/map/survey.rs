//! From a map to its files: what is measured already is read, what is missing is run.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::num::NonZero;
use std::path::{Path, PathBuf};

use super::Map;
use super::error::{MapError, NOT_WRITTEN};
use super::fingerprint::Fingerprints;
use super::journal;
use super::journal::{Journal, Rows};
use super::measurement::Measurement;
use super::picture;
use super::row::{Row, rank};
use super::shard::Shard;
use super::{summary, words};
use crate::study::Record;
use hil_sim_core::run::batch::in_order;
use hil_sim_core::scene::Scene;

/// How maps are to be made.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The methods, as scenes write them.
    pub methods: Vec<String>,
    /// Where the files are.
    pub folder: PathBuf,
    /// The part of the cells to run; all of them if none.
    pub shard: Option<Shard>,
    /// Scenes to run at a time.
    pub threads: NonZero<usize>,
    /// Whether measurements of another grid or version are thrown away instead of refused.
    pub renew: bool,
}

/// A map on its way.
pub struct Survey<'a> {
    map: &'a Map,
    plan: &'a Plan,
    keys: Fingerprints<'a>,
    journal: Journal<'a>,
    path: PathBuf,
    rows: Rows,
    missing: Vec<(usize, String)>,
}

/// A map that was made.
#[derive(Clone, Debug)]
pub struct Made {
    /// Its files: the measurements and, unless it is a shard, the picture, and where each method fails, in sentences.
    pub files: Vec<PathBuf>,
    /// A line for each method that has every cell, for a table of several maps.
    pub lines: Vec<Record>,
    /// The sentences.
    pub words: String,
}

impl Plan {
    /// Checks that every scene of a map can be run.
    pub fn check(&self, map: &Map) -> Result<(), MapError> {
        for method in &self.methods {
            for cell in 0..map.len() {
                scene(map, cell, method)?;
            }
        }
        Ok(())
    }
}

impl<'a> Survey<'a> {
    /// Opens a map's CSV in the plan's folder and finds out what is missing. Without a shard, what the
    /// folder has of shards counts as there.
    pub fn open(map: &'a Map, plan: &'a Plan) -> Result<Self, MapError> {
        let made = fs::create_dir_all(&plan.folder);
        let doing = "cannot be made: give another --out";
        made.map_err(MapError::file(&plan.folder, doing))?;
        let name = match plan.shard {
            Some(shard) => format!("{}.{shard}.csv", map.name),
            None => format!("{}.csv", map.name),
        };
        let path = plan.folder.join(name);
        let mut keys = Fingerprints::new(map);
        for method in &plan.methods {
            let key = keys.of(method);
            key.map_err(|source| MapError::Scene(map.name, source))?;
        }
        let (journal, mut rows) = Journal::open(map, &path, &mut keys, plan.renew)?;
        if plan.shard.is_none() {
            for (shard, _) in shards(map, &plan.folder)? {
                // One that is still at work is not waited for, nor its cells run twice.
                let _lock = journal::lock(&shard)?;
                for (run, row) in journal::read(map, &shard, &mut keys, plan.renew)?.0 {
                    rows.entry(run).or_insert(row);
                }
            }
        }
        let cells = (0..map.len()).filter(|cell| plan.shard.is_none_or(|shard| shard.holds(*cell)));
        let methods = plan.methods.iter();
        let runs = cells.flat_map(|cell| methods.clone().map(move |of| (cell, of.clone())));
        let missing = runs
            .filter(|(cell, method)| !rows.contains_key(&(method.clone(), *cell)))
            .collect();
        Ok(Self {
            map,
            plan,
            keys,
            journal,
            path,
            rows,
            missing,
        })
    }

    /// How many runs are missing.
    pub fn missing(&self) -> usize {
        self.missing.len()
    }

    /// That nothing is missing.
    pub fn complete(&self) -> Result<(), MapError> {
        if self.missing.is_empty() {
            return Ok(());
        }
        let found = shards(self.map, &self.plan.folder)?;
        let of = found.iter().map(|(_, of)| *of).max();
        let shards = of.map_or("there are no shards' files".to_owned(), |of| {
            let numbers = self.missing.iter().map(|(cell, _)| cell % of + 1);
            let numbers: BTreeSet<usize> = numbers.collect();
            let names: Vec<String> = numbers.iter().map(|n| format!("{n}/{of}")).collect();
            format!("of the shards {}", names.join(", "))
        });
        Err(MapError::Incomplete {
            path: self.path.clone(),
            missing: self.missing.len(),
            all: self.map.len() * self.plan.methods.len(),
            shards,
        })
    }

    /// Runs what is missing. Every finished run is in the file before `step` is called.
    pub fn run(&mut self, mut step: impl FnMut()) -> Result<(), MapError> {
        let Self {
            map,
            keys,
            journal,
            rows,
            missing,
            ..
        } = self;
        let scenes: Vec<Scene> = missing
            .iter()
            .map(|(cell, method)| scene(map, *cell, method))
            .collect::<Result<_, _>>()?;
        let ran = |index: usize, measurement: Result<Measurement, _>| {
            let (cell, method) = missing[index].clone();
            let row = Row {
                cell,
                method,
                measurement: measurement.map_err(|source| MapError::Scene(map.name, source))?,
            };
            journal.append(&row, keys)?;
            rows.insert((row.method.clone(), row.cell), row);
            step();
            Ok(())
        };
        in_order(&scenes, self.plan.threads, Measurement::of, ran)?;
        missing.clear();
        Ok(())
    }

    /// Sorts the CSV and, of a whole map, draws the picture and writes the sentences.
    pub fn finish(mut self) -> Result<Made, MapError> {
        self.journal.sort(&self.rows, &mut self.keys)?;
        let Self {
            map, rows, path, ..
        } = &self;
        let methods = whole_methods(map, rows);
        let lines = methods
            .iter()
            .map(|method| summary::line(map, method, rows));
        let mut made = Made {
            files: vec![path.clone()],
            lines: lines.collect(),
            words: words::text(map, &methods, rows),
        };
        if self.plan.shard.is_none() {
            let picture = picture::draw(map, &methods, rows);
            for (ending, text) in [("svg", &picture), ("md", &made.words)] {
                let path = path.with_extension(ending);
                fs::write(&path, text).map_err(MapError::file(&path, NOT_WRITTEN))?;
                made.files.push(path);
            }
        }
        Ok(made)
    }
}

/// The methods that have every cell, in the pictures' order.
fn whole_methods<'r>(map: &Map, rows: &'r Rows) -> Vec<&'r str> {
    let mut methods: Vec<&str> = rows.keys().map(|(method, _)| method.as_str()).collect();
    methods.dedup();
    methods.retain(|method| {
        (0..map.len()).all(|cell| rows.contains_key(&((*method).to_owned(), cell)))
    });
    methods.sort_by_key(|method| rank(method));
    methods
}

fn scene(map: &Map, cell: usize, method: &str) -> Result<Scene, MapError> {
    let scene = map.scene(cell, method);
    scene.map_err(|source| MapError::Scene(map.name, source))
}

/// The files of a map's shards in a folder, each with how many shards there are, in order.
fn shards(map: &Map, folder: &Path) -> Result<Vec<(PathBuf, usize)>, MapError> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let mut found = Vec::new();
    for entry in entries.map_err(MapError::file(folder, "cannot be read"))? {
        let path = entry.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let part = name
            .strip_prefix(map.name)
            .and_then(|rest| rest.strip_prefix('.'))
            .and_then(|rest| rest.strip_suffix(".csv"))
            .and_then(|part| part.replacen("-of-", "/", 1).parse::<Shard>().ok());
        if let Some(shard) = part {
            found.push((path, shard.count()));
        }
    }
    found.sort();
    Ok(found)
}
