//! `hil-sim map`.

use std::path::PathBuf;
use std::process::ExitCode;

use super::run_options::tell_notes;
use super::say::{self, say, tell};
use super::{at_least_one, progress, threads};
use hil_sim_studies::map::{Axis, METHODS, Made, Map, Plan, Shard, Survey, catalogue, find};
use hil_sim_studies::study::{Record, Table, short};

#[derive(Debug, clap::Args)]
pub(super) struct Maps {
    /// Maps, all of them if none is named
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Methods to compare, as scenes write them [default: spectrum, crossings, counting]
    #[arg(long = "method", value_name = "METHOD")]
    methods: Vec<String>,
    /// Folder for the CSV files and pictures
    #[arg(long, value_name = "DIR", default_value = "target/map")]
    out: PathBuf,
    /// Run the i-th of n parts only, into a file of its own
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Scenes to run at a time, 1 or more [default: one per core]
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    jobs: Option<usize>,
    /// Join shards' files and draw, but run nothing
    #[arg(long, conflicts_with = "shard")]
    merge: bool,
    /// Throw away what was measured on another grid or by another version, instead of refusing it
    #[arg(long)]
    renew: bool,
    /// List the maps, their axes and their numbers of cells
    #[arg(long)]
    list: bool,
    /// Print the scene of the cell nearest to X,Y, to be run by itself
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    scene: Option<String>,
}

impl Maps {
    pub(super) fn execute(self) -> anyhow::Result<ExitCode> {
        let maps = if self.names.is_empty() {
            catalogue()
        } else {
            let mut named: Vec<Map> = Vec::new();
            for name in &self.names {
                let map = find(name)?;
                if named.iter().all(|other| other.name != map.name) {
                    named.push(map);
                }
            }
            named
        };
        // Naming one twice runs it once.
        let mut methods: Vec<String> = Vec::new();
        for method in self.methods {
            if !methods.contains(&method) {
                methods.push(method);
            }
        }
        if methods.is_empty() {
            methods = METHODS.map(str::to_owned).to_vec();
        }
        if self.list {
            list(&maps);
            return Ok(ExitCode::SUCCESS);
        }
        if let Some(place) = self.scene {
            print_scene(&maps, &place, &methods)?;
            return Ok(ExitCode::SUCCESS);
        }
        let plan = Plan {
            methods,
            folder: self.out,
            shard: self.shard.as_deref().map(str::parse::<Shard>).transpose()?,
            threads: threads(self.jobs.unwrap_or(0)),
            renew: self.renew,
        };
        // All of it first: a refusal is not to come after half an hour.
        for map in &maps {
            plan.check(map)?;
        }
        if let Some(map) = maps.first() {
            for method in &plan.methods {
                tell_notes(&map.scene(0, method)?);
            }
        }
        let made = maps.iter().map(|map| make(map, &plan, self.merge));
        let made: Vec<Made> = made.collect::<Result<_, _>>()?;
        if plan.shard.is_none() {
            let words: Vec<&str> = made.iter().map(|made| &*made.words).collect();
            let words = words.join("\n");
            let table = Table::from_iter(made.iter().flat_map(|made| made.lines.clone()));
            say!("{table}\n\n{}", words.trim_end());
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn make(map: &Map, plan: &Plan, merge: bool) -> anyhow::Result<Made> {
    let mut survey = Survey::open(map, plan)?;
    if merge {
        survey.complete()?;
    }
    let bar = progress(survey.missing() as u64, &format!("runs of {}", map.name));
    survey.run(|| bar.inc(1))?;
    bar.finish_and_clear();
    let made = survey.finish()?;
    for file in &made.files {
        tell!("{}", file.display());
    }
    Ok(made)
}

fn list(maps: &[Map]) {
    let axis = |axis: &Axis| format!("{}: {}", axis.label, axis.told());
    let rows = maps.iter().map(|map| {
        Record::default()
            .with("map", map.name)
            .with("cells:", short(map.len()))
            .with("along x", axis(&map.x))
            .with("along y", axis(&map.y))
            .with("in all cells", map.conditions)
    });
    say!("{}", Table::from_iter(rows));
}

fn print_scene(maps: &[Map], place: &str, methods: &[String]) -> anyhow::Result<()> {
    let ([map], Some((x, y))) = (maps, place.split_once(',')) else {
        anyhow::bail!(
            "--scene: give one map and a place on its axes, such as hil-sim map snr-wavelength --scene 20,2.0"
        );
    };
    let cell = map.nearest(x.trim(), y.trim())?;
    let method = methods.first().map_or(METHODS[0], String::as_str);
    say::text(format_args!("{}", map.scene_text(cell, method)));
    Ok(())
}
