//! Dry friction that weakens as the skin gets moving (Stribeck's curve):
//! μ(v) = μk + (μs − μk) · e^(−(v/vs)²), times the normal force.
//!
//! All numbers are guesses of the numerical study behind this project, not measurements.

use crate::scene::Friction;

/// Normal force of the fingertip on the surface, in N: a guess.
pub const NORMAL_N: f64 = 0.6;
/// Coefficient of friction μk of fast sliding: a guess.
pub const KINETIC: f64 = 0.6;
/// Velocity vs at which the surplus over μk has fallen to 1/e, in m/s: a guess.
pub const STRIBECK_M_S: f64 = 0.02;

/// (v/vs)² from which on the surplus, less than 1e-11 N, is left out.
const NOTHING_LEFT: f64 = 25.0;

/// Friction force over sliding speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stribeck {
    kinetic_n: f64,
    surplus_n: f64,
}

impl Stribeck {
    /// The curve of one of the frictions: μs = 0.75, 1.0 or 1.3, guesses all three.
    pub fn new(friction: Friction) -> Self {
        let static_coefficient = match friction {
            Friction::Mild => 0.75,
            Friction::Strong => 1.0,
            Friction::Severe => 1.3,
        };
        Self {
            kinetic_n: NORMAL_N * KINETIC,
            surplus_n: NORMAL_N * (static_coefficient - KINETIC),
        }
    }

    /// The same without the surplus at rest: μk at any speed.
    pub fn without_fall(self) -> Self {
        Self {
            surplus_n: 0.0,
            ..self
        }
    }

    /// The most that it withstands at rest, μs·N in N.
    pub fn static_n(&self) -> f64 {
        self.kinetic_n + self.surplus_n
    }

    /// μk·N in N.
    pub fn kinetic_n(&self) -> f64 {
        self.kinetic_n
    }

    /// The steepest fall of friction with speed, at vs/√2, in N·s/m.
    pub fn steepest_n_s_per_m(&self) -> f64 {
        self.surplus_n / STRIBECK_M_S * (2.0 / std::f64::consts::E).sqrt()
    }

    /// μ(v)·N in N at `velocity_m_s`, whatever its sign.
    #[inline]
    pub fn sliding_n(&self, velocity_m_s: f64) -> f64 {
        let relative = velocity_m_s * (1.0 / STRIBECK_M_S);
        let square = relative * relative;
        if square > NOTHING_LEFT {
            return self.kinetic_n;
        }
        self.kinetic_n + self.surplus_n * libm::exp(-square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_falls_from_static_to_kinetic_with_the_speed() {
        for (friction, static_n) in [
            (Friction::Mild, 0.45),
            (Friction::Strong, 0.6),
            (Friction::Severe, 0.78),
        ] {
            let curve = Stribeck::new(friction);
            assert!((curve.static_n() - static_n).abs() < 1e-12);
            assert!((curve.sliding_n(0.0) - static_n).abs() < 1e-12);
            let at_stribeck = 0.36 + (static_n - 0.36) / std::f64::consts::E;
            assert!((curve.sliding_n(-0.02) - at_stribeck).abs() < 1e-12);
            // No slope is steeper than the steepest, which is met.
            let steepest = (1..1000)
                .map(|i| f64::from(i) * 1e-4)
                .map(|v| (curve.sliding_n(v) - curve.sliding_n(v + 1e-6)) / 1e-6)
                .fold(0.0, f64::max);
            assert!((steepest / curve.steepest_n_s_per_m() - 1.0).abs() < 1e-3);
            // e^−25 of at most 0.42 N is left.
            assert!((curve.sliding_n(0.1) - 0.36).abs() < 1e-11);
        }
    }
}
