//! What the firmware's estimators are compared with: the field's methods for the frequency of a tone, in
//! time. λ = |v(t − delay)| / f, with the same velocity that the paper's count uses.
//!
//! Nothing here needs more than the board has: the example `estimator_cost` of `firmware-sensor` is built
//! from these same files, so that their instructions are counted where ours are. (For that this module's
//! file is a `mod.rs`: its parts are found from either crate.)

pub mod adapter;
pub mod goertzel;
pub mod harmonic_sum;
pub mod linear_prediction;
pub mod notch;
pub mod phase_lock;
pub mod registry;
pub mod spectrum;

use protocol::GAUGES;

/// The lowest frequency that is looked for, in Hz; `v/λ` of 10 mm/s over 4 mm.
pub const LOWEST_HZ: f32 = 2.5;
/// The highest, in Hz; 120 mm/s over 0.8 mm, and a little more to find its peak in.
pub const HIGHEST_HZ: f32 = 165.0;
/// The gauge that is heard where one is enough: the paper's counted one, which has the largest gain.
pub const HEARD: usize = 2;

/// A method that finds a frequency in the gauges' samples.
pub trait Rival {
    /// Takes a millisecond's sample of every gauge, in ADC steps from mid-rail, behind the anti-aliasing
    /// filter.
    fn push(&mut self, sample: &[f32; GAUGES]);

    /// The frequency in Hz, above 0, as far as it can be told now. Asked for every tenth millisecond.
    fn frequency_hz(&mut self) -> Option<f32>;

    /// How long before the newest sample that frequency was, in half milliseconds, 8 to 400.
    fn age_half_ms(&self) -> usize;
}

/// The last `N` samples of every gauge.
#[derive(Clone, Debug)]
pub struct Window<const N: usize> {
    gauges: [[f32; N]; GAUGES],
    next: usize,
    filled: usize,
}

impl<const N: usize> Default for Window<N> {
    fn default() -> Self {
        Self {
            gauges: [[0.0; N]; GAUGES],
            next: 0,
            filled: 0,
        }
    }
}

impl<const N: usize> Window<N> {
    /// Takes the next sample.
    pub fn push(&mut self, sample: &[f32; GAUGES]) {
        for (lane, x) in self.gauges.iter_mut().zip(sample) {
            lane[self.next] = *x;
        }
        self.next = (self.next + 1) % N;
        self.filled = (self.filled + 1).min(N);
    }

    /// Whether it holds nothing but samples.
    pub fn is_full(&self) -> bool {
        self.filled == N
    }

    /// A gauge's samples, oldest first.
    pub fn samples(&self, gauge: usize) -> [f32; N] {
        let mut samples = self.gauges[gauge];
        samples.rotate_left(self.next);
        samples
    }

    /// The same without their mean.
    pub fn swing(&self, gauge: usize) -> [f32; N] {
        let mut samples = self.samples(gauge);
        let mean = samples.iter().sum::<f32>() / N as f32;
        for x in &mut samples {
            *x -= mean;
        }
        samples
    }

    /// How long before the newest sample the window's middle is, in half ms.
    pub const fn middle_half_ms() -> usize {
        N
    }
}

/// Where the power is highest, in steps, between its neighbours by a parabola through the logarithms.
/// None if it is highest at an end.
pub fn peak(power: &[f32]) -> Option<f32> {
    let (at, highest) = power
        .iter()
        .copied()
        .enumerate()
        .max_by(|one, other| one.1.total_cmp(&other.1))?;
    let before = *power.get(at.checked_sub(1)?)?;
    let after = *power.get(at + 1)?;
    if before <= 0.0 || after <= 0.0 {
        return None;
    }
    let [before, highest, after] = [before, highest, after].map(libm::logf);
    let bend = before - 2.0 * highest + after;
    let aside = if bend < 0.0 {
        0.5 * (before - after) / bend
    } else {
        0.0
    };
    Some(at as f32 + aside)
}
