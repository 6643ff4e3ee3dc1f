//! What experiments run on: the ELFs on emulated boards, or the firmware's libraries.

use thiserror::Error;

use crate::psychophysics::given::StimulusSequence;
use hil_sim_boards;
use hil_sim_boards::{ElfError, Firmwares};
use hil_sim_core::native;
use hil_sim_core::run::batch::on_all_cores;
use hil_sim_core::run::recording::{Engine, Recording};
use hil_sim_core::scene::{Scene, SceneError};

/// An engine, ready.
pub enum Bench {
    /// The firmware's libraries, on this computer.
    Native,
    /// The flashed ELFs, on emulated boards.
    Elf(Box<Firmwares>),
}

/// Something to be run.
#[derive(Clone, Debug)]
pub enum Job {
    /// Both boards in a scene.
    Pair(Box<Scene>),
    /// The display alone.
    Display(StimulusSequence),
}

/// A job failed.
#[derive(Debug, Error)]
pub enum BenchError {
    /// On the libraries.
    #[error(transparent)]
    Native(#[from] SceneError),
    /// On the ELFs.
    #[error(transparent)]
    Elf(#[from] ElfError),
}

impl Job {
    /// A scene with both boards.
    pub fn pair(scene: Scene) -> Self {
        Self::Pair(Box::new(scene))
    }

    /// Virtual time that it takes, in s.
    pub fn duration_s(&self) -> f64 {
        match self {
            Job::Pair(scene) => scene.duration_s,
            Job::Display(course) => course.duration_s(),
        }
    }
}

impl Bench {
    /// Which engine it is.
    pub const fn engine(&self) -> Engine {
        match self {
            Bench::Native => Engine::Native,
            Bench::Elf(_) => Engine::Elf,
        }
    }

    /// Runs all jobs, as many at a time as there are cores, and returns what they left, in their order.
    /// `done` is told after each.
    ///
    /// # Errors
    /// The first job's that failed.
    pub fn run(
        &self,
        jobs: &[Job],
        done: impl Fn(&Job) + Sync,
    ) -> Result<Vec<Recording>, BenchError> {
        on_all_cores(jobs, |job| {
            let recording = self.run_one(job);
            done(job);
            recording
        })
    }

    fn run_one(&self, job: &Job) -> Result<Recording, BenchError> {
        Ok(match (self, job) {
            (Bench::Native, Job::Pair(scene)) => native::run(scene)?,
            (Bench::Native, Job::Display(course)) => course.on_library(),
            (Bench::Elf(firmwares), Job::Pair(scene)) => hil_sim_boards::run(scene, firmwares)?.0,
            (Bench::Elf(firmwares), Job::Display(course)) => course.on_elf(&firmwares.display)?,
        })
    }
}
