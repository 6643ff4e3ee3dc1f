//! Which steps an integrator bears: what it does to equations that have been made linear, where they are
//! stiffest.
//!
//! One step makes a matrix of the state. What it leaves of a state after many steps grows with the size of
//! the matrix's largest eigenvalue: above one, every rounding error grows without end.

use super::bristles::Bristles;
use super::integrator::{System, jacobian};
use super::slider::MASS_KG;
use super::spring::Spring;
use super::stribeck::Stribeck;
use crate::scene::Integrator;

/// Squarings of the matrix: 2²⁴ steps.
const SQUARINGS: u32 = 24;
/// The step's search ends at this share of it.
const RESOLUTION: f64 = 1e-4;
/// Longest step that is looked at, in s: far more than a scan.
const LONGEST_S: f64 = 0.1;
/// Growth of a step that is still no growth: 2²⁴ steps make √e of it, and rounding no less.
const SLACK: f64 = 3e-8;

/// y' = A y, the arm at rest.
#[derive(Clone, Copy, Debug)]
pub struct Linear<const N: usize>([[f64; N]; N]);

impl<const N: usize> Linear<N> {
    /// `system` made linear around `state`, the arm moving at `arm_m_s`.
    pub fn around<S: System<N>>(system: &S, state: [f64; N], arm_m_s: f64) -> Self {
        let slope = system.slope(&state, arm_m_s);
        Self(jacobian(system, &state, &slope, arm_m_s))
    }
}

/// The velocity stands second in both systems of ours.
impl<const N: usize> System<N> for Linear<N> {
    const VELOCITY: usize = 1;
    const SIZES: [f64; N] = [1.0; N];

    fn slope(&self, state: &[f64; N], _arm_m_s: f64) -> [f64; N] {
        std::array::from_fn(|row| (0..N).map(|k| self.0[row][k] * state[k]).sum())
    }
}

/// What many steps of `step_s` leave of a small deviation, per step: below one it dies away, above it
/// grows. Not a number if even one step overflows.
pub fn growth<const N: usize>(integrator: Integrator, linear: &Linear<N>, step_s: f64) -> f64 {
    let mut matrix = [[0.0; N]; N];
    for column in 0..N {
        let mut state = [0.0; N];
        state[column] = 1.0;
        let after = integrator.advance(linear, state, step_s, 0.0);
        for row in 0..N {
            matrix[row][column] = after[row];
        }
    }
    // ‖Mⁿ‖^(1/n) tends to the largest eigenvalue's size.
    let (mut logarithm, mut power) = (0.0, 1.0);
    for _ in 0..SQUARINGS {
        let size = matrix
            .iter()
            .flatten()
            .fold(0.0f64, |size, cell| size.max(cell.abs()));
        if size == 0.0 {
            return 0.0;
        }
        logarithm += libm::log(size) / power;
        let scaled = matrix.map(|row| row.map(|cell| cell / size));
        matrix = std::array::from_fn(|row| {
            std::array::from_fn(|column| (0..N).map(|k| scaled[row][k] * scaled[k][column]).sum())
        });
        power *= 2.0;
    }
    libm::exp(logarithm)
}

/// The longest step in s at which no deviation grows; infinite if none does at [`LONGEST_S`]. Methods
/// that choose their own steps bear any.
fn longest_of<const N: usize>(integrator: Integrator, linear: &Linear<N>) -> f64 {
    if !integrator.is_fixed() {
        return f64::INFINITY;
    }
    // What does not die away by itself is no fault of the step: the spring's rest without a load, say.
    let is_stable = |step_s: f64| growth(integrator, linear, step_s) <= 1.0 + SLACK;
    let (mut low_s, mut high_s) = (1e-9, LONGEST_S);
    if is_stable(high_s) {
        return f64::INFINITY;
    }
    while high_s / low_s > 1.0 + RESOLUTION {
        let middle_s = (low_s * high_s).sqrt();
        if is_stable(middle_s) {
            low_s = middle_s;
        } else {
            high_s = middle_s;
        }
    }
    low_s
}

/// The longest step of a fingertip on a spring without friction, in s; see [`Spring`].
pub fn longest_swinging_s(integrator: Integrator, stiffness_n_per_m: f64) -> f64 {
    let spring = Spring { stiffness_n_per_m };
    longest_of(integrator, &Linear::around(&spring, [0.0; 2], 0.0))
}

/// The longest step of a fingertip that clings by bristles, in s: the shorter of what it bears at rest
/// and at the fastest slip of an arm that moves at up to `arm_m_s`; see [`Bristles`].
pub fn longest_slipping_s(
    integrator: Integrator,
    friction: Stribeck,
    stiffness_n_per_m: f64,
    arm_m_s: f64,
) -> f64 {
    let fastest_m_s = fastest_slip_m_s(friction, stiffness_n_per_m, arm_m_s);
    longest_clinging_s(
        integrator,
        &Bristles::new(friction, stiffness_n_per_m),
        fastest_m_s,
    )
}

/// The same of any bristles, that slip at up to `fastest_m_s`.
pub fn longest_clinging_s(integrator: Integrator, bristles: &Bristles, fastest_m_s: f64) -> f64 {
    longest_resting_s(integrator, bristles).min(longest_sliding_s(
        integrator,
        bristles,
        fastest_m_s,
    ))
}

/// The same of bristles at rest.
pub fn longest_resting_s(integrator: Integrator, bristles: &Bristles) -> f64 {
    longest_of(integrator, &Linear::around(bristles, [0.0; 3], 0.0))
}

/// The same of bristles in a steady slide at `velocity_m_s`. Friction is taken for kinetic: it bends them
/// fastest then, and its fall with speed, which lets a slide grow by nature, is no fault of a step.
pub fn longest_sliding_s(integrator: Integrator, bristles: &Bristles, velocity_m_s: f64) -> f64 {
    let level = bristles.without_fall();
    let slide = Linear::around(&level, level.sliding(velocity_m_s), velocity_m_s);
    longest_of(integrator, &slide)
}

/// No slip is faster, in m/s: the spring's energy between static and kinetic friction, all of it turned
/// into speed on top of the arm's.
pub fn fastest_slip_m_s(friction: Stribeck, stiffness_n_per_m: f64, arm_m_s: f64) -> f64 {
    let surplus_n = friction.static_n() - friction.kinetic_n();
    arm_m_s.abs() + surplus_n / (stiffness_n_per_m * MASS_KG).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::contact::bristles::{BRISTLES_DAMPING, BRISTLES_N_PER_M};
    use crate::plant::contact::slider::DAMPING_N_S_PER_M;
    use crate::plant::contact::stribeck::{KINETIC, NORMAL_N};
    use crate::scene::Friction;

    /// Frequency and half of the damping rate, in rad/s, of the fingertip that sticks.
    fn stuck(stiffness_n_per_m: f64) -> (f64, f64) {
        let bristles_n_s_per_m = 2.0 * BRISTLES_DAMPING * (BRISTLES_N_PER_M * MASS_KG).sqrt();
        (
            ((stiffness_n_per_m + BRISTLES_N_PER_M) / MASS_KG).sqrt(),
            (DAMPING_N_S_PER_M + bristles_n_s_per_m) / (2.0 * MASS_KG),
        )
    }

    /// Euler bears 2Z/Ω² of x'' + 2Z x' + Ω² x = 0 where it swings, semi-implicit Euler what makes
    /// h²Ω² + 4Zh = 4: both follow from the two eigenvalues of one step.
    fn closed_s(integrator: Integrator, omega: f64, half_rate: f64) -> f64 {
        match integrator {
            Integrator::Euler => 2.0 * half_rate / (omega * omega),
            Integrator::SemiImplicit => {
                2.0 * ((half_rate * half_rate + omega * omega).sqrt() - half_rate) / (omega * omega)
            }
            _ => f64::INFINITY,
        }
    }

    #[test]
    fn a_spring_s_limits_are_the_closed_forms() {
        for stiffness_n_per_m in [50.0, 400.0, 3_000.0, 10_000.0] {
            let spring = Spring { stiffness_n_per_m };
            for integrator in [Integrator::Euler, Integrator::SemiImplicit] {
                let due_s = closed_s(
                    integrator,
                    spring.omega(),
                    spring.damping() * spring.omega(),
                );
                let found_s = longest_swinging_s(integrator, stiffness_n_per_m);
                // The search's resolution, and growth that is too slow to be told from none.
                assert!(
                    (found_s / due_s - 1.0).abs() < 2e-3,
                    "{integrator:?} at {stiffness_n_per_m} N/m: {found_s} s for {due_s} s"
                );
            }
        }
    }

    #[test]
    fn runge_and_kutta_bear_what_their_polynomial_does() {
        // Almost no damping: 1 + z + z²/2 + z³/6 + z⁴/24 on the imaginary axis is 1 in size at z = 2√2.
        let spring = Spring {
            stiffness_n_per_m: 10_000.0,
        };
        let found_s = longest_swinging_s(Integrator::Rk4, spring.stiffness_n_per_m);
        let due_s = 8f64.sqrt() / spring.omega();
        // ζ = 0.012 moves the root by its own size at most.
        assert!(
            (found_s / due_s - 1.0).abs() < 0.02,
            "{found_s} s for {due_s} s"
        );
    }

    #[test]
    fn implicit_and_adaptive_methods_bear_any_step() {
        let friction = Stribeck::new(Friction::Severe);
        for integrator in [
            Integrator::Implicit,
            Integrator::Adaptive,
            Integrator::Radau,
        ] {
            assert_eq!(longest_swinging_s(integrator, 10_000.0), f64::INFINITY);
            assert_eq!(
                longest_slipping_s(integrator, friction, 400.0, 0.07),
                f64::INFINITY
            );
        }
    }

    /// What a small deviation from rest, or from a steady slide, has grown to within 400 steps at most, and
    /// what is left of it in the end, relative to what it was. One that grows so far that the slide slows
    /// down may be gone again.
    fn grown(
        integrator: Integrator,
        bristles: &Bristles,
        velocity_m_s: f64,
        step_s: f64,
    ) -> (f64, f64) {
        let steady = if velocity_m_s == 0.0 {
            [0.0; 3]
        } else {
            let mut steady = bristles.sliding(velocity_m_s);
            // The spring pulls with what friction takes.
            steady[0] = KINETIC * NORMAL_N / bristles.stiffness_n_per_m();
            steady
        };
        let deviation_m = 1e-12;
        let mut state = steady;
        state[2] += deviation_m;
        let (mut most, mut left) = (1.0f64, 1.0);
        for _ in 0..400 {
            state = integrator.advance(bristles, state, step_s, velocity_m_s);
            left = (state[2] - steady[2]).abs() / deviation_m;
            most = most.max(left);
        }
        (most, left)
    }

    #[test]
    fn the_full_equations_rest_and_slide_below_the_limits_and_not_above() {
        for bristles_n_per_m in [1e4, BRISTLES_N_PER_M] {
            let bristles = Bristles::with(Stribeck::new(Friction::Strong), 400.0, bristles_n_per_m);
            for integrator in [Integrator::Euler, Integrator::SemiImplicit, Integrator::Rk4] {
                // So fast that friction is kinetic, and that the bristles' own rate is the fastest.
                for velocity_m_s in [0.0, 1.0] {
                    let limit_s = if velocity_m_s == 0.0 {
                        longest_resting_s(integrator, &bristles)
                    } else {
                        longest_sliding_s(integrator, &bristles, velocity_m_s)
                    };
                    let (_, below) = grown(integrator, &bristles, velocity_m_s, 0.95 * limit_s);
                    let (above, _) = grown(integrator, &bristles, velocity_m_s, 1.05 * limit_s);
                    assert!(
                        below < 1.0 && above > 10.0,
                        "{integrator:?}, {bristles_n_per_m} N/m, {velocity_m_s} m/s: {below}, {above}"
                    );
                }
            }
        }
    }

    #[test]
    fn bristles_limits_are_the_closed_forms() {
        let friction = Stribeck::new(Friction::Mild);
        let bristles = Bristles::new(friction, 400.0);
        let (omega, half_rate) = stuck(400.0);
        for integrator in [Integrator::Euler, Integrator::SemiImplicit] {
            let found_s = longest_resting_s(integrator, &bristles);
            let due_s = closed_s(integrator, omega, half_rate);
            assert!(
                (found_s / due_s - 1.0).abs() < 5e-3,
                "{found_s} s, {due_s} s"
            );
        }
        // In a slide z decays at σ0 |v| / g; the mass takes part a little.
        let due_s = 2.0 * friction.kinetic_n() / (BRISTLES_N_PER_M * 0.5);
        let found_s = longest_sliding_s(Integrator::Euler, &bristles, 0.5);
        assert!(
            (found_s / due_s - 1.0).abs() < 0.2,
            "{found_s} s, {due_s} s"
        );
        // Faster arms bend the bristles faster, whatever the friction and the spring.
        for stiffness_n_per_m in [10.0, 400.0, 10_000.0] {
            for friction in [Friction::Mild, Friction::Strong, Friction::Severe] {
                let at = |arm_m_s| {
                    longest_slipping_s(
                        Integrator::Rk4,
                        Stribeck::new(friction),
                        stiffness_n_per_m,
                        arm_m_s,
                    )
                };
                assert!(at(1.0) < at(0.0) && at(1.0) > 1e-7, "{}", at(1.0));
            }
        }
    }
}
