//! A fingertip whose equations are integrated by steps.

use super::integrator::System;
use super::path::{Leg, Path};
use crate::scene::Integrator;

/// Share of a step by which a step may be longer than asked for, so that no splinter is left at a scan's
/// end.
const SPLINTER: f64 = 1e-6;
/// The fingertip has come to rest when it is slower than this, in m/s. Bristles know no rest that is exact.
pub const CREEP_M_S: f64 = 2e-4;
/// It slips when it is faster than this, in m/s: more than bristles swing by when they catch it, some 60
/// m/s² over their 7 000 rad/s.
pub const SLIP_M_S: f64 = 1e-2;

/// The equations, how they are integrated, and where the fingertip is.
#[derive(Clone, Debug)]
pub struct Stepped<S, const N: usize> {
    system: S,
    integrator: Integrator,
    /// Longest step; infinite to go from scan to scan at once.
    step_s: f64,
    path: Path,
    /// Stretch in m, velocity in m/s, and what else the system has; none until the arm's first velocity
    /// is known.
    state: Option<[f64; N]>,
    /// Whether it is set down with the arm's velocity, or at rest.
    moving: bool,
    /// Whether it rests, by [`CREEP_M_S`] and [`SLIP_M_S`].
    rests: bool,
    /// Passages from rest to slip and back: when, and whether it rests from then on.
    turns: Vec<(f64, bool)>,
}

impl<S: System<N>, const N: usize> Stepped<S, N> {
    /// A fingertip that is set down relaxed at the first scan: with the arm's velocity if `moving`, else
    /// at rest. Steps are `step_s` at most, and end with each scan.
    pub fn new(system: S, integrator: Integrator, step_s: f64, moving: bool) -> Self {
        Self {
            system,
            integrator,
            step_s,
            path: Path::default(),
            state: None,
            moving,
            rests: !moving,
            turns: Vec::new(),
        }
    }

    /// Moves on to `t_s`, the arm in a straight line to `arm_m`. Nothing happens if `t_s` is not after
    /// the last.
    pub fn follow(&mut self, t_s: f64, arm_m: f64) {
        let Some(Leg {
            begin_s,
            time_s,
            arm_m_s,
        }) = self.path.to(t_s, arm_m)
        else {
            return;
        };
        let mut state = self.state.unwrap_or_else(|| {
            let mut state = [0.0; N];
            if self.moving {
                state[S::VELOCITY] = arm_m_s;
            }
            state
        });
        let steps = (time_s / self.step_s - SPLINTER).ceil().max(1.0);
        let step_s = time_s / steps;
        for step in 0..steps as u64 {
            let before = state[S::VELOCITY];
            state = self
                .integrator
                .advance(&self.system, state, step_s, arm_m_s);
            self.look(before, state[S::VELOCITY], |share| {
                begin_s + (step as f64 + share) * step_s
            });
        }
        self.state = Some(state);
    }

    /// Notes whether the fingertip comes to rest or breaks away in a step from one velocity to the next; `at_s`
    /// gives the instant of a share of it.
    fn look(&mut self, before_m_s: f64, after_m_s: f64, at_s: impl Fn(f64) -> f64) {
        let passed_m_s = if self.rests {
            (after_m_s.abs() > SLIP_M_S).then_some(SLIP_M_S * after_m_s.signum())
        } else {
            // One that turns has come to rest on the way.
            let comes_to_rest = after_m_s.abs() < CREEP_M_S || after_m_s * before_m_s < 0.0;
            comes_to_rest.then_some(CREEP_M_S * before_m_s.signum())
        };
        if let Some(passed_m_s) = passed_m_s {
            let share = (passed_m_s - before_m_s) / (after_m_s - before_m_s);
            self.rests = !self.rests;
            self.turns.push((at_s(share.clamp(0.0, 1.0)), self.rests));
        }
    }

    /// The state: stretch in m first, then velocity in m/s; all zero before the second scan.
    pub fn state(&self) -> [f64; N] {
        self.state.unwrap_or([0.0; N])
    }

    /// x_arm − x in m.
    pub fn stretch_m(&self) -> f64 {
        self.state()[0]
    }

    /// Whether it rests: since it was slower than [`CREEP_M_S`], and not yet faster than [`SLIP_M_S`].
    pub fn sticks(&self) -> bool {
        self.rests
    }

    /// Passages from rest to slip and back since this was last asked: when, in s, and whether it rests
    /// from then on.
    pub fn take_turns(&mut self) -> Vec<(f64, bool)> {
        std::mem::take(&mut self.turns)
    }

    /// The equations.
    pub fn system(&self) -> &S {
        &self.system
    }
}
