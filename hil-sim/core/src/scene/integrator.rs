//! How a fingertip's equations are brought from one instant to the next, by name.

use strum::{IntoStaticStr, VariantArray};

/// The ways from one instant to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Integrator {
    /// Explicit Euler: along the slope at the beginning.
    Euler,
    /// Semi-implicit (symplectic) Euler: the velocity first, the rest with the new velocity.
    SemiImplicit,
    /// Runge and Kutta's fourth order.
    Rk4,
    /// A diagonally implicit Runge–Kutta method of second order, L-stable (Alexander 1977).
    Implicit,
    /// Dormand and Prince's explicit pair of eighth order, which chooses its own steps.
    Adaptive,
    /// Radau IIA of fifth order, implicit, which chooses its own, small steps: the reference's.
    Radau,
}

impl Integrator {
    /// All of them, the plainest first.
    pub const ALL: [Self; 6] = *Self::VARIANTS.as_array().unwrap();

    /// As scenes call it.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether it takes the steps it is told to; the others choose their own.
    pub const fn is_fixed(self) -> bool {
        !matches!(self, Self::Adaptive | Self::Radau)
    }
}
