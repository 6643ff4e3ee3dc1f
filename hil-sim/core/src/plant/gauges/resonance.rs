//! The sensor's body rings: a low-pass of second order between the texture and the gauges,
//! ÿ + 2ζω·ẏ + ω²·y = ω²·u.
//!
//! Solved exactly for a u that is straight between two scans, so the only delay is the body's own:
//! 2ζ/ω for slow signals.

use std::f64::consts::TAU;

use super::SCAN_RATE_HZ;
use crate::scene;

/// What one scan does to every gauge's [`Ring`].
#[derive(Clone, Copy, Debug)]
pub struct Resonance {
    /// y after a scan, from the deviation and its slope before.
    keep: [[f64; 2]; 2],
    /// How far a steady slope of the input leaves y behind, in scans: 2ζ/ω.
    behind_scans: f64,
}

/// A gauge's y, its slope per scan, and the input before.
#[derive(Clone, Copy, Debug)]
pub struct Ring {
    y: f64,
    slope: f64,
    input: f64,
}

impl Resonance {
    /// A resonance at `hz` without damping, with a damping ratio ζ between 0 and 1.
    pub fn new(resonance: scene::Resonance) -> Self {
        let zeta = resonance.damping;
        // In radians per scan.
        let omega = TAU * resonance.hz / f64::from(SCAN_RATE_HZ);
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let decay = libm::exp(-zeta * omega);
        let (sine, cosine) = libm::sincos(damped);
        let lead = zeta * omega / damped * sine;
        Self {
            keep: [
                [decay * (cosine + lead), decay * sine / damped],
                [
                    -decay * omega * omega / damped * sine,
                    decay * (cosine - lead),
                ],
            ],
            behind_scans: 2.0 * zeta / omega,
        }
    }

    /// One scan on: the input has gone straight to `input`. A ring that is `None` starts at rest.
    #[inline]
    pub fn step(&self, ring: &mut Option<Ring>, input: f64) -> f64 {
        let before = ring.unwrap_or(Ring {
            y: input,
            slope: 0.0,
            input,
        });
        let rate = input - before.input;
        let behind = self.behind_scans * rate;
        // The deviation from the solution that follows a straight input for ever.
        let (y, slope) = (before.y - (before.input - behind), before.slope - rate);
        let [[a, b], [c, d]] = self.keep;
        let after = Ring {
            y: input - behind + a * y + b * slope,
            slope: rate + c * y + d * slope,
            input,
        };
        *ring = Some(after);
        after.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GUESS: scene::Resonance = scene::Resonance {
        hz: 180.0,
        damping: 0.15,
    };

    /// Amplitude and delay in s of the answer to a sine of `hz`, once the start has died away.
    fn answer(hz: f64) -> (f64, f64) {
        let resonance = Resonance::new(GUESS);
        let mut ring = None;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for scan in 0..12_000 {
            let angle = TAU * hz * f64::from(scan) / f64::from(SCAN_RATE_HZ);
            let y = resonance.step(&mut ring, angle.sin());
            // e^(−ζω · 1 s) is nothing; two whole seconds are whole cycles.
            if scan >= 4_000 {
                sine += y * angle.sin();
                cosine += y * angle.cos();
            }
        }
        (
            sine.hypot(cosine) / 4_000.0,
            (-cosine).atan2(sine) / (TAU * hz),
        )
    }

    #[test]
    fn slow_textures_pass_the_resonance_stands_out_and_fast_ones_are_lost() {
        for hz in [5.0f64, 50.0, 180.0, 360.0] {
            let ratio = hz / 180.0;
            let (real, imaginary) = (1.0 - ratio * ratio, 0.3 * ratio);
            let (amplitude, delay_s) = answer(hz);
            // Straight lines between the samples of a sine: its amplitude falls by sinc²(f/4000), which
            // is 1 − (π f/4000)²/3, and no phase.
            let line = 1.0 - (TAU / 2.0 * hz / 4000.0).powi(2) / 3.0;
            let due = line / real.hypot(imaginary);
            // What is left of the expansion, and images that alias to no tone of ours.
            assert!(
                (amplitude / due - 1.0).abs() < 2e-3,
                "{hz} Hz: {amplitude} for {due}"
            );
            let due_s = imaginary.atan2(real) / (TAU * hz);
            assert!(
                (delay_s - due_s).abs() < 1e-6,
                "{hz} Hz: {delay_s} s for {due_s} s"
            );
        }
    }

    #[test]
    fn a_resting_texture_rings_nothing() {
        let resonance = Resonance::new(GUESS);
        let mut ring = None;
        for _ in 0..1000 {
            assert!((resonance.step(&mut ring, 0.7) - 0.7).abs() < 1e-12);
        }
    }
}
