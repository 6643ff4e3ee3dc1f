//! The white noise of each gauge, from its scans.
//!
//! The third difference of four consecutive scans passes what lies above 1 kHz, where a fingertip says
//! nothing, and next to nothing of what lies below: of a tone of 100 Hz 1.5e-5 of the power. Of white
//! noise it is 1² + 3² + 3² + 1² = 20 times the variance.

use protocol::GAUGES;

use crate::{SCANS_PER_SAMPLE, Scan, decimate};

/// Power gain of the third difference for white noise.
const DIFFERENCE_GAIN: f32 = 20.0;
/// Time constant in looks at a gauge: one gauge has its turn each millisecond.
const FOLLOWED_LOOKS: f32 = 100.0;

/// Variances so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    variances: [f32; GAUGES],
    next: usize,
    looks: u32,
}

impl Noise {
    /// Takes a millisecond's scans.
    pub fn push(&mut self, scans: &[Scan; SCANS_PER_SAMPLE]) {
        let gauge = self.next;
        if gauge == 0 {
            self.looks = self.looks.saturating_add(1);
        }
        self.next = if gauge + 1 == GAUGES { 0 } else { gauge + 1 };
        let follow = 1.0 / (self.looks as f32).min(FOLLOWED_LOOKS);
        let [a, b, c, d] = scans.map(|scan| i32::from(scan[gauge]));
        let third = (d - a - 3 * (c - b)) as f32;
        let variance = third * third * (decimate::NOISE_GAIN / DIFFERENCE_GAIN);
        self.variances[gauge] += follow * (variance - self.variances[gauge]);
    }

    /// Variance of the white noise in each gauge behind the anti-aliasing filter, in ADC steps². 0 for
    /// a gauge that has not had its turn.
    pub fn variances(&self) -> [f32; GAUGES] {
        self.variances
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::CHANNELS;

    fn run(mut code: impl FnMut(usize) -> f64) -> f32 {
        let mut noise = Noise::default();
        for ms in 0..20_000 {
            noise.push(&core::array::from_fn(|scan| {
                [libm::round(code(ms * SCANS_PER_SAMPLE + scan)) as u16; CHANNELS]
            }));
        }
        noise.variances()[3]
    }

    #[test]
    fn measures_white_noise_to_within_its_own_spread() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        // Uniform over ±60: variance 60²/3, and 1/12 of the rounding.
        let variance = run(|_| 2_048.0 + 120.0 * (uniform() - 0.5));
        let want = (60.0 * 60.0 / 3.0 + 1.0 / 12.0) * f64::from(decimate::NOISE_GAIN);
        // 200 squares in the mean, each as uncertain as it is large, √2: six of their deviations.
        let bound = 6.0 * libm::sqrt(2.0 / 200.0);
        assert!(
            (f64::from(variance) / want - 1.0).abs() < bound,
            "{variance} not {want}"
        );
    }

    #[test]
    fn does_not_take_a_texture_for_noise() {
        // 100 Hz of 400 steps: 1.5e-5 · 400²/2 · 0.22 / 20 = 0.013, beside the ADC's own rounding.
        let variance = run(|scan| {
            2_048.0 + 400.0 * libm::sin(2.0 * core::f64::consts::PI * 100.0 * scan as f64 / 4_000.0)
        });
        assert!(variance < 0.2, "{variance}");
    }
}
