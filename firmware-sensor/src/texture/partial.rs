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
