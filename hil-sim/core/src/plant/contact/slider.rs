//! A slider on a spring: the simplest fingertip that sticks and slips.
//!
//! The arm at x_arm pulls a mass m at x_s through a spring k and a damper c; friction of [`Stribeck`]'s
//! curve resists:
//!
//! m·a = k (x_arm − x_s) + c (v_arm − v_s) − sign(v_s)·N·μ(v_s)
//!
//! Rest is a state of its own, not a steep part of a smoothed sign: the slider keeps its place exactly
//! until spring and damper together exceed μs·N, an instant that is computed, not searched for. Sliding
//! is integrated by Runge and Kutta's fourth order in steps of a quarter ([`STEP_SHARE`]) of the fastest
//! time constant, 50 µs with severe friction and a scan with mild; the step in which the velocity passes
//! zero is shortened to end there. So the slip events do not lie on any grid. Only a velocity that turns
//! and comes back within one step, hundredths of a mm/s deep, is not seen to turn.

#[cfg(test)]
mod tests;

use super::path::Path;
use super::stribeck::Stribeck;

/// Mass of the slider, in kg: a guess.
pub const MASS_KG: f64 = 0.004;
/// Damping between the arm and the slider, in N·s/m: a guess.
pub const DAMPING_N_S_PER_M: f64 = 0.15;
/// Longest step of the integration, in time constants: of friction falling with speed, m·vs / (√(2/e)·N·(μs
/// − μk)), 0.22 ms with severe friction, and of the spring, √(m/k), 3 ms. Runge and Kutta's error is then
/// 0.25⁴/120 = 3e-5 of the rates.
pub const STEP_SHARE: f64 = 0.25;

/// Share of a step by which a step may be longer than that.
const SPLINTER: f64 = 1e-3;
/// A velocity below this is zero, in m/s: a nanometre in twelve days.
const REST_M_S: f64 = 1e-15;
/// More than rounding takes off a pull of a few newton that has just reached static friction.
const ROUNDING_N: f64 = 1e-12;
/// Halvings of a step before the search for zero velocity gives up: it has then the last digit.
const MOST_HALVINGS: u32 = 60;

/// The slider and what it hangs on.
#[derive(Clone, Debug)]
pub struct Slider {
    friction: Stribeck,
    stiffness_n_per_m: f64,
    longest_step_s: f64,
    path: Path,
    state: State,
    phase: Phase,
    /// Passages from rest to slip and back that have not been taken: when, and whether it rests then.
    turns: Vec<(f64, bool)>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    /// x_arm − x_s, in m.
    stretch_m: f64,
    /// v_s in m/s.
    velocity_m_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Stick,
    /// With the sign of the velocity: +1 or −1.
    Slip(f64),
}

impl Slider {
    /// A slider at rest, its spring relaxed, wherever the arm is first.
    pub fn new(friction: Stribeck, stiffness_n_per_m: f64) -> Self {
        let fastest_per_s =
            (friction.steepest_n_s_per_m() / MASS_KG).max((stiffness_n_per_m / MASS_KG).sqrt());
        Self {
            friction,
            stiffness_n_per_m,
            longest_step_s: STEP_SHARE / fastest_per_s,
            path: Path::default(),
            state: State {
                stretch_m: 0.0,
                velocity_m_s: 0.0,
            },
            phase: Phase::Stick,
            turns: Vec::new(),
        }
    }

    /// Moves on to `t_s`, the arm in a straight line to `arm_m`. Nothing happens if `t_s` is not after
    /// the last.
    pub fn follow(&mut self, t_s: f64, arm_m: f64) {
        if let Some(leg) = self.path.to(t_s, arm_m) {
            self.advance(t_s, leg.time_s, leg.arm_m_s);
        }
    }

    /// Passages from rest to slip and back since this was last asked: when, in s, and whether it rests
    /// from then on.
    pub fn take_turns(&mut self) -> Vec<(f64, bool)> {
        std::mem::take(&mut self.turns)
    }

    /// x_arm − x_s in m.
    pub fn stretch_m(&self) -> f64 {
        self.state.stretch_m
    }

    /// The spring's force k (x_arm − x_s) in N, positive towards +x.
    pub fn spring_n(&self) -> f64 {
        self.stiffness_n_per_m * self.state.stretch_m
    }

    /// Whether the slider rests on the surface.
    pub fn sticks(&self) -> bool {
        self.phase == Phase::Stick
    }

    /// Lets `time_s` pass until `until_s`, with the arm at a constant velocity.
    fn advance(&mut self, until_s: f64, time_s: f64, arm_m_s: f64) {
        let mut left_s = time_s;
        while left_s > 0.0 {
            let stuck = self.sticks();
            left_s -= match self.phase {
                Phase::Stick => self.stick(left_s, arm_m_s),
                Phase::Slip(sign) => self.slip(left_s, arm_m_s, sign),
            };
            if self.sticks() != stuck {
                self.turns.push((until_s - left_s, !stuck));
            }
        }
    }

    /// Rests until the pull exceeds static friction, for `most_s` at most; returns for how long.
    fn stick(&mut self, most_s: f64, arm_m_s: f64) -> f64 {
        let pull_n = self.pull_n(self.state, arm_m_s);
        let rate_n_s = self.stiffness_n_per_m * arm_m_s;
        let limit_n = self.friction.static_n();
        // Towards which side it breaks: a pull that jumped with the arm's velocity may be there already.
        let sign = if pull_n.abs() > limit_n {
            pull_n.signum()
        } else {
            rate_n_s.signum()
        };
        let holds_s = if pull_n * sign >= limit_n {
            0.0
        } else if rate_n_s == 0.0 {
            f64::INFINITY
        } else {
            (limit_n - pull_n * sign) / rate_n_s.abs()
        };
        let time_s = holds_s.min(most_s);
        self.state.stretch_m += arm_m_s * time_s;
        if holds_s < most_s {
            self.phase = Phase::Slip(sign);
        }
        time_s
    }

    /// Slides one step, to its end or to rest; returns how long it was. `sign` is the velocity's.
    fn slip(&mut self, most_s: f64, arm_m_s: f64, sign: f64) -> f64 {
        let begin = self.state;
        let starting = begin.velocity_m_s == 0.0;
        if starting && self.pull_n(begin, arm_m_s) * sign < self.friction.static_n() - ROUNDING_N {
            // The arm's velocity turned at the very instant of the break.
            self.phase = Phase::Stick;
            return 0.0;
        }
        // Even steps, so that no splinter is left for another at the end.
        let steps = (most_s / self.longest_step_s - SPLINTER).ceil().max(1.0);
        let step_s = most_s / steps;
        let end = self.step(begin, step_s, arm_m_s, sign);
        if end.velocity_m_s * sign > 0.0 {
            self.state = end;
            return step_s;
        }
        if starting {
            // Too short a step to get moving: the next one decides.
            self.state = State {
                velocity_m_s: 0.0,
                ..end
            };
            return step_s;
        }
        let (rest_s, rest) = self.until_rest(begin, (step_s, end), arm_m_s, sign);
        self.state = State {
            velocity_m_s: 0.0,
            ..rest
        };
        let pull_n = self.pull_n(rest, arm_m_s);
        self.phase = if pull_n.abs() <= self.friction.static_n() {
            Phase::Stick
        } else {
            Phase::Slip(pull_n.signum())
        };
        rest_s
    }

    /// The step from `begin` that ends with velocity zero, given one, `beyond`, that ends past it. Length
    /// and end; false position with the Illinois weights, halving if that is slow.
    fn until_rest(
        &self,
        begin: State,
        beyond: (f64, State),
        arm_m_s: f64,
        sign: f64,
    ) -> (f64, State) {
        let (mut low_s, mut low_v) = (0.0, begin.velocity_m_s * sign);
        let (mut high_s, mut high_v) = (beyond.0, beyond.1.velocity_m_s * sign);
        let mut found = beyond;
        for iteration in 0..MOST_HALVINGS {
            let mut middle_s = low_s + (high_s - low_s) * low_v / (low_v - high_v);
            if iteration > 8 || !(low_s..=high_s).contains(&middle_s) {
                middle_s = 0.5 * (low_s + high_s);
            }
            let end = self.step(begin, middle_s, arm_m_s, sign);
            found = (middle_s, end);
            let v = end.velocity_m_s * sign;
            if v.abs() <= REST_M_S {
                break;
            }
            if v > 0.0 {
                (low_s, low_v) = (middle_s, v);
                high_v *= 0.5;
            } else {
                (high_s, high_v) = (middle_s, v);
                low_v *= 0.5;
            }
        }
        found
    }

    /// One step of sliding, Runge and Kutta's.
    fn step(&self, from: State, step_s: f64, arm_m_s: f64, sign: f64) -> State {
        let slope = |state: State| State {
            stretch_m: arm_m_s - state.velocity_m_s,
            velocity_m_s: (self.pull_n(state, arm_m_s)
                - sign * self.friction.sliding_n(state.velocity_m_s))
                * (1.0 / MASS_KG),
        };
        let first = slope(from);
        let second = slope(from.on(first, 0.5 * step_s));
        let third = slope(from.on(second, 0.5 * step_s));
        let fourth = slope(from.on(third, step_s));
        let sixth_s = step_s / 6.0;
        from.on(first, sixth_s)
            .on(second, 2.0 * sixth_s)
            .on(third, 2.0 * sixth_s)
            .on(fourth, sixth_s)
    }

    /// What spring and damper pull with, in N.
    fn pull_n(&self, state: State, arm_m_s: f64) -> f64 {
        self.stiffness_n_per_m * state.stretch_m
            + DAMPING_N_S_PER_M * (arm_m_s - state.velocity_m_s)
    }
}

impl State {
    fn on(self, slope: State, time_s: f64) -> State {
        State {
            stretch_m: self.stretch_m + slope.stretch_m * time_s,
            velocity_m_s: self.velocity_m_s + slope.velocity_m_s * time_s,
        }
    }
}
