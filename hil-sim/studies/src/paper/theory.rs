//! The paper's equations (7) to (11), in f64.
//!
//! Equation (8) is the mean of |v|/λ over the window, equation (3), for a hand v = α sin(2π fᵥ t), in closed
//! form. It holds for A fᵥ ≤ 1/2, which the paper does not say: within a longer window the hand turns twice.

use std::f64::consts::{PI, TAU};

/// Sampling frequency of equation (10).
const SAMPLE_RATE_HZ: f64 = 1_000.0;
/// Standard deviation of the noise in λe that the paper took.
const NOISE_MM: f64 = 1.0;
/// Reciprocating frequency that the paper took to find A.
pub const HAND_HZ: f64 = 1.0;
/// The window that the paper arrived at.
pub const WINDOW_S: f64 = 0.080;

/// A sinusoidal hand over a surface, counted over a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rub {
    /// A; A fᵥ at most 1/2.
    pub window_s: f64,
    /// λ.
    pub wavelength_mm: f64,
    /// α.
    pub peak_mm_s: f64,
    /// fᵥ.
    pub hand_hz: f64,
}

impl Rub {
    /// Equation (7): v(t) in mm/s.
    pub fn velocity_mm_s(&self, t_s: f64) -> f64 {
        self.peak_mm_s * (TAU * self.hand_hz * t_s).sin()
    }

    /// Equation (4): f(t) in Hz.
    pub fn frequency_hz(&self, t_s: f64) -> f64 {
        self.velocity_mm_s(t_s).abs() / self.wavelength_mm
    }

    /// Whether t is in the range T1: v(t)·v(t − A) ≥ 0.
    pub fn is_t1(&self, t_s: f64) -> bool {
        self.velocity_mm_s(t_s) * self.velocity_mm_s(t_s - self.window_s) >= 0.0
    }

    /// Equation (8): fe(t) in Hz.
    pub fn estimated_hz(&self, t_s: f64) -> f64 {
        let turn = PI * self.hand_hz * self.window_s;
        let middle = TAU * self.hand_hz * (t_s - 0.5 * self.window_s);
        let scale = self.peak_mm_s / (turn * self.wavelength_mm);
        if self.is_t1(t_s) {
            scale * (turn.sin() * middle.sin()).abs()
        } else {
            scale * (1.0 - (turn.cos() * middle.cos()).abs())
        }
    }

    /// Equation (5) without noise: λe(t) in mm.
    pub fn estimated_mm(&self, t_s: f64) -> f64 {
        self.velocity_mm_s(t_s - 0.5 * self.window_s).abs() / self.estimated_hz(t_s)
    }

    /// Equation (9), its first term: the error of λe in T1, in mm.
    pub fn approximation_mm(&self) -> f64 {
        let turn = PI * self.hand_hz * self.window_s;
        self.wavelength_mm * (turn / turn.sin() - 1.0).abs()
    }
}

/// Equation (10): the expected error that noise adds, in mm.
pub fn noise_mm(window_s: f64) -> f64 {
    2.0 * NOISE_MM / (TAU * window_s * SAMPLE_RATE_HZ).sqrt()
}

/// Equation (11): the expected error of λe, in mm.
pub fn error_mm(window_s: f64, wavelength_mm: f64, hand_hz: f64) -> f64 {
    let rub = Rub {
        window_s,
        wavelength_mm,
        peak_mm_s: 1.0,
        hand_hz,
    };
    rub.approximation_mm() + noise_mm(window_s)
}

/// The A that makes equation (11) smallest, in s: golden sections of 1 ms to half a period, within which
/// it falls and then rises.
pub fn best_window_s(wavelength_mm: f64, hand_hz: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (1e-3, 0.5 / hand_hz);
    while high - low > 1e-7 {
        let span = GOLDEN * (high - low);
        let error_mm = |window_s| error_mm(window_s, wavelength_mm, hand_hz);
        if error_mm(high - span) < error_mm(low + span) {
            high = low + span;
        } else {
            low = high - span;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIG_5: Rub = Rub {
        window_s: 0.2,
        wavelength_mm: 2.0,
        peak_mm_s: 100.0,
        hand_hz: 1.0,
    };

    #[test]
    fn equation_8_is_the_integral_of_equation_3() {
        const STEPS: u32 = 20_000;
        for window_s in [0.05, 0.2, 0.5] {
            let rub = Rub { window_s, ..FIG_5 };
            for at in 0..97 {
                let t_s = 1.0 + f64::from(at) / 97.0;
                let step_s = window_s / f64::from(STEPS);
                let sum: f64 = (0..STEPS)
                    .map(|step| rub.frequency_hz(t_s - window_s + (f64::from(step) + 0.5) * step_s))
                    .sum();
                let mean_hz = sum / f64::from(STEPS);
                // The middle rule misses |sin| by (2π h)²/24 of it, and by h² more where it turns.
                assert!(
                    (rub.estimated_hz(t_s) - mean_hz).abs() < 1e-5,
                    "{window_s} {t_s}"
                );
            }
        }
    }

    #[test]
    fn fig_5_is_off_by_a_constant_0_1379_mm_in_t1_which_is_three_fifths_of_the_time() {
        assert!((FIG_5.approximation_mm() - 0.1379).abs() < 0.00005);
        let instants = || (0..10_000).map(|step| 1.0 + f64::from(step) * 1e-4 + 0.3e-4);
        let t1: Vec<f64> = instants().filter(|t_s| FIG_5.is_t1(*t_s)).collect();
        for t_s in &t1 {
            let error_mm = FIG_5.estimated_mm(*t_s) - FIG_5.wavelength_mm;
            assert!((error_mm - FIG_5.approximation_mm()).abs() < 1e-9, "{t_s}");
        }
        // Two turns a second, a window of 0.2 s after each.
        assert_eq!(t1.len(), 6_000);
    }

    #[test]
    fn the_best_windows_are_those_whose_mean_the_paper_took() {
        let best: Vec<f64> = [1.0, 2.0, 3.0, 4.0]
            .map(|mm| best_window_s(mm, HAND_HZ))
            .to_vec();
        for (best_s, expected_s) in best.iter().zip([0.1069, 0.0814, 0.0693, 0.0618]) {
            assert!((best_s - expected_s).abs() < 0.00005 + 1e-7, "{best_s}");
        }
        let mean_s = best.iter().sum::<f64>() / 4.0;
        assert!((mean_s - 0.0798).abs() < 0.0001, "{mean_s}");
        // Searched for in steps of 10 µs by another program.
        const FOUND_S: [(f64, f64); 4] = [
            (1.0, 0.06118),
            (2.0, 0.04664),
            (3.0, 0.03975),
            (4.0, 0.03547),
        ];
        for (mm, expected_s) in FOUND_S {
            let best_s = best_window_s(mm, 2.0);
            assert!((best_s - expected_s).abs() < 1e-5, "{best_s}");
        }
    }
}
