//! A partial relative to its fundamental: of a gauge, over gauges, over blocks.

use protocol::Partial;
use protocol::texture::{LARGEST_RATIO, UNITY};

use super::Complex;
use crate::float::sqrt;

/// Blocks over which is averaged.
pub(super) const MEMORY_BLOCKS: f32 = 8.0;

/// Sums of a partial over gauges, or its average over blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PartialSum {
    pub relative: Complex,
    pub fundamental: f32,
    pub variance: f32,
    pub blocks: f32,
}

impl PartialSum {
    pub fn plus(self, other: &Self, share: f32) -> Self {
        Self {
            relative: [
                self.relative[0] + share * other.relative[0],
                self.relative[1] + share * other.relative[1],
            ],
            fundamental: self.fundamental + share * other.fundamental,
            variance: self.variance + share * other.variance,
            blocks: 1.0,
        }
    }

    pub fn follow(&mut self, now: &Self) {
        self.blocks = (self.blocks + 1.0).min(MEMORY_BLOCKS);
        let share = 1.0 / self.blocks;
        for (sum, now) in self.relative.iter_mut().zip(now.relative) {
            *sum += share * (now - *sum);
        }
        self.fundamental += share * (now.fundamental - self.fundamental);
        self.variance += share * (now.variance - self.variance);
    }

    /// The partial, less what chance adds to its power.
    pub fn partial(&self) -> Partial {
        let [re, im] = self.relative;
        if self.fundamental <= 0.0 {
            return Partial::default();
        }
        // Both parts have that variance; an average over n blocks a share of it.
        let chance = 2.0 * self.variance / self.blocks;
        let power = (re * re + im * im - chance).max(0.0);
        let turns = libm::atan2f(im, re) * (0.5 / core::f32::consts::PI);
        Partial {
            ratio: in_units(sqrt(power) / self.fundamental),
            phase: (turns * 65_536.0) as i32 as u16,
        }
    }
}

/// A ratio in 1 / [`UNITY`].
pub(super) fn in_units(ratio: f32) -> u16 {
    ((ratio * f32::from(UNITY) + 0.5) as u16).min(LARGEST_RATIO)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: PartialSum = PartialSum {
        relative: [3.0, 4.0],
        fundamental: 10.0,
        variance: 2.0,
        blocks: 1.0,
    };

    #[test]
    fn gauges_count_by_their_share() {
        let sum = PartialSum::default().plus(&ONE, 1.0).plus(&ONE, 0.5);
        assert_eq!(sum.relative, [4.5, 6.0]);
        assert_eq!(
            (sum.fundamental, sum.variance, sum.blocks),
            (15.0, 3.0, 1.0)
        );
    }

    #[test]
    fn the_first_blocks_count_alike_and_later_ones_an_eighth() {
        let other = PartialSum {
            relative: [0.0; 2],
            fundamental: 0.0,
            variance: 0.0,
            blocks: 1.0,
        };
        let mut average = PartialSum::default();
        for block in 0..8 {
            average.follow(if block % 2 == 0 { &ONE } else { &other });
        }
        assert_eq!(average.relative, [1.5, 2.0]);
        assert_eq!((average.fundamental, average.variance), (5.0, 1.0));
        average.follow(&ONE);
        assert_eq!(average.fundamental, 5.0 + 5.0 / 8.0);
        assert_eq!(average.blocks, MEMORY_BLOCKS);
    }

    #[test]
    fn of_a_partial_chance_is_taken_off() {
        let partial = |sum: PartialSum| {
            let Partial { ratio, phase } = sum.partial();
            (f32::from(ratio) / f32::from(UNITY), phase)
        };
        // √(25 − 2 · 2) / 10, and the angle of 3 + 4i.
        let (ratio, phase) = partial(ONE);
        assert!((ratio - 0.4583).abs() < 0.5 / f32::from(UNITY), "{ratio}");
        let turns = f32::from(phase) / 65_536.0;
        assert!((turns - 0.147_58).abs() < 1e-4, "{turns}");
        // Over four blocks there is a quarter of it.
        let (ratio, _) = partial(PartialSum { blocks: 4.0, ..ONE });
        assert!((ratio - 0.4899).abs() < 0.5 / f32::from(UNITY), "{ratio}");
        // All of it chance, and no fundamental.
        let (ratio, _) = partial(PartialSum {
            variance: 13.0,
            ..ONE
        });
        assert_eq!(ratio, 0.0);
        assert_eq!(
            PartialSum {
                fundamental: 0.0,
                ..ONE
            }
            .partial(),
            Partial::default()
        );
    }
}
