//! The tangential force against the movement.

use protocol::Friction;

use crate::float::sqrt;

/// Travel over which friction is averaged, in mm, and for which it does not count after a turn.
const FRICTION_MM: f32 = 20.0;
/// See [`FRICTION_MM`].
const TURN_MM: f32 = 1.0;
/// Strokes of less travel in mm, or less than half of it on a surface that is known, tell nothing of the channel's zero.
const STROKE_MM: f32 = 3.0;
/// Turns over which the zero is averaged.
const TURNS: f32 = 8.0;

/// Averages of the tangential force against the movement.
///
/// What the channel reads at rest adds to it one way and takes from it the other: half the sum of two strokes' means is that
/// zero.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rub {
    since_turn_mm: f32,
    weight: f32,
    mean_n: f32,
    square_n2: f32,
    zero_n: f32,
    turns: f32,
    /// The stroke's travel in mm on a surface that is known, force times that in N mm, and the mean in N of the stroke before.
    stroke_mm: f32,
    stroke_n_mm: f32,
    before_n: Option<f32>,
}

impl Rub {
    /// Takes the tangential force of a millisecond that travelled, on a surface that is known or not: air is not.
    ///
    /// Inlined, it would cost each millisecond its registers, also without a force channel.
    #[inline(never)]
    pub fn push(&mut self, force_n: f32, back: bool, travel_mm: f32, known: bool) {
        self.since_turn_mm += travel_mm;
        if self.since_turn_mm < TURN_MM {
            return;
        }
        if known {
            self.stroke_mm += travel_mm;
            self.stroke_n_mm += force_n * travel_mm;
        }
        let above_n = force_n - self.zero_n;
        let against_n = if back { -above_n } else { above_n };
        let follow = travel_mm / (FRICTION_MM + travel_mm);
        self.weight += follow * (1.0 - self.weight);
        let share = follow / self.weight;
        let away_n = against_n - self.mean_n;
        self.mean_n += share * away_n;
        self.square_n2 = (1.0 - share) * (self.square_n2 + share * away_n * away_n);
    }

    /// The stroke has turned. Not inlined for the same reason.
    #[inline(never)]
    pub fn turn(&mut self) {
        let tells = self.stroke_mm >= STROKE_MM.max(0.5 * self.since_turn_mm);
        let mean_n = tells.then(|| self.stroke_n_mm / self.stroke_mm);
        self.since_turn_mm = 0.0;
        self.stroke_mm = 0.0;
        self.stroke_n_mm = 0.0;
        let before_n = core::mem::replace(&mut self.before_n, mean_n);
        if let Some((mean_n, before_n)) = mean_n.zip(before_n) {
            self.turns = (self.turns + 1.0).min(TURNS);
            self.zero_n += (0.5 * (mean_n + before_n) - self.zero_n) / self.turns;
        }
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
            let back = stroke % 2 == 1;
            rub.turn();
            for step in 0..1_000 {
                let against_n = match step {
                    ..90 => 50.0,
                    step if step % 2 == 0 => 2.5,
                    _ => 1.5,
                };
                let force_n = if back { -against_n } else { against_n };
                rub.push(force_n, back, 0.01, true);
            }
        }
        let friction = rub.friction().expect("200 mm are enough");
        assert!(friction.mean_mn.abs_diff(2_000) <= 1, "{friction:?}");
        assert!(friction.fluctuation_mn.abs_diff(500) <= 1, "{friction:?}");
    }

    #[test]
    fn what_the_channel_reads_at_rest_is_no_friction() {
        let mut rub = Rub::default();
        // 0.2 N against the movement, 0.05 N at rest.
        let force_n = |back| if back { -0.15 } else { 0.25 };
        let mut stroke = |back, mm: u32, force_n: f32, known| {
            for _ in 0..100 * mm {
                rub.push(force_n, back, 0.01, known);
            }
            rub.turn();
            rub.friction()
        };
        // One way alone nobody can know.
        let first = stroke(false, 10, force_n(false), true);
        assert_eq!(first.map(|told| told.mean_mn), Some(250));
        for number in 1..10 {
            let back = number % 2 == 1;
            stroke(back, 10, force_n(back), true);
        }
        let told = stroke(false, 10, force_n(false), true).expect("100 mm are enough");
        assert!(told.mean_mn.abs_diff(200) <= 5, "{told:?}");
        assert!(told.fluctuation_mn <= 15, "{told:?}");
        // A stroke that is cut short tells nothing of it, nor one whose surface is not known: where the fingertip flies back,
        // the channel reads what it does at rest. Had either counted, it would be 0.15 N.
        for (back_mm, known) in [(2, true), (10, false)] {
            for _ in 0..20 {
                stroke(true, back_mm, 0.05, known);
                let told = stroke(false, 30, force_n(false), true).expect("more than enough");
                // Of the way back 0.2 N less, and a fifth of it is left.
                assert!(told.mean_mn > 150, "{told:?}");
            }
            for number in 0..20 {
                let back = number % 2 == 0;
                stroke(back, 10, force_n(back), true);
            }
            let told = stroke(true, 10, force_n(true), true).expect("more than enough");
            assert!(told.mean_mn.abs_diff(200) <= 5, "{told:?}");
        }
    }

    #[test]
    fn nothing_is_known_after_a_few_mm() {
        let mut rub = Rub::default();
        let mut travelled_mm = 0.0;
        while rub.friction().is_none() {
            rub.push(1.0, false, 0.5, true);
            travelled_mm += 0.5;
        }
        // 1 − e^(−x / 20) = 0.3, and the millimetre after the turn.
        assert!((7.5..9.0).contains(&travelled_mm), "{travelled_mm} mm");
    }
}
