//! The tangential force against the movement.

use protocol::Friction;

use crate::float::sqrt;

/// Travel over which friction is averaged, in mm, and for which it does not count after a turn.
const FRICTION_MM: f32 = 20.0;
/// See [`FRICTION_MM`].
const TURN_MM: f32 = 1.0;

/// Averages of the tangential force against the movement.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rub {
    pub since_turn_mm: f32,
    weight: f32,
    mean_n: f32,
    square_n2: f32,
}

impl Rub {
    /// Takes the tangential force of a millisecond that travelled.
    pub fn push(&mut self, force_n: f32, forwards: bool, travel_mm: f32) {
        self.since_turn_mm += travel_mm;
        if self.since_turn_mm < TURN_MM {
            return;
        }
        let against_n = if forwards { force_n } else { -force_n };
        let follow = travel_mm / (FRICTION_MM + travel_mm);
        self.weight += follow * (1.0 - self.weight);
        let share = follow / self.weight;
        let away_n = against_n - self.mean_n;
        self.mean_n += share * away_n;
        self.square_n2 = (1.0 - share) * (self.square_n2 + share * away_n * away_n);
    }

    /// What is known, once it has travelled a good part of its average.
    pub fn friction(&self) -> Option<Friction> {
        (self.weight > 0.3).then(|| Friction {
            mean_mn: (1_000.0 * self.mean_n + 0.5) as u16,
            fluctuation_mn: (1_000.0 * sqrt(self.square_n2) + 0.5) as u16,
        })
    }
}
