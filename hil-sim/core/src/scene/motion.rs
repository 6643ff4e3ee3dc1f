//! How the operator's hand moves.

use std::fmt::Debug;
use std::sync::Arc;

use super::Series;

/// `[motion]`: the operator's hand. Its methods are in [`crate::plant::motion`].
#[derive(Clone, Debug)]
pub enum Motion {
    /// One speed from the start on.
    Constant {
        /// In mm/s, −1000 to 1000. Default 50.
        speed_mm_s: f64,
    },
    /// v = amplitude · sin(2π · frequency · t), from x = 0 on.
    Sinusoid {
        /// The highest speed in mm/s, 0 to 1000.
        amplitude_mm_s: f64,
        /// In Hz, above 0, to 20.
        frequency_hz: f64,
    },
    /// Measured positions, straight lines between them, from CSV, WAV or MCAP: see `docs/src/how-to/recordings.md`.
    Recorded(Arc<Series>),
    /// Moved while the scene runs. No file has it.
    Live(Arc<dyn LiveHand>),
}

/// A hand that is moved while a scene runs, by whoever runs it. Whoever asks about one instant gets one answer,
/// whenever they ask.
pub trait LiveHand: Debug + Send + Sync {
    /// Where the hand is at `t_s`, in mm.
    fn position_mm(&self, t_s: f64) -> f64;

    /// How fast it moves, in mm/s.
    fn velocity_mm_s(&self, t_s: f64) -> f64;

    /// Where in a recording that belongs to the motion `t_s` is, in s.
    fn played_s(&self, t_s: f64) -> f64;
}
