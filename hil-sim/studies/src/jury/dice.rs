//! Chance for the strangers: seeded, and the same on every machine.
//!
//! Only the generator of bits is a crate's. How bits become numbers is written here, so that a seed
//! means the same surface whatever a later version of a crate makes of its distributions.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A seeded source of numbers.
#[derive(Clone, Debug)]
pub struct Dice {
    bits: Xoshiro256PlusPlus,
}

impl Dice {
    /// Dice for one purpose, `stream`, of one trial, `seed`.
    pub fn new(seed: u64, stream: u64) -> Self {
        // Odd, so that no two pairs below 2³² meet.
        let mixed = seed.wrapping_add(stream.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        Self {
            bits: Xoshiro256PlusPlus::seed_from_u64(mixed),
        }
    }

    /// Uniform in 0..1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform between two bounds.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Uniform in the logarithm between two bounds above 0.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        low * libm::exp(libm::log(high / low) * self.uniform())
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// Uniform between two bounds with this probability, else 0. Draws as much either way.
    pub fn sometimes(&mut self, probability: f64, low: f64, high: f64) -> f64 {
        let there = self.chance(probability);
        let value = self.between(low, high);
        if there { value } else { 0.0 }
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.uniform() * count as f64) as usize
    }

    /// 1 or −1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// An angle in 0..2π.
    pub fn angle(&mut self) -> f64 {
        TAU * self.uniform()
    }

    /// Normal, with mean 0 and variance 1, as the sum of eight uniform numbers comes near it (Irwin and
    /// Hall 1927): fast and exact on every machine. Its kurtosis is −0.15, and it ends at ± 4.9.
    pub fn gaussian(&mut self) -> f64 {
        /// Each is uniform over 0..2¹⁶.
        const NUMBERS: f64 = 8.0;
        const STEPS: f64 = 65_536.0;
        const MEAN: f64 = NUMBERS * (STEPS - 1.0) / 2.0;
        // √(8 · (2³² − 1)/12)
        const DEVIATION: f64 = 53_509.919_921;
        let sum: u64 = (0..2)
            .map(|_| {
                let bits = self.bits.next_u64();
                (bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48)
            })
            .sum();
        (sum as f64 - MEAN) * (1.0 / DEVIATION)
    }
}
