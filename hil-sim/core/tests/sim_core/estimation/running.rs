//! Committed scenes, found and run in parallel.

use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use hil_sim_core::judge::Verdict;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::scene::Scene;

/// A folder below the committed scenes.
pub fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenes")
        .join(name)
}

/// Every scene in `folder` and below, in the order of their paths.
pub fn scenes_in(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "toml") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A scene that was run, and what its estimates were worth.
pub struct Run {
    /// What was run.
    pub scene: Scene,
    /// The estimates, one by one and as a whole.
    pub verdict: Verdict,
    /// A line for each expectation of the scene that was not met.
    pub unmet: Vec<String>,
}

/// Runs a scene and judges it.
pub fn run(scene: Scene) -> Run {
    let recording = native::run(&scene).unwrap();
    let Outcome {
        scene,
        verdict,
        unmet,
        ..
    } = Outcome::new(scene, recording);
    Run {
        scene,
        verdict,
        unmet,
    }
}

/// `what` of every item, in their order, with as many threads as there are cores.
pub fn of_each<T: Sync, R: Send>(items: &[T], what: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return done;
            };
            done.push((index, what(item)));
        }
    };
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    let mut done: Vec<(usize, R)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let done = workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap());
        done.collect()
    });
    done.sort_by_key(|&(index, _)| index);
    done.into_iter().map(|(_, result)| result).collect()
}
