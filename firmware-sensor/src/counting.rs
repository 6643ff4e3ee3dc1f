//! The paper's estimator: zero crossings counted over a window (Okamoto et al. 2009, equations (2),
//! (5) and (8)).
//!
//! Equation (2) sums p(τ) from τ = t − A to t. With both ends that would be A·1 kHz + 1 samples, 81
//! for A = 80 ms, and 2A fe would not be the number of impulses that a window of length A holds: a
//! steady 50 Hz would be counted 8 or 9 times, and never less than 8, instead of always 8. The window
//! is therefore half-open, (t − A, t]: 80 samples, each standing for the crossings in the millisecond
//! that ends with it.

use protocol::{GAUGES, Range, SensorConfiguration};

use crate::amplitude::{Amplitude, MAX_WINDOW_MS};
use crate::crossing::Crossing;
use crate::estimator::{Estimator, Finding, MIN_AMPLITUDE_LSB, Touch};
use crate::travel::{MIN_SPEED_MM_S, Travel};

/// The window A that the paper arrives at, in ms.
pub const PAPERS_WINDOW_MS: usize = 80;

/// The impulses of the last 256 ms.
#[derive(Clone, Debug, Default)]
pub struct Impulses {
    /// Bit b of word w: the impulse of millisecond 32w + b, modulo 256.
    words: [u32; WORDS],
    newest: u8,
    filled_ms: u16,
}

const WORDS: usize = 8;
const _: () = assert!(32 * WORDS == 1 << u8::BITS, "`newest` wraps with the words");
const _: () = assert!(MAX_WINDOW_MS < 32 * WORDS);

impl Impulses {
    /// Takes p(t) of the next millisecond.
    pub fn push(&mut self, impulse: bool) {
        self.newest = self.newest.wrapping_add(1);
        let word = &mut self.words[usize::from(self.newest / 32)];
        let bit = self.newest % 32;
        *word = (*word & !(1 << bit)) | u32::from(impulse) << bit;
        self.filled_ms = (self.filled_ms + 1).min(MAX_WINDOW_MS as u16);
    }

    /// The impulses of the last A = `window_ms`, 1 to [`MAX_WINDOW_MS`], once there have been so many
    /// milliseconds.
    pub fn count(&self, window_ms: usize) -> Option<u16> {
        if window_ms > usize::from(self.filled_ms) {
            return None;
        }
        let mut left = window_ms as u32;
        let mut word = usize::from(self.newest / 32);
        // The window's newest bits end in the middle of a word, at the top after a shift.
        let mut bits = self.words[word] << (31 - self.newest % 32);
        let mut present = u32::from(self.newest % 32) + 1;
        let mut count = 0;
        loop {
            let taken = present.min(left);
            if taken > 0 {
                count += (bits >> (32 - taken)).count_ones();
            }
            left -= taken;
            if left == 0 {
                return Some(count as u16);
            }
            word = (word + WORDS - 1) % WORDS;
            bits = self.words[word];
            present = 32;
        }
    }
}

/// The crossings of one gauge.
#[derive(Clone, Debug)]
pub struct Counted {
    gauge: usize,
    crossing: Crossing,
    impulses: Impulses,
}

/// What a count over a window says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Count {
    /// The crossings in the window; 0 before it is full.
    pub crossings: u16,
    /// v(t − A/2) in mm/s.
    pub velocity_mm_s: f32,
    /// λe in mm, equation (5).
    pub wavelength_mm: Option<f32>,
    /// The range of equation (8).
    pub range: Range,
}

impl Counted {
    /// Nothing counted yet of the gauge that `configuration` names.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        Self {
            gauge: usize::from(configuration.counted_gauge).min(GAUGES - 1),
            crossing: Crossing::default(),
            impulses: Impulses::default(),
        }
    }

    /// The gauge that is counted.
    pub fn gauge(&self) -> usize {
        self.gauge
    }

    /// Takes the counted gauge's next sample behind the band-pass.
    pub fn push(&mut self, banded: f32) {
        let impulse = self.crossing.step(banded);
        self.impulses.push(impulse);
    }

    /// What the window A = `window_ms`, 1 to [`MAX_WINDOW_MS`], says. No wavelength before it is full.
    pub fn over(&self, window_ms: usize, travel: &Travel) -> Count {
        let crossings = self.impulses.count(window_ms).unwrap_or(0);
        // Half of A before now.
        let velocity_mm_s = travel.velocity_mm_s(window_ms);
        Count {
            crossings,
            velocity_mm_s,
            wavelength_mm: wavelength_mm(velocity_mm_s, frequency_hz(crossings, window_ms)),
            range: range(travel.velocity_mm_s(0), travel.velocity_mm_s(2 * window_ms)),
        }
    }
}

/// Counting as an [`Estimator`], with a fixed A.
#[derive(Clone, Debug)]
pub struct Counting {
    window_ms: usize,
    gauge: CountedGauge,
}

impl Counting {
    /// Nothing counted yet.
    pub fn new(configuration: &SensorConfiguration) -> Self {
        Self {
            window_ms: usize::from(configuration.window_ms).clamp(1, MAX_WINDOW_MS),
            gauge: CountedGauge::new(configuration),
        }
    }
}

impl Estimator for Counting {
    fn push(&mut self, touch: &Touch) {
        self.gauge.push(touch);
    }

    fn find(&mut self, travel: &Travel) -> Finding {
        self.gauge.find(self.window_ms, travel)
    }
}

/// The counted gauge and its strength, over a window of any length.
#[derive(Clone, Debug)]
pub(crate) struct CountedGauge {
    counted: Counted,
    amplitude: Amplitude,
    usable: bool,
}

impl CountedGauge {
    pub(crate) fn new(configuration: &SensorConfiguration) -> Self {
        Self {
            counted: Counted::new(configuration),
            amplitude: Amplitude::default(),
            usable: false,
        }
    }

    pub(crate) fn push(&mut self, touch: &Touch) {
        let gauge = self.counted.gauge();
        self.counted.push(touch.counted);
        self.amplitude.push(touch.counted);
        self.usable = touch.usable & 1 << gauge != 0;
    }

    /// λe of the last A = `window_ms`, and what speaks for it.
    ///
    /// Valid: in T1, with a crossing in a full window, a signal, and moving at t − A/2. The confidence is
    /// then 1 − 1/n for n crossings, since a count that may as well have been one less is off by 1/n;
    /// else 0.
    pub(crate) fn find(&self, window_ms: usize, travel: &Travel) -> Finding {
        let count = self.counted.over(window_ms, travel);
        let amplitude_lsb = self.amplitude.over(window_ms);
        let valid = count.wavelength_mm.is_some()
            && count.range == Range::T1
            && count.velocity_mm_s.abs() >= MIN_SPEED_MM_S
            && amplitude_lsb >= MIN_AMPLITUDE_LSB
            && self.usable;
        Finding {
            wavelength_mm: count.wavelength_mm,
            valid,
            confidence: if valid {
                1.0 - 1.0 / f32::from(count.crossings)
            } else {
                0.0
            },
            amplitude_lsb,
            gauges_used: 1 << self.counted.gauge(),
            ..Finding::default()
        }
    }
}

/// fe in Hz, equation (2): `count` impulses, two to a cycle, in a window of `window_ms`.
pub fn frequency_hz(count: u16, window_ms: usize) -> f32 {
    f32::from(count) * 1_000.0 / (2 * window_ms) as f32
}

/// λe in mm, equation (5), from v(t − A/2) in mm/s and fe in Hz. None where the quotient says nothing,
/// at fe = 0 or v = 0.
pub fn wavelength_mm(velocity_mm_s: f32, frequency_hz: f32) -> Option<f32> {
    (frequency_hz > 0.0 && velocity_mm_s != 0.0).then(|| velocity_mm_s.abs() / frequency_hz)
}

/// The range of equation (8): T1 while v(t)·v(t − A) ≥ 0.
pub fn range(velocity_now: f32, velocity_before_window: f32) -> Range {
    if velocity_now * velocity_before_window >= 0.0 {
        Range::T1
    } else {
        Range::T2
    }
}

/// The mean of λe in mm that counting arrives at on a noiseless surface of λ = `wavelength_mm`, rubbed
/// at a steady `speed_mm_s` with A = `window_s`; all above 0.
///
/// A window holds m = 2Av/λ crossings on average, so it holds ⌊m⌋ of them or one more, and λe is
/// 2Av/n: its mean is 2Av·E\[1/n\]. It is not λ, since the mean of 1/n is not 1/m. Windows without a
/// crossing give no estimate and do not count. This is most of the paper's Table I.
pub fn predicted_mean_mm(wavelength_mm: f64, speed_mm_s: f64, window_s: f64) -> f64 {
    let mean_count = 2.0 * window_s * speed_mm_s / wavelength_mm;
    let fewer = libm::floor(mean_count);
    let share_of_more = mean_count - fewer;
    let mean_reciprocal = if fewer < 1.0 {
        1.0
    } else {
        (1.0 - share_of_more) / fewer + share_of_more / (fewer + 1.0)
    };
    2.0 * window_s * speed_mm_s * mean_reciprocal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn has_no_count_before_the_window_is_full() {
        let mut impulses = Impulses::default();
        for _ in 0..79 {
            impulses.push(true);
            assert_eq!(impulses.count(80), None);
        }
        impulses.push(false);
        assert_eq!(impulses.count(80), Some(79));
        assert_eq!(impulses.count(81), None);
    }

    #[test]
    fn counts_the_impulses_of_exactly_the_window() {
        let impulse = |ms: usize| ms * ms % 7 == 2 || ms.is_multiple_of(11);
        let mut impulses = Impulses::default();
        for ms in 0..1_000 {
            impulses.push(impulse(ms));
            for window_ms in [1, 10, 31, 32, 33, 80, 81, 200] {
                let window = (ms + 1).saturating_sub(window_ms)..=ms;
                if let Some(count) = impulses.count(window_ms) {
                    assert_eq!(usize::from(count), window.filter(|&ms| impulse(ms)).count());
                } else {
                    assert!(ms + 1 < window_ms);
                }
            }
        }
    }

    #[test]
    fn counts_a_steady_frequency_that_fits_the_window_without_spread() {
        let mut impulses = Impulses::default();
        for ms in 0..1_000 {
            impulses.push(ms % 10 == 3);
            if let Some(count) = impulses.count(80) {
                assert_eq!(count, 8);
                assert_eq!(frequency_hz(count, 80), 50.0);
            }
        }
    }

    #[test]
    fn divides_speed_by_frequency_where_both_say_something() {
        assert_eq!(wavelength_mm(70.0, 35.0), Some(2.0));
        assert_eq!(wavelength_mm(-70.0, 35.0), Some(2.0));
        assert_eq!(wavelength_mm(70.0, 0.0), None);
        assert_eq!(wavelength_mm(0.0, 35.0), None);
    }

    #[test]
    fn is_in_t1_while_the_velocity_keeps_its_sign() {
        assert_eq!(range(3.0, 1.0), Range::T1);
        assert_eq!(range(-3.0, -1.0), Range::T1);
        assert_eq!(range(0.0, -1.0), Range::T1);
        assert_eq!(range(3.0, -1.0), Range::T2);
    }
}
