//! What scenes run on: the ELFs on emulated boards, or the firmware's libraries.

use hil_sim_boards::{ElfError, Firmwares};
use hil_sim_core::native;
use hil_sim_core::run::recording::{Engine, Recording};
use hil_sim_core::scene::{Scene, SceneError};

/// An engine, ready.
pub enum Bench {
    /// The firmware's libraries, on this computer.
    Native,
    /// The flashed ELFs, on emulated boards.
    Elf(Box<Firmwares>),
}

/// A run failed.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// On the libraries.
    #[error(transparent)]
    Native(#[from] SceneError),
    /// On the ELFs.
    #[error(transparent)]
    Elf(#[from] ElfError),
}

impl Bench {
    /// Which engine it is.
    pub const fn engine(&self) -> Engine {
        match self {
            Self::Native => Engine::Native,
            Self::Elf(_) => Engine::Elf,
        }
    }

    /// Runs a scene.
    pub fn run(&self, scene: &Scene) -> Result<Recording, BenchError> {
        Ok(match self {
            Self::Native => native::run(scene)?,
            Self::Elf(firmwares) => hil_sim_boards::run(scene, firmwares)?.0,
        })
    }

    /// The hash of a scene's run.
    pub fn hash(&self, scene: &Scene) -> Result<u64, BenchError> {
        Ok(match self {
            Self::Native => native::run_before(scene, &mut ())?.hash,
            Self::Elf(_) => self.run(scene)?.hash,
        })
    }
}
