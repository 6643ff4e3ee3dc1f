//! How the fingertip follows the arm over the surface: a ladder of models, from none to friction.
//!
//! A model takes where the arm is, scan by scan, and gives where the skin touches the surface and how
//! hard the arm drags it ([`Touch`]). The arm moves in a straight line from one scan to the next.

use crate::scene;

mod slider;
mod stribeck;

pub use slider::{DAMPING_N_S_PER_M, MASS_KG, STEP_SHARE, Slider};
pub use stribeck::{KINETIC, NORMAL_N, STRIBECK_M_S, Stribeck};

const MM_PER_M: f64 = 1000.0;

/// The fingertip at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Where the fingertip's middle touches the surface, in mm.
    pub position_mm: f64,
    /// Tangential force in the fingertip in N, positive when the arm drags it towards +x.
    pub force_n: f64,
    /// Whether the skin rests on the surface. Always false where a model knows no rest.
    pub sticks: bool,
}

/// A contact model and its state.
#[derive(Clone, Debug)]
pub enum Contact {
    /// The fingertip is where the arm is: no slip, no stick, no force.
    Kinematic,
    /// A slider that the arm pulls by a spring, against friction.
    StickSlip(Slider),
}

impl Contact {
    /// The contact of a scene; `stiffness_n_per_m` is the fingertip's, towards shear. The fingertip is
    /// set down, relaxed, at the first scan.
    pub fn new(contact: scene::Contact, stiffness_n_per_m: f64) -> Self {
        match contact {
            scene::Contact::Kinematic => Self::Kinematic,
            scene::Contact::StickSlip(friction) => {
                Self::StickSlip(Slider::new(Stribeck::new(friction), stiffness_n_per_m))
            }
        }
    }

    /// The fingertip at `t_s` with the arm at `arm_mm`. Instants must not decrease.
    #[inline]
    pub fn follow(&mut self, t_s: f64, arm_mm: f64) -> Touch {
        match self {
            Self::Kinematic => Touch {
                position_mm: arm_mm,
                force_n: 0.0,
                sticks: false,
            },
            Self::StickSlip(slider) => {
                slider.follow(t_s, arm_mm / MM_PER_M);
                Touch {
                    // The stretch is what the slider knows: so far from the start nothing is rounded off.
                    position_mm: arm_mm - slider.stretch_m() * MM_PER_M,
                    force_n: slider.spring_n(),
                    sticks: slider.sticks(),
                }
            }
        }
    }
}
