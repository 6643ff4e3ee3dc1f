//! Runs of scenes on the ELFs.

use std::convert::Infallible;
use std::path::Path;

use hil_sim_boards::BoardFacts;
use hil_sim_core::judge::Verdict;
use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::run::batch;
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::Scene;

use crate::elves;

/// A scene that was run on the two ELFs, and what came of it.
#[derive(Debug)]
pub struct Run {
    /// What was run.
    pub scene: Scene,
    /// What the run left behind.
    pub recording: Recording,
    /// The recording, judged.
    pub verdict: Verdict,
    /// What only the emulated boards know.
    pub facts: BoardFacts,
}

impl Run {
    /// Runs `scene`.
    ///
    /// # Panics
    /// If the ELFs can't be used, or a board stops before the scene's end.
    pub fn of(scene: Scene) -> Self {
        let (recording, facts) =
            hil_sim_boards::run(&scene, elves::both()).unwrap_or_else(|error| panic!("{error}"));
        let Outcome {
            scene,
            recording,
            verdict,
            ..
        } = Outcome::new(scene, recording);
        Self {
            scene,
            recording,
            verdict,
            facts,
        }
    }
}

/// The run of each input's scene, in the inputs' order.
///
/// # Panics
/// The same as [`Run::of`].
pub fn runs_of<I: Sync>(inputs: &[I], scene: impl Fn(&I) -> Scene + Sync) -> Vec<Run> {
    let runs: Result<_, Infallible> =
        batch::on_all_cores(inputs, |input| Ok(Run::of(scene(input))));
    let Ok(runs) = runs;
    runs
}

/// A scene from TOML, as a file would hold it; the files it names are relative to `folder`.
///
/// # Panics
/// If the scene is refused.
pub fn scene_in(folder: &Path, toml: &str) -> Scene {
    Scene::parse(&folder.join("scene.toml"), toml).unwrap_or_else(|error| panic!("{error}"))
}

/// A scene from TOML that names no files.
///
/// # Panics
/// If the scene is refused.
pub fn scene(toml: &str) -> Scene {
    scene_in(Path::new(""), toml)
}
