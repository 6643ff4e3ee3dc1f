//! How the fingertip follows the arm over the surface: a ladder of models, from none to bristles.
//!
//! A model takes where the arm is, scan by scan, and gives where the skin touches the surface and how
//! hard the arm drags it ([`Touch`]). The arm moves in a straight line from one scan to the next.
//!
//! | rung | touches | a gauge feels |
//! | --- | --- | --- |
//! | `kinematic` | where the arm is | the point below it |
//! | `rigid` | where the arm is | the patch around it ([`crate::plant::patch`]) |
//! | `viscoelastic` | behind a spring and a damper ([`SpringDamper`]) | the patch |
//! | `stick-slip` | behind them, against friction, at rest or sliding ([`Slider`]) | the point |
//! | `reference` | behind them, clinging by bristles ([`Bristles`]), in the smallest steps | the patch |
//!
//! The reference is slow, and there to judge the others by. `stick-slip` leaves the patch out: what it
//! would change is less than what the guesses at friction are good for. [`select`] says which rung a scene
//! needs.

mod bristles;
pub mod integrator;
mod path;
pub mod select;
mod slider;
mod spring;
pub mod stability;
mod stepped;
mod stribeck;

use crate::scene;
use crate::scene::{ContactModel, Friction, Integrator, Solver};

pub use bristles::{BRISTLES_DAMPING, BRISTLES_N_PER_M, Bristles};
pub use slider::{DAMPING_N_S_PER_M, MASS_KG, STEP_SHARE, Slider};
pub use spring::{Spring, SpringDamper};
pub use stepped::{CREEP_M_S, SLIP_M_S, Stepped};
pub use stribeck::{KINETIC, NORMAL_N, STRIBECK_M_S, Stribeck};

const MM_PER_M: f64 = 1000.0;
/// After so long, in s, a method that chooses its own steps is asked at least whether the fingertip has come
/// to rest or broken away: a quarter of a scan.
pub const EVENT_STEP_S: f64 = 62.5e-6;

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
    Rigid,
    /// It hangs on a spring, solved exactly.
    SpringDamper(SpringDamper),
    /// The same, by steps.
    SteppedSpring(Stepped<Spring, 2>),
    /// A slider that the arm pulls by a spring, against friction; rest is a state of its own.
    Slider(Slider),
    /// The same with bristles, by steps.
    LuGre(Stepped<Bristles, 3>),
}

impl Contact {
    /// The contact of a scene; `stiffness_n_per_m` is the fingertip's, towards shear. The fingertip is
    /// set down, relaxed, at the first scan.
    pub fn new(contact: scene::Contact, stiffness_n_per_m: f64) -> Self {
        let spring = Spring { stiffness_n_per_m };
        let bristles =
            |friction: Friction| Bristles::new(Stribeck::new(friction), stiffness_n_per_m);
        let smallest = (Integrator::Radau, EVENT_STEP_S);
        let (integrator, step_s) = match (contact.rung, contact.solver) {
            (ContactModel::Reference, _) => smallest,
            (_, Solver::Stepped { integrator, step_s }) => (integrator, step_s),
            (ContactModel::Kinematic | ContactModel::Rigid, Solver::Exact) => return Self::Rigid,
            (ContactModel::Viscoelastic | ContactModel::StickSlip, Solver::Exact) => {
                return match contact.friction {
                    None => Self::SpringDamper(SpringDamper::new(stiffness_n_per_m)),
                    Some(friction) => {
                        Self::Slider(Slider::new(Stribeck::new(friction), stiffness_n_per_m))
                    }
                };
            }
        };
        match contact.friction {
            None => Self::SteppedSpring(Stepped::new(spring, integrator, step_s, true)),
            Some(friction) => {
                Self::LuGre(Stepped::new(bristles(friction), integrator, step_s, false))
            }
        }
    }

    /// The fingertip at `t_s` with the arm at `arm_mm`. Instants must not decrease.
    #[inline]
    pub fn follow(&mut self, t_s: f64, arm_mm: f64) -> Touch {
        let arm_m = arm_mm / MM_PER_M;
        let (stretch_m, force_n, sticks) = match self {
            Self::Rigid => {
                return Touch {
                    position_mm: arm_mm,
                    force_n: 0.0,
                    sticks: false,
                };
            }
            Self::SpringDamper(hanging) => {
                hanging.follow(t_s, arm_m);
                (hanging.stretch_m(), hanging.spring_n(), false)
            }
            Self::SteppedSpring(stepped) => {
                stepped.follow(t_s, arm_m);
                let stretch_m = stepped.stretch_m();
                let force_n = stepped.system().stiffness_n_per_m * stretch_m;
                (stretch_m, force_n, false)
            }
            Self::Slider(slider) => {
                slider.follow(t_s, arm_m);
                (slider.stretch_m(), slider.spring_n(), slider.sticks())
            }
            Self::LuGre(stepped) => {
                stepped.follow(t_s, arm_m);
                let stretch_m = stepped.stretch_m();
                let force_n = stepped.system().stiffness_n_per_m() * stretch_m;
                (stretch_m, force_n, stepped.sticks())
            }
        };
        Touch {
            // The stretch is what the models know: so far from the start nothing is rounded off.
            position_mm: arm_mm - stretch_m * MM_PER_M,
            force_n,
            sticks,
        }
    }

    /// Passages from rest to slip and back that have not been taken yet: when, in s, and whether it rests
    /// from then on. None where a model knows no rest.
    pub fn take_turns(&mut self) -> Vec<(f64, bool)> {
        match self {
            Self::Rigid | Self::SpringDamper(_) | Self::SteppedSpring(_) => Vec::new(),
            Self::Slider(slider) => slider.take_turns(),
            Self::LuGre(stepped) => stepped.take_turns(),
        }
    }
}
