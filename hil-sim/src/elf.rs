//! The engine that runs the flashed ELFs on emulated boards.

use crate::recording::Recording;
use crate::scene::Scene;

/// Runs a scene.
///
/// # Errors
/// Always: this engine is not built yet.
pub fn run(_scene: &Scene) -> anyhow::Result<Recording> {
    anyhow::bail!("the elf engine is not built yet: give --engine native")
}
