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
/// Damping σ1 of the bristles, in N·s/m: a guess, a third of what would keep them from swinging.
pub const BRISTLES_N_S_PER_M: f64 = 20.0;

/// Spring, mass, bristles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles {
    /// Friction over speed.
    pub friction: Stribeck,
    /// k in N/m.
    pub stiffness_n_per_m: f64,
}

impl System<3> for Bristles {
    const VELOCITY: usize = 1;
    /// A micrometre, a millimetre a second, a hundredth of a micrometre.
    const SIZES: [f64; 3] = [1e-6, 1e-3, 1e-8];

    /// Of x_arm − x in m, v in m/s and z in m.
    #[inline]
    fn slope(&self, &[stretch_m, velocity_m_s, bend_m]: &[f64; 3], arm_m_s: f64) -> [f64; 3] {
        let bend_m_s = velocity_m_s
            - BRISTLES_N_PER_M * velocity_m_s.abs() * bend_m / self.friction.sliding_n(velocity_m_s);
        let pull_n =
            self.stiffness_n_per_m * stretch_m + DAMPING_N_S_PER_M * (arm_m_s - velocity_m_s);
        let drag_n = BRISTLES_N_PER_M * bend_m + BRISTLES_N_S_PER_M * bend_m_s;
        [
            arm_m_s - velocity_m_s,
            (pull_n - drag_n) / MASS_KG,
            bend_m_s,
        ]
    }
}
