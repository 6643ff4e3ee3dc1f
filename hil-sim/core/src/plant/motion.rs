//! Where the hand is, and what its encoder says.
use crate::scene::Motion;

/// No hand is faster, in mm/s.
const FASTEST_MM_S: f64 = 1_000.0;
/// Travel for one count of either encoder, in mm: 5 µm.
pub const MM_PER_COUNT: f64 = 0.005;

/// The 16-bit counter of an encoder at `position_mm`: counts of 5 µm, wrapping.
pub fn encoder(position_mm: f64) -> u16 {
    coarse_encoder(position_mm, 1)
}

/// The same of an encoder that goes on by `step_counts` at a time, 1 or more.
pub fn coarse_encoder(position_mm: f64, step_counts: u16) -> u16 {
    let counts = (position_mm / MM_PER_COUNT).floor() as i64;
    // Two's complement: a negative position wraps downwards.
    match i64::from(step_counts) {
        1 => counts as u16,
        step_counts => (counts.div_euclid(step_counts) * step_counts) as u16,
    }
}

impl Motion {
    /// The hand's position x in mm, `t_s` after the start.
    pub fn position_mm(&self, t_s: f64) -> f64 {
        match self {
            Motion::Constant { speed_mm_s } => speed_mm_s * t_s,
            Motion::Sinusoid {
                amplitude_mm_s,
                frequency_hz,
            } => {
                let omega = std::f64::consts::TAU * frequency_hz;
                amplitude_mm_s / omega * (1.0 - libm::cos(omega * t_s))
            }
            Motion::Recorded(positions) => positions.value(positions.row(t_s, 0), 0, t_s),
            Motion::Live(hand) => hand.position_mm(t_s),
        }
    }

    /// The hand's velocity v in mm/s, `t_s` after the start.
    pub fn velocity_mm_s(&self, t_s: f64) -> f64 {
        match self {
            Motion::Constant { speed_mm_s } => *speed_mm_s,
            Motion::Sinusoid {
                amplitude_mm_s,
                frequency_hz,
            } => amplitude_mm_s * libm::sin(std::f64::consts::TAU * frequency_hz * t_s),
            Motion::Recorded(positions) => positions.slope(positions.row(t_s, 0), 0, t_s),
            Motion::Live(hand) => hand.velocity_mm_s(t_s),
        }
    }

    /// No velocity is higher, in mm/s.
    pub fn top_speed_mm_s(&self) -> f64 {
        match self {
            Motion::Constant { speed_mm_s } => speed_mm_s.abs(),
            Motion::Sinusoid { amplitude_mm_s, .. } => amplitude_mm_s.abs(),
            Motion::Recorded(positions) => (1..positions.at.len())
                .map(|row| positions.slope(row - 1, 0, positions.at[row - 1]).abs())
                .fold(0.0, f64::max),
            Motion::Live(_) => FASTEST_MM_S,
        }
    }

    /// Where a recording that belongs to the motion is at `t_s`: there, unless it is played to and fro.
    pub fn played_s(&self, t_s: f64) -> f64 {
        match self {
            Motion::Live(hand) => hand.played_s(t_s),
            _ => t_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Series;
    use std::sync::Arc;

    #[test]
    fn velocity_is_the_slope_of_position() {
        let recorded = Series {
            at: vec![0.0, 0.5, 2.0],
            values: vec![1.0, 11.0, -19.0],
            width: 1,
        };
        let motions = [
            Motion::Constant { speed_mm_s: -30.0 },
            Motion::Sinusoid {
                amplitude_mm_s: 70.0,
                frequency_hz: 0.83,
            },
            Motion::Recorded(Arc::new(recorded)),
        ];
        // Central difference over 2h: the error is h²/6 · v'' ≤ 1e-8/6 · 70 · (2π 0.83)² = 3.2e-6.
        let h = 1e-4;
        for motion in motions {
            for t in [0.1, 0.4, 0.7, 1.3] {
                let slope = (motion.position_mm(t + h) - motion.position_mm(t - h)) / (2.0 * h);
                assert!(
                    (slope - motion.velocity_mm_s(t)).abs() < 4e-6,
                    "{motion:?} at {t}"
                );
            }
        }
    }

    #[test]
    fn the_encoder_wraps_in_both_directions() {
        assert_eq!(encoder(0.0), 0);
        assert_eq!(encoder(0.0049), 0);
        assert_eq!(encoder(1.0025), 200);
        assert_eq!(encoder(-0.001), 65_535);
        assert_eq!(encoder(65_536.0 * 0.005 + 0.001), 0);
    }

    #[test]
    fn a_coarse_encoder_stands_on_whole_steps_and_wraps_as_a_fine_one() {
        for (position_mm, fine) in [(0.0, 0), (1.0025, 200), (-0.001, 65_535)] {
            assert_eq!(coarse_encoder(position_mm, 1), fine);
        }
        // Steps of 50 µm: ten counts.
        assert_eq!(coarse_encoder(0.0499, 10), 0);
        assert_eq!(coarse_encoder(0.0501, 10), 10);
        assert_eq!(coarse_encoder(-0.001, 10), 65_526);
        assert_eq!(coarse_encoder(65_540.0 * 0.005 + 0.001, 10), 4);
    }

    #[test]
    fn a_recorded_hand_rests_after_its_last_row() {
        let recorded = Series {
            at: vec![0.0, 1.0],
            values: vec![0.0, 5.0],
            width: 1,
        };
        let motion = Motion::Recorded(Arc::new(recorded));
        assert_eq!(motion.position_mm(9.0), 5.0);
        assert_eq!(motion.velocity_mm_s(9.0), 0.0);
    }
}
