//! What every estimator gives and what it costs.

mod bank;
mod baselines;
mod benchmark;
mod bound;
pub mod confidence;
mod costs;
pub mod efficiency;
pub mod family;
pub mod parts;
mod picture;
mod pitch;
mod result;
mod score;
mod settings;
mod tally;

use std::path::Path;

use crate::bench::BenchError;
use crate::study::Progress;
use benchmark::{contestants, run};
use costs::Costs;
use family::Family;
use result::Entry;
use score::Score;

pub use result::BenchmarkResult;

/// Counts what every contestant costs, by the ELF of the example `estimator_cost`, and scores it on every family.
pub fn compare(
    families: Vec<Family>,
    cost_elf: &Path,
    progress: &impl Progress,
) -> Result<BenchmarkResult, BenchError> {
    let costs = Costs::count(cost_elf)?;
    let contestants = contestants();
    let scenes: Vec<_> = families.iter().flat_map(|family| &family.scenes).collect();
    let summaries = run(&contestants, &scenes, |_| 0.0, progress)?;
    let mut entries = bank::entries(&families);
    for (index, contestant) in contestants.iter().enumerate() {
        let mut summaries = summaries.iter().map(|scene| &scene[index]);
        let score = |family: &Family| {
            let of_family: Vec<_> = summaries.by_ref().take(family.scenes.len()).collect();
            Score::new(&family.scenes, of_family.into_iter())
        };
        entries.push(Entry {
            method: contestant.method,
            knob: contestant.knob,
            value: contestant.value,
            setting: contestant.setting,
            cost: costs.of(contestant.work),
            scores: families.iter().map(score).collect(),
        });
    }
    Ok(BenchmarkResult { families, entries })
}
