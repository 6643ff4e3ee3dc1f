//! Spawning at start-up.

use embassy_executor::{SpawnError, SpawnToken};

/// A task that start-up spawns once, so that its memory can't be taken.
pub fn once<S>(task: Result<SpawnToken<S>, SpawnError>) -> SpawnToken<S> {
    let Ok(token) = task else {
        defmt::panic!("a task was spawned more often than there is memory for");
    };
    token
}
