//! A slider on a spring whose skin clings to the surface by bristles: stick, slip and what is between,
//! the pre-sliding, in one set of equations (LuGre: Canudas de Wit, Olsson, Åström and Lischinsky 1995).
//!
//! m·v' = k (x_arm − x) + c (v_arm − v) − (σ0 z + σ1 z')
//! z' = v − σ0 |v| z / g(v)
//!
//! z is how far the bristles are bent, g is [`Stribeck`]'s curve. The bristles are far stiffer than the
//! fingertip: what is left of [`super::Slider`] when they are made ever stiffer is the same without them.

use super::integrator::System;
use super::slider::{DAMPING_N_S_PER_M, MASS_KG};
use super::stribeck::Stribeck;

/// Stiffness σ0 of the bristles, in N/m: a guess, so stiff that they are bent by 4 µm at most, less than
/// a count of the encoder.
pub const BRISTLES_N_PER_M: f64 = 200_000.0;
/// Damping ratio of a fingertip that sticks, σ1/(2√(σ0·m)): a guess; σ1 is then 20 N·s/m.
pub const BRISTLES_DAMPING: f64 = 0.35;

/// Spring, mass, bristles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles {
    friction: Stribeck,
    stiffness_n_per_m: f64,
    bristles_n_per_m: f64,
    bristles_n_s_per_m: f64,
}

impl Bristles {
    /// Bristles of [`BRISTLES_N_PER_M`] under a fingertip of `stiffness_n_per_m`.
    pub fn new(friction: Stribeck, stiffness_n_per_m: f64) -> Self {
        Self::with(friction, stiffness_n_per_m, BRISTLES_N_PER_M)
    }

    /// Bristles of any stiffness σ0, in N/m, damped alike.
    pub fn with(friction: Stribeck, stiffness_n_per_m: f64, bristles_n_per_m: f64) -> Self {
        Self {
            friction,
            stiffness_n_per_m,
            bristles_n_per_m,
            bristles_n_s_per_m: 2.0 * BRISTLES_DAMPING * (bristles_n_per_m * MASS_KG).sqrt(),
        }
    }

    /// k in N/m.
    pub fn stiffness_n_per_m(&self) -> f64 {
        self.stiffness_n_per_m
    }

    /// The same with friction that does not fall with speed: kinetic throughout.
    pub fn without_fall(self) -> Self {
        Self {
            friction: self.friction.without_fall(),
            ..self
        }
    }

    /// The state of a steady slide at `velocity_m_s`, the spring's stretch left out.
    pub fn sliding(&self, velocity_m_s: f64) -> [f64; 3] {
        let bend_m = self.friction.sliding_n(velocity_m_s) / self.bristles_n_per_m;
        [0.0, velocity_m_s, bend_m * velocity_m_s.signum()]
    }
}

impl System<3> for Bristles {
    const VELOCITY: usize = 1;
    /// A micrometre, a millimetre a second, a hundredth of a micrometre.
    const SIZES: [f64; 3] = [1e-6, 1e-3, 1e-8];

    /// Of x_arm − x in m, v in m/s and z in m.
    #[inline]
    fn slope(&self, &[stretch_m, velocity_m_s, bend_m]: &[f64; 3], arm_m_s: f64) -> [f64; 3] {
        let bend_m_s = velocity_m_s
            - self.bristles_n_per_m * velocity_m_s.abs() * bend_m
                / self.friction.sliding_n(velocity_m_s);
        let pull_n =
            self.stiffness_n_per_m * stretch_m + DAMPING_N_S_PER_M * (arm_m_s - velocity_m_s);
        let drag_n = self.bristles_n_per_m * bend_m + self.bristles_n_s_per_m * bend_m_s;
        [
            arm_m_s - velocity_m_s,
            (pull_n - drag_n) / MASS_KG,
            bend_m_s,
        ]
    }
}
