//! How a fingertip's equations are brought from one instant to the next.
//!
//! The arm moves in a straight line meanwhile, so a system depends on time through its state alone.

use crate::scene::Integrator;
use differential_equations::prelude::{ExplicitRungeKutta, IVP, ImplicitRungeKutta, ODE};

/// Relative and absolute tolerance of the adaptive integrators, in the state's units.
const ADAPTIVE_TOLERANCE: (f64, f64) = (1e-6, 1e-12);
/// The same of the reference: a thousandth of that.
const REFERENCE_TOLERANCE: (f64, f64) = (1e-9, 1e-15);
/// Steps of either within one call, before it is given up.
const MOST_STEPS: usize = 1_000_000;
/// 1 − 1/√2: with it the implicit method is L-stable, and of second order (Alexander 1977).
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Newton's iterations of an implicit stage; a handful is enough unless the step spans a kink.
const MOST_ITERATIONS: u32 = 20;
/// Newton has found it when a correction is below this share of the state's own size.
const CONVERGED: f64 = 1e-10;
/// Share of a state by which it is moved to see a slope's derivative: √ε of f64.
const NUDGE: f64 = 1.5e-8;

/// Ordinary differential equations of first order, y' = f(y).
pub trait System<const N: usize> {
    /// Which of the state is the velocity: the semi-implicit method renews it first.
    const VELOCITY: usize;
    /// What each of the state is of the order of, in its unit, so that nothing is compared with zero.
    const SIZES: [f64; N];

    /// f(y), the arm moving at `arm_m_s`.
    fn slope(&self, state: &[f64; N], arm_m_s: f64) -> [f64; N];
}

impl Integrator {
    /// The state after `time_s`, in one step if it takes the steps it is told to. Where it fails, it
    /// gives what is not a number.
    pub fn advance<S: System<N>, const N: usize>(
        self,
        system: &S,
        from: [f64; N],
        time_s: f64,
        arm_m_s: f64,
    ) -> [f64; N] {
        match self {
            Self::Euler => along(from, system.slope(&from, arm_m_s), time_s),
            Self::SemiImplicit => semi_implicit(system, from, time_s, arm_m_s),
            Self::Rk4 => rk4(system, from, time_s, arm_m_s),
            Self::Implicit => implicit(system, from, time_s, arm_m_s),
            Self::Adaptive => {
                let (relative, absolute) = ADAPTIVE_TOLERANCE;
                let method = ExplicitRungeKutta::dop853()
                    .rtol(relative)
                    .atol(absolute)
                    .max_steps(MOST_STEPS);
                let driven = Driven { system, arm_m_s };
                last(IVP::ode(&driven, 0.0, time_s, from).method(method).solve())
            }
            Self::Radau => {
                let (relative, absolute) = REFERENCE_TOLERANCE;
                let method = ImplicitRungeKutta::radau5()
                    .rtol(relative)
                    .atol(absolute)
                    .max_steps(MOST_STEPS);
                let driven = Driven { system, arm_m_s };
                last(IVP::ode(&driven, 0.0, time_s, from).method(method).solve())
            }
        }
    }
}

/// A system with its arm, as the crate of the adaptive methods wants it.
struct Driven<'a, S> {
    system: &'a S,
    arm_m_s: f64,
}

impl<S: System<N>, const N: usize> ODE<f64, [f64; N]> for Driven<'_, S> {
    fn diff(&self, _t: f64, state: &[f64; N], slope: &mut [f64; N]) {
        *slope = self.system.slope(state, self.arm_m_s);
    }
}

fn last<const N: usize, E>(
    solved: Result<differential_equations::prelude::Solution<f64, [f64; N]>, E>,
) -> [f64; N] {
    solved
        .ok()
        .and_then(|solution| solution.y.last().copied())
        .unwrap_or([f64::NAN; N])
}

fn along<const N: usize>(from: [f64; N], slope: [f64; N], time_s: f64) -> [f64; N] {
    std::array::from_fn(|i| from[i] + slope[i] * time_s)
}

fn semi_implicit<S: System<N>, const N: usize>(
    system: &S,
    from: [f64; N],
    time_s: f64,
    arm_m_s: f64,
) -> [f64; N] {
    let mut faster = from;
    faster[S::VELOCITY] += time_s * system.slope(&from, arm_m_s)[S::VELOCITY];
    let mut to = along(from, system.slope(&faster, arm_m_s), time_s);
    to[S::VELOCITY] = faster[S::VELOCITY];
    to
}

fn rk4<S: System<N>, const N: usize>(
    system: &S,
    from: [f64; N],
    time_s: f64,
    arm_m_s: f64,
) -> [f64; N] {
    let first = system.slope(&from, arm_m_s);
    let second = system.slope(&along(from, first, 0.5 * time_s), arm_m_s);
    let third = system.slope(&along(from, second, 0.5 * time_s), arm_m_s);
    let fourth = system.slope(&along(from, third, time_s), arm_m_s);
    let mean = std::array::from_fn(|i| (first[i] + 2.0 * (second[i] + third[i]) + fourth[i]) / 6.0);
    along(from, mean, time_s)
}

fn implicit<S: System<N>, const N: usize>(
    system: &S,
    from: [f64; N],
    time_s: f64,
    arm_m_s: f64,
) -> [f64; N] {
    let first = stage(system, from, GAMMA * time_s, arm_m_s);
    let slope: [f64; N] = std::array::from_fn(|i| (first[i] - from[i]) / (GAMMA * time_s));
    stage(
        system,
        along(from, slope, (1.0 - GAMMA) * time_s),
        GAMMA * time_s,
        arm_m_s,
    )
}

/// The y with y = from + time · f(y), by Newton's method.
fn stage<S: System<N>, const N: usize>(
    system: &S,
    from: [f64; N],
    time_s: f64,
    arm_m_s: f64,
) -> [f64; N] {
    let mut at = from;
    for _ in 0..MOST_ITERATIONS {
        let slope = system.slope(&at, arm_m_s);
        let miss: [f64; N] = std::array::from_fn(|i| from[i] + time_s * slope[i] - at[i]);
        let derivative = jacobian(system, &at, &slope, arm_m_s);
        let matrix: [[f64; N]; N] = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                f64::from(u8::from(row == column)) - time_s * derivative[row][column]
            })
        });
        let correction = solve(matrix, miss);
        let mut largest = 0.0f64;
        for i in 0..N {
            at[i] += correction[i];
            largest = largest.max(correction[i].abs() / at[i].abs().max(S::SIZES[i]));
        }
        if largest < CONVERGED {
            break;
        }
    }
    at
}

/// ∂f/∂y at `state`, where f is `slope`, by differences; a row for each slope.
pub fn jacobian<S: System<N>, const N: usize>(
    system: &S,
    state: &[f64; N],
    slope: &[f64; N],
    arm_m_s: f64,
) -> [[f64; N]; N] {
    let mut derivative = [[0.0; N]; N];
    for column in 0..N {
        let mut moved = *state;
        moved[column] += NUDGE * state[column].abs().max(S::SIZES[column]);
        // What it was really moved by, after rounding.
        let by = moved[column] - state[column];
        let there = system.slope(&moved, arm_m_s);
        for row in 0..N {
            derivative[row][column] = (there[row] - slope[row]) / by;
        }
    }
    derivative
}

/// Gauss's elimination with the largest pivot of each column.
fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> [f64; N] {
    for column in 0..N {
        let pivot = (column..N)
            .max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()))
            .unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let (above, below) = matrix.split_at_mut(column + 1);
        for (row, line) in below.iter_mut().enumerate() {
            let share = line[column] / above[column][column];
            for (cell, pivot) in line.iter_mut().zip(above[column]).skip(column) {
                *cell -= share * pivot;
            }
            right[column + 1 + row] -= share * right[column];
        }
    }
    for row in (0..N).rev() {
        for k in row + 1..N {
            right[row] -= matrix[row][k] * right[k];
        }
        right[row] /= matrix[row][row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x'' = −ω²x − 2ζω x', written as [x, v], ω = 100 rad/s, ζ = 0.1.
    struct Oscillator;

    const OMEGA: f64 = 100.0;
    const ZETA: f64 = 0.1;

    impl System<2> for Oscillator {
        const VELOCITY: usize = 1;
        const SIZES: [f64; 2] = [1.0, OMEGA];

        fn slope(&self, &[x, v]: &[f64; 2], _arm_m_s: f64) -> [f64; 2] {
            [v, -OMEGA * OMEGA * x - 2.0 * ZETA * OMEGA * v]
        }
    }

    fn exact(t_s: f64) -> f64 {
        let damped = OMEGA * (1.0 - ZETA * ZETA).sqrt();
        (-ZETA * OMEGA * t_s).exp()
            * ((damped * t_s).cos() + ZETA * OMEGA / damped * (damped * t_s).sin())
    }

    /// How far it is off after 0.05 s in `steps`.
    fn error(integrator: Integrator, steps: u32) -> f64 {
        let mut state = [1.0, 0.0];
        for _ in 0..steps {
            state = integrator.advance(&Oscillator, state, 0.05 / f64::from(steps), 0.0);
        }
        (state[0] - exact(0.05)).abs()
    }

    #[test]
    fn each_has_the_order_that_it_is_known_for() {
        for (integrator, order) in [
            (Integrator::Euler, 1),
            (Integrator::SemiImplicit, 1),
            (Integrator::Rk4, 4),
            (Integrator::Implicit, 2),
        ] {
            let ratio = error(integrator, 400) / error(integrator, 800);
            // Halving the step halves the error `order` times, but for the next term of the series: a
            // share of ωh = 1/80 for each order.
            let due = f64::from(1 << order);
            assert!((ratio / due - 1.0).abs() < 0.1, "{integrator:?}: {ratio}");
        }
    }

    #[test]
    fn the_adaptive_ones_keep_their_tolerance_in_one_call() {
        // Twenty radians: errors of each step add up, a hundred of them at most.
        assert!(error(Integrator::Adaptive, 1) < 100.0 * ADAPTIVE_TOLERANCE.0);
        assert!(error(Integrator::Radau, 1) < 100.0 * REFERENCE_TOLERANCE.0);
    }

    #[test]
    fn elimination_solves_what_needs_its_rows_changed() {
        let matrix = [[0.0, 2.0, 1.0], [1.0, 1.0, 0.0], [3.0, 0.0, 1.0]];
        let wanted = [1.0, -2.0, 5.0];
        let right = std::array::from_fn(|row| (0..3).map(|k| matrix[row][k] * wanted[k]).sum());
        for (found, wanted) in solve(matrix, right).into_iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-14);
        }
    }
}
