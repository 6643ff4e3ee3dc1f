//! The paper's estimator: zero crossings counted over a window (Okamoto et al. 2009, equations (2),
//! (5) and (8)).
//!
//! Equation (2) sums p(τ) from τ = t − A to t. With both ends that would be A·1 kHz + 1 samples, 81
//! for A = 80 ms, and 2A fe would not be the number of impulses that a window of length A holds: a
//! steady 50 Hz would be counted 8 or 9 times, and never less than 8, instead of always 8. The window
//! is therefore half-open, (t − A, t]: 80 samples, each standing for the crossings in the millisecond
//! that ends with it.

use protocol::Range;

/// The longest window that a configuration can ask for, in ms.
pub const MAX_WINDOW_MS: usize = 200;

/// The impulses of the last A, and how many they are.
#[derive(Clone, Debug)]
pub struct Counting {
    impulses: [bool; MAX_WINDOW_MS],
    window_ms: usize,
    next: usize,
    filled_ms: usize,
    count: u16,
}

impl Counting {
    /// An empty window of A = `window_ms`, which is 1 to [`MAX_WINDOW_MS`]; else the nearest of them.
    pub fn new(window_ms: u16) -> Self {
        Self {
            impulses: [false; MAX_WINDOW_MS],
            window_ms: usize::from(window_ms).clamp(1, MAX_WINDOW_MS),
            next: 0,
            filled_ms: 0,
            count: 0,
        }
    }

    /// Takes p(t) of the next millisecond.
    pub fn push(&mut self, impulse: bool) {
        let oldest = core::mem::replace(&mut self.impulses[self.next], impulse);
        self.count = self.count + u16::from(impulse) - u16::from(oldest);
        self.next = if self.next + 1 == self.window_ms {
            0
        } else {
            self.next + 1
        };
        self.filled_ms = (self.filled_ms + 1).min(self.window_ms);
    }

    /// The impulses in the window, once it has been filled.
    pub fn count(&self) -> Option<u16> {
        (self.filled_ms == self.window_ms).then_some(self.count)
    }

    /// A in ms.
    pub fn window_ms(&self) -> usize {
        self.window_ms
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
        let mut counting = Counting::new(80);
        for _ in 0..79 {
            counting.push(true);
            assert_eq!(counting.count(), None);
        }
        counting.push(false);
        assert_eq!(counting.count(), Some(79));
    }

    #[test]
    fn counts_the_impulses_of_exactly_the_window() {
        for window_ms in [10, 80, 81, 200] {
            let mut counting = Counting::new(window_ms);
            let impulse = |ms: usize| ms * ms % 7 == 2 || ms.is_multiple_of(11);
            for ms in 0..1_000 {
                counting.push(impulse(ms));
                let window = (ms + 1).saturating_sub(usize::from(window_ms))..=ms;
                if let Some(count) = counting.count() {
                    assert_eq!(usize::from(count), window.filter(|&ms| impulse(ms)).count());
                }
            }
        }
    }

    #[test]
    fn counts_a_steady_frequency_that_fits_the_window_without_spread() {
        let mut counting = Counting::new(80);
        for ms in 0..1_000 {
            counting.push(ms % 10 == 3);
            if let Some(count) = counting.count() {
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
