//! What tells a map's measurements from those of another grid or version.
//!
//! A key is the XXH3 of every cell's scene, of this package's version, and of what a few cells come to:
//! every link byte and DAC word of their runs. So a file that was begun before an estimator or the world
//! changed is told from one begun after it, which no version number would do between two releases.

use std::collections::BTreeMap;
use std::hash::Hasher;

use twox_hash::XxHash3_64;

use super::Map;
use hil_sim_core::native;
use hil_sim_core::scene::SceneError;

/// Goes up when rows are judged or written another way.
const FORMAT: u32 = 1;
/// Cells that are run for the key, as shares of the way along x and y.
const PROBES: [(f64, f64); 4] = [(0.2, 0.3), (0.8, 0.2), (0.3, 0.8), (0.7, 0.7)];

/// The keys of a map, one per method, each found out when it is first asked for.
pub struct Fingerprints<'a> {
    map: &'a Map,
    known: BTreeMap<String, Result<u64, SceneError>>,
}

impl<'a> Fingerprints<'a> {
    pub fn new(map: &'a Map) -> Self {
        Self {
            map,
            known: BTreeMap::new(),
        }
    }

    /// The key of a method: a fraction of a second the first time. An error if this version does not know the method, or
    /// cannot run the map.
    pub fn of(&mut self, method: &str) -> Result<u64, SceneError> {
        let known = self.known.entry(method.to_owned());
        known.or_insert_with(|| key(self.map, method)).clone()
    }
}

fn key(map: &Map, method: &str) -> Result<u64, SceneError> {
    let mut digest = XxHash3_64::with_seed(0);
    digest.write(&FORMAT.to_le_bytes());
    digest.write(env!("CARGO_PKG_VERSION").as_bytes());
    for cell in 0..map.len() {
        digest.write(map.scene_text(cell, method).as_bytes());
    }
    for (along, up) in PROBES {
        let step = |share: f64, steps: usize| (share * (steps - 1) as f64).round() as usize;
        let column = step(along, map.x.steps.len());
        let row = step(up, map.y.steps.len());
        let ran = native::run_before(&map.scene(map.cell(column, row), method)?, &mut ())?;
        digest.write(&ran.hash.to_le_bytes());
    }
    Ok(digest.finish())
}
