//! How strong the band-passed signal was over the window.

use crate::float::sqrt;

/// The longest window that a configuration can ask for, in ms.
pub const MAX_WINDOW_MS: usize = 200;

/// The last samples of a band-passed gauge.
#[derive(Clone, Debug)]
pub struct Amplitude {
    samples: [f32; MAX_WINDOW_MS],
    next: usize,
}

impl Default for Amplitude {
    fn default() -> Self {
        Self {
            samples: [0.0; MAX_WINDOW_MS],
            next: 0,
        }
    }
}

impl Amplitude {
    /// Takes the next sample.
    pub fn push(&mut self, sample: f32) {
        self.samples[self.next] = sample;
        self.next = (self.next + 1) % MAX_WINDOW_MS;
    }

    /// √2 times the RMS of the last `window_ms` samples: a sine's amplitude, in the samples' unit.
    ///
    /// Summed afresh each time it is asked for (at 100 Hz), since a running sum in f32 would drift.
    pub fn over(&self, window_ms: usize) -> f32 {
        let window_ms = window_ms.clamp(1, MAX_WINDOW_MS);
        let (newer, older) = self.samples.split_at(self.next.min(MAX_WINDOW_MS));
        let newest_first = newer.iter().rev().chain(older.iter().rev());
        let energy: f32 = newest_first.take(window_ms).map(|x| x * x).sum();
        sqrt(2.0 * energy / window_ms as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_the_amplitude_of_a_sine_over_whole_cycles() {
        let mut amplitude = Amplitude::default();
        for ms in 0..531 {
            let t_s = f64::from(ms) / 1_000.0;
            amplitude
                .push((100.0 * libm::sin(2.0 * core::f64::consts::PI * 50.0 * t_s + 0.7)) as f32);
        }
        // 80 squares and their sum, each rounded once, under a root.
        let bound = 100.0 * 81.0 * f32::EPSILON;
        assert!((amplitude.over(80) - 100.0).abs() < bound);
        assert!((amplitude.over(200) - 100.0).abs() < 100.0 * 201.0 * f32::EPSILON);
    }

    #[test]
    fn looks_at_the_window_only() {
        let mut amplitude = Amplitude::default();
        for x in [1_000.0, 3.0, -3.0, 3.0] {
            amplitude.push(x);
        }
        assert_eq!(amplitude.over(3), libm::sqrtf(18.0));
        assert!(amplitude.over(4) > 500.0);
    }
}
