//! From a map to its files: what is measured already is read, what is missing is run.

use std::fs;
use std::num::NonZero;
use std::path::{Path, PathBuf};

use super::Map;
use super::error::MapError;
use super::fingerprint::Fingerprints;
use super::journal;
use super::journal::{Journal, Rows};
use super::measurement::Measurement;
use super::picture;
use super::row::{Row, rank};
use super::shard::Shard;
use super::words;
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

/// A map's files.
#[derive(Clone, Debug)]
pub struct Files {
    /// The measurements.
    pub csv: PathBuf,
    /// The picture; none of a shard.
    pub picture: Option<PathBuf>,
    /// Where each method fails, in sentences; none of a shard.
    pub words: Option<PathBuf>,
}

impl Plan {
    /// Checks that every scene of a map can be run.
    ///
    /// # Errors
    /// The first refusal.
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
    ///
    /// # Errors
    /// If a method is unknown, or a file cannot be used or is another process'.
    pub fn open(map: &'a Map, plan: &'a Plan) -> Result<Self, MapError> {
        fs::create_dir_all(&plan.folder).map_err(MapError::file(
            &plan.folder,
            "cannot be made: give another --out",
        ))?;
        let name = match plan.shard {
            Some(shard) => format!("{}.{shard}.csv", map.name),
            None => format!("{}.csv", map.name),
        };
        let path = plan.folder.join(name);
        let mut keys = Fingerprints::new(map);
        for method in &plan.methods {
            keys.of(method).map_err(|source| MapError::Scene {
                map: map.name,
                source,
            })?;
        }
        let (journal, mut rows) = Journal::open(map, &path, &mut keys, plan.renew)?;
        if plan.shard.is_none() {
            for (shard, _) in shards(map, &plan.folder)? {
                // One that is still at work is not waited for, nor its cells run twice.
                let _lock = journal::lock(&shard)?;
                for (run, row) in journal::read(map, &shard, &mut keys, plan.renew)?.rows {
                    rows.entry(run).or_insert(row);
                }
            }
        }
        let cells = (0..map.len()).filter(|cell| plan.shard.is_none_or(|shard| shard.holds(*cell)));
        let missing = cells
            .flat_map(|cell| {
                plan.methods
                    .iter()
                    .map(move |method| (cell, method.clone()))
            })
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
    ///
    /// # Errors
    /// If something is: how much, and of which shards.
    pub fn complete(&self) -> Result<(), MapError> {
        if self.missing.is_empty() {
            return Ok(());
        }
        let found = shards(self.map, &self.plan.folder)?;
        let of = found.iter().map(|(_, of)| *of).max();
        let shards = of.map_or("there are no shards' files".to_owned(), |of| {
            let mut numbers: Vec<usize> =
                self.missing.iter().map(|(cell, _)| cell % of + 1).collect();
            numbers.sort_unstable();
            numbers.dedup();
            let names: Vec<String> = numbers
                .iter()
                .map(|number| format!("{number}/{of}"))
                .collect();
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
    ///
    /// # Errors
    /// If a scene cannot be run or the file not be written.
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
        in_order(
            &scenes,
            self.plan.threads,
            Measurement::of,
            |index, measurement| {
                let measurement = measurement.map_err(|source| MapError::Scene {
                    map: map.name,
                    source,
                })?;
                let (cell, method) = missing[index].clone();
                let row = Row {
                    cell,
                    method,
                    measurement,
                };
                journal.append(&row, keys)?;
                rows.insert((row.method.clone(), row.cell), row);
                step();
                Ok(())
            },
        )?;
        missing.clear();
        Ok(())
    }

    /// Sorts the CSV and, of a whole map, draws the picture and writes the sentences.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(mut self) -> Result<(Files, Rows), MapError> {
        self.journal.sort(&self.rows, &mut self.keys)?;
        let mut files = Files {
            csv: self.path,
            picture: None,
            words: None,
        };
        if self.plan.shard.is_none() {
            let methods = whole_methods(self.map, &self.rows);
            let write = |ending: &str, text: String| {
                let path = files.csv.with_extension(ending);
                let written = fs::write(&path, text);
                written.map_err(MapError::file(
                    &path,
                    "cannot be written: give another --out",
                ))?;
                Ok(Some(path))
            };
            let picture = write("svg", picture::draw(self.map, &methods, &self.rows))?;
            let words = write("md", words::text(self.map, &methods, &self.rows))?;
            (files.picture, files.words) = (picture, words);
        }
        Ok((files, self.rows))
    }
}

/// The methods that have every cell, in the pictures' order.
pub fn whole_methods<'r>(map: &Map, rows: &'r Rows) -> Vec<&'r str> {
    let mut methods: Vec<&str> = rows.keys().map(|(method, _)| method.as_str()).collect();
    methods.dedup();
    methods.retain(|method| {
        (0..map.len()).all(|cell| rows.contains_key(&((*method).to_owned(), cell)))
    });
    methods.sort_by_key(|method| rank(method));
    methods
}

fn scene(map: &Map, cell: usize, method: &str) -> Result<Scene, MapError> {
    map.scene(cell, method).map_err(|source| MapError::Scene {
        map: map.name,
        source,
    })
}

/// The files of a map's shards in a folder, each with how many shards there are, in order.
fn shards(map: &Map, folder: &Path) -> Result<Vec<(PathBuf, usize)>, MapError> {
    let reading = || MapError::file(folder, "cannot be read");
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(reading())? {
        let path = entry.map_err(reading())?.path();
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
