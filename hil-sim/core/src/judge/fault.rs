//! What became of a fault, beside what the table of kinds says of it: whether it showed, what the outputs did, what
//! went on, and how it ended.
//!
//! A fault is judged by itself until the next one of the scene begins; whether the display stays stopped, until its
//! power goes. One that is shorter than its kind's default, or too small to be told from a sound board, need not be
//! seen; it must do no harm. Nor is judged what the scene's end leaves no time for: [`Finding::unjudged`] says so.

mod conduct;
mod due;
mod finding;
mod monitor;
mod outputs;
mod signs;
mod step;
#[cfg(test)]
mod tests;

use crate::judge::fault::monitor::FaultMonitor;
use crate::run::observer::{RunEvent, RunObserver, replay_to};
use crate::run::recording::Recording;
use crate::scene::Scene;

pub use finding::Finding;

/// Judges every fault of a recording of `scene`.
pub fn judge(scene: &Scene, recording: &Recording) -> Vec<Finding> {
    let mut judge = Judge::new(scene);
    replay_to(recording, &mut judge);
    judge.finish()
}

/// Judges one fault of a scene by what came before `until_ns`.
pub fn finding(scene: &Scene, fault: usize, until_ns: u64, recording: &Recording) -> Finding {
    let mut monitor = FaultMonitor::new(scene, fault, until_ns);
    replay_to(recording, &mut monitor);
    monitor.finish()
}

/// Judges the faults of a run as it goes on: what is kept of each does not grow.
#[derive(Clone, Debug)]
pub struct Judge {
    monitors: Vec<FaultMonitor>,
}

impl Judge {
    /// Before a run of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let end_ns = (scene.duration_s * 1e9) as u64;
        let monitors = 0..scene.faults.len();
        Self {
            monitors: monitors
                .map(|fault| FaultMonitor::new(scene, fault, end_ns))
                .collect(),
        }
    }

    /// What became of each fault.
    pub fn finish(self) -> Vec<Finding> {
        let finished = self.monitors.into_iter().map(FaultMonitor::finish);
        finished.collect()
    }
}

impl RunObserver for Judge {
    fn see(&mut self, event: RunEvent<'_>) {
        self.monitors[..].see(event);
    }
}
