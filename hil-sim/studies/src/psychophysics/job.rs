//! What experiments run: both boards in a scene, or the display alone.

use crate::bench::{Bench, BenchError};
use crate::psychophysics::given::StimulusSequence;
use hil_sim_core::run::batch::on_all_cores;
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::Scene;

/// Something to be run.
#[derive(Clone, Debug)]
pub enum Job {
    /// Both boards in a scene.
    Pair(Box<Scene>),
    /// The display alone.
    Display(StimulusSequence),
}

impl Job {
    pub(crate) fn pair(scene: Scene) -> Self {
        Self::Pair(Box::new(scene))
    }

    fn run(&self, bench: &Bench) -> Result<Recording, BenchError> {
        Ok(match (self, bench) {
            (Job::Pair(scene), _) => bench.run(scene)?,
            (Job::Display(course), Bench::Native) => course.on_library(),
            (Job::Display(course), Bench::Elf(firmwares)) => course.on_elf(&firmwares.display)?,
        })
    }
}

/// Runs all jobs, as many at a time as there are cores, and returns what they left, in their order.
/// `done` is told after each.
pub fn run(
    bench: &Bench,
    jobs: &[Job],
    done: impl Fn(&Job) + Sync,
) -> Result<Vec<Recording>, BenchError> {
    on_all_cores(jobs, |job| {
        let recording = job.run(bench);
        done(job);
        recording
    })
}
