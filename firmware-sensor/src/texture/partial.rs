//! A partial relative to its fundamental: of a gauge, over gauges, over blocks.

use protocol::texture::{LARGEST_RATIO, UNITY};
use protocol::{GAUGES, Partial};

use super::{Complex, times};
use crate::float::sqrt;

/// Blocks over which is averaged.
pub(super) const MEMORY_BLOCKS: f32 = 8.0;

/// How many times what chance adds to a partial's power gauges have to gain by being turned over, to be.
const TURNS_OVER: f32 = 4.0;
/// By how much more of the gauges' power has to lie along an axis than across it for any to be turned over: three quarters
/// and one quarter. Gauges that feel what does not repeat point anywhere.
const ON_AN_AXIS: f32 = 0.5;

/// Sums of a partial over gauges, or its average over blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PartialSum {
    /// What each gauge adds.
    gauges: [Complex; GAUGES],
    /// Their sum, all the same way up.
    relative: Complex,
    fundamental: f32,
    variance: f32,
    blocks: f32,
}

impl PartialSum {
    /// Takes a gauge's: the partial relative to the fundamental's phase and times its amplitude, the fundamental's power,
    /// and the variance of each part of the partial.
    pub fn add(&mut self, gauge: usize, relative: Complex, power: f32, variance: f32) {
        self.gauges[gauge] = relative;
        self.fundamental += power;
        self.variance += power * variance;
    }

    /// Takes a block's, of an even partial or an odd one: that of a wave upside down is the same.
    pub fn follow(&mut self, now: &Self, is_even: bool) {
        self.blocks = (self.blocks + 1.0).min(MEMORY_BLOCKS);
        let share = 1.0 / self.blocks;
        let sums = self.gauges.as_flattened_mut().iter_mut();
        for (sum, now) in sums.zip(now.gauges.as_flattened()) {
            *sum += share * (now - *sum);
        }
        self.fundamental += share * (now.fundamental - self.fundamental);
        self.variance += share * (now.variance - self.variance);
        self.relative = if is_even { self.upright() } else { self.sum() };
    }

    /// What chance adds to the partial's power: both parts have that variance, an average over n blocks a share of it.
    fn chance(&self) -> f32 {
        2.0 * self.variance / self.blocks
    }

    fn sum(&self) -> Complex {
        self.gauges.iter().fold([0.0; 2], |sum, z| plus(sum, *z))
    }

    /// The gauges' sum. One that feels the wave upside down, as before and behind a fingertip's middle, has its even
    /// partials opposite to the others', and is turned over where that shows. The majority is upright, of
    /// three quarters by size; where there is none, what was so before.
    fn upright(&self) -> Complex {
        let (plain, mut squares, mut all) = (self.sum(), [0.0; 2], 0.0);
        for z in &self.gauges {
            squares = plus(squares, times(*z, *z));
            all += power(*z);
        }
        // Their axis: squares do not tell up from down.
        let size = sqrt(power(squares));
        if size < ON_AN_AXIS * all {
            return plain;
        }
        let [re, im] = squares;
        let across = sqrt((size - re).max(0.0));
        let axis = [
            sqrt((size + re).max(0.0)),
            if im < 0.0 { -across } else { across },
        ];
        let along = |[re, im]: Complex| re * axis[0] + im * axis[1];
        let mut turned = [0.0; 2];
        for z in &self.gauges {
            let is_down = along(*z) < 0.0;
            turned = plus(turned, if is_down { z.map(|part| -part) } else { *z });
        }
        if power(turned) - power(plain) <= TURNS_OVER * self.chance() {
            return plain;
        }
        let (mut upright, before) = (along(plain), along(self.relative));
        if before != 0.0 && 2.0 * upright.abs() <= along(turned) {
            upright = before;
        }
        if upright < 0.0 {
            turned.map(|part| -part)
        } else {
            turned
        }
    }

    /// Whether there was a block in which it was to be felt.
    pub fn is_measured(&self) -> bool {
        self.fundamental > 0.0
    }

    /// The partial, less what chance adds to its power; none of it where it was not measured.
    pub fn partial(&self) -> Partial {
        let [re, im] = self.relative;
        if !self.is_measured() {
            return Partial::default();
        }
        let power = (power(self.relative) - self.chance()).max(0.0);
        let turns = libm::atan2f(im, re) * (0.5 / core::f32::consts::PI);
        Partial {
            ratio: in_units(sqrt(power) / self.fundamental),
            phase: (turns * 65_536.0) as i32 as u16,
        }
    }
}

fn power([re, im]: Complex) -> f32 {
    re * re + im * im
}

fn plus([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a + c, b + d]
}

/// A ratio in 1 / [`UNITY`].
pub(super) fn in_units(ratio: f32) -> u16 {
    ((ratio * f32::from(UNITY) + 0.5) as u16).min(LARGEST_RATIO)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of which one gauge tells.
    const ONE: PartialSum = PartialSum {
        gauges: [[3.0, 4.0], [0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]],
        relative: [3.0, 4.0],
        fundamental: 10.0,
        variance: 2.0,
        blocks: 1.0,
    };

    /// An average over one block of what gauges add.
    fn of(gauges: [Complex; GAUGES], variance: f32) -> PartialSum {
        let mut block = PartialSum::default();
        for (gauge, relative) in gauges.into_iter().enumerate() {
            block.add(gauge, relative, 2.0, variance);
        }
        let mut average = PartialSum::default();
        average.follow(&block, true);
        average
    }

    #[test]
    fn gauges_add_up() {
        let sum = of(
            [[3.0, 4.0], [1.0, 0.0], [0.0, 2.0], [0.0; 2], [0.0; 2]],
            0.3,
        );
        assert_eq!(sum.relative, [4.0, 6.0]);
        assert!((sum.fundamental - 10.0).abs() < 1e-6 && (sum.variance - 3.0).abs() < 1e-6);
        assert_eq!(sum.blocks, 1.0);
    }

    #[test]
    fn the_first_blocks_count_alike_and_later_ones_an_eighth() {
        let other = PartialSum::default();
        let mut average = PartialSum::default();
        for block in 0..8 {
            average.follow(if block % 2 == 0 { &ONE } else { &other }, true);
        }
        assert_eq!(average.relative, [1.5, 2.0]);
        assert_eq!((average.fundamental, average.variance), (5.0, 1.0));
        average.follow(&ONE, false);
        assert_eq!(average.fundamental, 5.0 + 5.0 / 8.0);
        assert_eq!(average.blocks, MEMORY_BLOCKS);
    }

    #[test]
    fn a_gauge_is_turned_over_where_more_than_chance_asks_for_it() {
        let [up, down] = [[3.0, 4.0], [-3.0, -4.0]];
        let about = |sum: PartialSum, want: Complex| {
            let off = sum.relative.iter().zip(want);
            assert!(
                off.into_iter().all(|(x, y)| (x - y).abs() < 1e-3),
                "{sum:?}"
            );
        };
        about(of([up, down, up, up, up], 1.0), [15.0, 20.0]);
        about(of([up, down, down, up, down], 1.0), [-15.0, -20.0]);
        // Turned over their power is 625, else 25: 600 more. Chance adds 20 times the variance, and four times that is asked for.
        about(of([up, down, up, down, up], 7.0), [15.0, 20.0]);
        about(of([up, down, up, down, up], 8.0), [3.0, 4.0]);
        // On either side of the negative real axis, where squares turn once more.
        about(
            of(
                [[-4.0, 0.1], [4.0, 0.1], [-4.0, 0.0], [0.0; 2], [0.0; 2]],
                0.1,
            ),
            [-12.0, 0.0],
        );
        about(
            of(
                [[0.1, 4.0], [-0.1, -4.0], [0.0, 4.0], [0.0; 2], [0.0; 2]],
                0.1,
            ),
            [0.2, 12.0],
        );
        // Below the real axis.
        about(
            of(
                [[3.0, -4.0], [-3.0, 4.0], [3.0, -4.0], [0.0; 2], [0.0; 2]],
                0.1,
            ),
            [9.0, -12.0],
        );
        // On no axis: as much across as along, and a little less.
        let about_an_axis = |across: f32| {
            [
                [4.0, 0.0],
                [-4.0, 0.0],
                [0.0, across],
                [0.0, -across],
                [4.0, 0.0],
            ]
        };
        about(of(about_an_axis(4.0), 0.1), [4.0, 0.0]);
        about(of(about_an_axis(2.0), 0.1), [12.0, 0.0]);
    }

    #[test]
    fn an_odd_partial_is_the_same_upside_down() {
        let mut block = PartialSum::default();
        for (gauge, relative) in [[3.0, 4.0], [-3.0, -4.0], [3.0, 4.0]]
            .into_iter()
            .enumerate()
        {
            block.add(gauge, relative, 2.0, 0.1);
        }
        let mut average = PartialSum::default();
        average.follow(&block, false);
        assert_eq!(average.relative, [3.0, 4.0]);
        average.follow(&block, true);
        assert_eq!(average.relative, [9.0, 12.0]);
    }

    #[test]
    fn where_half_are_upside_down_it_stays_as_it_was() {
        let block = |first: f32| {
            let mut block = PartialSum::default();
            for (gauge, height) in [first, -3.0, 3.0, -3.0, 0.0].into_iter().enumerate() {
                block.add(gauge, [0.0, height], 2.0, 0.01);
            }
            block
        };
        for (begins, goes_on) in [(9.0, 2.9), (0.5, 3.1)] {
            let mut average = PartialSum::default();
            (0..8).for_each(|_| average.follow(&block(begins), true));
            let side = average.relative[1].signum();
            for _ in 0..40 {
                average.follow(&block(goes_on), true);
                assert_eq!(average.relative[1].signum(), side, "{average:?}");
            }
            assert!(
                (average.relative[1].abs() - 9.0 - goes_on).abs() < 0.2,
                "{average:?}"
            );
        }
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
