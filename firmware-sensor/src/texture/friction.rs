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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_is_the_force_against_the_movement_and_how_it_fluctuates() {
        let mut rub = Rub::default();
        // 2 N against the movement, half a newton more and less in turn; after each turn it does not count for 1 mm.
        for stroke in 0..20 {
            let forwards = stroke % 2 == 0;
            rub.since_turn_mm = 0.0;
            for step in 0..1_000 {
                let against_n = match step {
                    ..90 => 50.0,
                    step if step % 2 == 0 => 2.5,
                    _ => 1.5,
                };
                let force_n = if forwards { against_n } else { -against_n };
                rub.push(force_n, forwards, 0.01);
            }
        }
        let friction = rub.friction().expect("200 mm are enough");
        assert!(friction.mean_mn.abs_diff(2_000) <= 1, "{friction:?}");
        assert!(friction.fluctuation_mn.abs_diff(500) <= 1, "{friction:?}");
    }

    #[test]
    fn nothing_is_known_after_a_few_mm() {
        let mut rub = Rub::default();
        let mut travelled_mm = 0.0;
        while rub.friction().is_none() {
            rub.push(1.0, true, 0.5);
            travelled_mm += 0.5;
        }
        // 1 − e^(−x / 20) = 0.3, and the millimetre after the turn.
        assert!((7.5..9.0).contains(&travelled_mm), "{travelled_mm} mm");
    }
}
