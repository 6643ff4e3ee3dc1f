//! How the hand rubs while an observer compares.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::display::through;
use hil_sim_core::scene::Motion;

/// The paper's Fig. 7: the highest speed, and strokes to and fro a second.
pub const PEAK_MM_S: f64 = 70.0;
pub const FREQUENCY_HZ: f64 = 0.83;
/// How much faster or slower a stroke may be, and longer or shorter last: a guess. Nobody rubs alike twice.
const VARIES: f64 = 0.3;
/// Between two rows of the motion.
const ROW_S: f64 = 1e-3;

/// Strokes to and fro from x = 0 on, each a half sine of speed about Fig. 7's, for `duration_s`.
pub fn strokes(seed: u64, duration_s: f64) -> Motion {
    let mut draws = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut about = |value: f64| value * (1.0 + VARIES * (2.0 * draws.random::<f64>() - 1.0));
    let (mut at, mut values) = (vec![0.0], vec![0.0]);
    let (mut begun_row, mut begun_mm, mut forwards) = (0u32, 0.0, 1.0);
    while f64::from(begun_row) * ROW_S < duration_s {
        let rows = (0.5 / about(FREQUENCY_HZ) / ROW_S).round().max(1.0);
        let length_mm = forwards * about(PEAK_MM_S) * 2.0 / PI * rows * ROW_S;
        let rows = rows as u32;
        for row in 1..=rows {
            let phase = PI * f64::from(row) / f64::from(rows);
            at.push(f64::from(begun_row + row) * ROW_S);
            values.push(begun_mm + length_mm * 0.5 * (1.0 - phase.cos()));
        }
        begun_row += rows;
        begun_mm += length_mm;
        forwards = -forwards;
    }
    through(at, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strokes_go_to_and_fro_about_as_fast_as_fig_7_s() {
        let motion = strokes(3, 6.0);
        let speeds: Vec<f64> = (0..6_000)
            .map(|ms| motion.velocity_mm_s(f64::from(ms) * 1e-3 + 0.5e-3))
            .collect();
        let highest = speeds.iter().fold(0.0f64, |high, v| high.max(v.abs()));
        assert!(highest <= PEAK_MM_S * (1.0 + VARIES) + 1e-6, "{highest}");
        assert!(highest >= PEAK_MM_S * (1.0 - VARIES), "{highest}");
        let turns = speeds.windows(2).filter(|pair| pair[0] * pair[1] < 0.0);
        // 6 s of strokes of 0.46 to 0.86 s.
        assert!((6..=13).contains(&turns.count()));
        assert_eq!(motion.position_mm(0.0), 0.0);
    }
}
