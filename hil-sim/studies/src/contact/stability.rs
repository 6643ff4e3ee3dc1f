//! Where integrators fail: steps and stiffnesses at which a fingertip that should rest creeps or chatters,
//! and one that should swing gains or loses energy.
//!
//! Beside what is seen, each map has the longest step that [`hil_sim_core::plant::contact::stability`] allows: the guard
//! by which scenes are refused.

mod picture;

use std::convert::Infallible;

use crate::study::{Progress, Record, Study, csv, fixed};
use hil_sim_core::plant::contact::{Bristles, MASS_KG, Spring, Stribeck, stability};
use hil_sim_core::scene::{Friction, Integrator};

/// Stiffnesses of a map, and steps.
const GRID: (usize, usize) = (24, 40);
/// Ranges of bristles' stiffnesses and of the steps of a fingertip that clings by them.
const BRISTLES_N_PER_M: (f64, f64) = (1e3, 1e6);
const CLINGING_STEPS_S: (f64, f64) = (1e-6, 1e-3);
/// Ranges of a fingertip's stiffnesses and of the steps of one that swings.
const FINGERTIP_N_PER_M: (f64, f64) = (10.0, 10_000.0);
const SWINGING_STEPS_S: (f64, f64) = (1e-5, 1e-2);

/// The fingertip's stiffness where it clings: the default.
const STIFFNESS_N_PER_M: f64 = 400.0;
/// The arm's speed before it stops.
const ARM_M_S: f64 = 0.07;
/// For how long it rubs: a slip and more.
const RUBBED_S: f64 = 0.05;
/// What is left to come to rest.
const SETTLED_S: f64 = 0.15;
/// How long the rest is watched.
const WATCHED_S: f64 = 0.05;
/// A fingertip that rests goes no further than this in that time: a tenth of a count of the encoder.
const DRIFT_M: f64 = 0.5e-6;
/// A fingertip that goes to and fro faster than this does not rest.
const CHATTER_M_S: f64 = 1e-4;
/// Whatever goes faster than ten times the fastest slip has lost its way.
const LOST: f64 = 10.0;
/// For how long a swing is watched.
const SWUNG_S: f64 = 0.04;
/// Share of its energy that a swing may gain or lose by its integration.
const ENERGY_SHARE: f64 = 0.05;

/// What becomes of a fingertip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    /// It does what its equations say.
    Sound,
    /// It creeps while it should rest, or its swing dies too soon.
    Creeps,
    /// It goes to and fro while it should rest, or its swing grows.
    Chatters,
    /// It goes to where no number is.
    Diverges,
}

impl Outcome {
    /// In the CSV.
    const fn name(self) -> &'static str {
        match self {
            Self::Sound => "sound",
            Self::Creeps => "creeps",
            Self::Chatters => "chatters",
            Self::Diverges => "diverges",
        }
    }
}

/// What is mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Test {
    /// Bristles on a surface: the arm rubs and stops, the fingertip should rest.
    LuGre,
    /// A spring without friction: the arm starts, the fingertip should swing and calm down.
    SteppedSpring,
}

/// A map of one integrator.
#[derive(Clone, Debug)]
pub struct Map {
    test: Test,
    integrator: Integrator,
    rows: Vec<MapRow>,
}

#[derive(Clone, Debug)]
struct MapRow {
    stiffness_n_per_m: f64,
    /// The longest step that the guard allows; infinite if any.
    allowed_s: f64,
    /// Steps in s, and what came of them.
    cells: Vec<(f64, Outcome)>,
}

/// The integrators that are mapped: those that take the steps they are told to.
fn integrators() -> impl Iterator<Item = Integrator> {
    let all = Integrator::ALL.into_iter();
    all.filter(|integrator| integrator.is_fixed())
}

/// Makes all maps.
pub fn measure(progress: &impl Progress) -> Vec<Map> {
    let of_test = |test| integrators().map(move |integrator| (test, integrator));
    let wanted: Vec<(Test, Integrator)> = [Test::LuGre, Test::SteppedSpring]
        .into_iter()
        .flat_map(of_test)
        .collect();
    progress.begin(wanted.len());
    let Ok(maps) = progress.each(&wanted, |&(test, integrator)| {
        Ok::<_, Infallible>(map(test, integrator))
    });
    maps
}

/// `count` values from one to the other, each the same multiple of the one before.
fn spread((low, high): (f64, f64), count: usize) -> impl Iterator<Item = f64> {
    let ratio = (high / low).ln() / (count - 1) as f64;
    (0..count).map(move |index| low * (ratio * index as f64).exp())
}

fn map(test: Test, integrator: Integrator) -> Map {
    let (stiffness_range, step_range) = match test {
        Test::LuGre => (BRISTLES_N_PER_M, CLINGING_STEPS_S),
        Test::SteppedSpring => (FINGERTIP_N_PER_M, SWINGING_STEPS_S),
    };
    let row = |stiffness_n_per_m| MapRow {
        stiffness_n_per_m,
        allowed_s: allowed_s(test, integrator, stiffness_n_per_m),
        cells: spread(step_range, GRID.1)
            .map(|step_s| (step_s, outcome(test, integrator, stiffness_n_per_m, step_s)))
            .collect(),
    };
    Map {
        test,
        integrator,
        rows: spread(stiffness_range, GRID.0).map(row).collect(),
    }
}

/// The longest step that the guard allows, in s.
fn allowed_s(test: Test, integrator: Integrator, stiffness_n_per_m: f64) -> f64 {
    match test {
        Test::LuGre => {
            let (bristles, fastest_m_s) = clinging(stiffness_n_per_m);
            stability::longest_clinging_s(integrator, &bristles, fastest_m_s)
        }
        Test::SteppedSpring => stability::longest_swinging_s(integrator, stiffness_n_per_m),
    }
}

fn outcome(test: Test, integrator: Integrator, stiffness_n_per_m: f64, step_s: f64) -> Outcome {
    match test {
        Test::LuGre => cling(integrator, stiffness_n_per_m, step_s),
        Test::SteppedSpring => swing(integrator, stiffness_n_per_m, step_s),
    }
}

fn clinging(bristles_n_per_m: f64) -> (Bristles, f64) {
    let friction = Stribeck::new(Friction::Strong);
    (
        Bristles::with(friction, STIFFNESS_N_PER_M, bristles_n_per_m),
        stability::fastest_slip_m_s(friction, STIFFNESS_N_PER_M, ARM_M_S),
    )
}

fn cling(integrator: Integrator, bristles_n_per_m: f64, step_s: f64) -> Outcome {
    let (bristles, fastest_m_s) = clinging(bristles_n_per_m);
    let steps = |time_s: f64| (time_s / step_s).round().max(1.0) as u64;
    let mut state = [0.0; 3];
    let is_lost = |state: &[f64; 3]| {
        !state.iter().all(|value| value.is_finite()) || state[1].abs() > LOST * fastest_m_s
    };
    for step in 0..steps(RUBBED_S + SETTLED_S) {
        let arm_m_s = if step < steps(RUBBED_S) { ARM_M_S } else { 0.0 };
        state = integrator.advance(&bristles, state, step_s, arm_m_s);
        if is_lost(&state) {
            return Outcome::Diverges;
        }
    }
    let rest_m = state[0];
    let (mut squares, watched) = (0.0, steps(WATCHED_S));
    for _ in 0..watched {
        state = integrator.advance(&bristles, state, step_s, 0.0);
        if is_lost(&state) {
            return Outcome::Diverges;
        }
        squares += state[1] * state[1];
    }
    if (squares / watched as f64).sqrt() > CHATTER_M_S {
        Outcome::Chatters
    } else if (state[0] - rest_m).abs() > DRIFT_M {
        Outcome::Creeps
    } else {
        Outcome::Sound
    }
}

fn swing(integrator: Integrator, stiffness_n_per_m: f64, step_s: f64) -> Outcome {
    let spring = Spring { stiffness_n_per_m };
    let begin = [0.0, ARM_M_S];
    let steps = (SWUNG_S / step_s).round().max(1.0) as u64;
    let energy = |[stretch_m, rate_m_s]: [f64; 2]| {
        0.5 * stiffness_n_per_m * stretch_m * stretch_m + 0.5 * MASS_KG * rate_m_s * rate_m_s
    };
    let swing = spring.over(step_s);
    let (mut state, mut exact) = (begin, begin);
    let (mut found, mut due) = (0.0, 0.0);
    for step in 0..steps {
        state = integrator.advance(&spring, state, step_s, 0.0);
        // The arm rests: the stretch's rate is −v.
        let [stretch_m, rate_m_s] = swing.after([exact[0], -exact[1]]);
        exact = [stretch_m, -rate_m_s];
        // The last half: within a cycle, a method may borrow.
        if 2 * step >= steps {
            found += energy(state);
            due += energy(exact);
        }
    }
    if !found.is_finite() || energy(state) > LOST * LOST * energy(begin) {
        Outcome::Diverges
    } else if found > (1.0 + ENERGY_SHARE) * due {
        Outcome::Chatters
    } else if found < (1.0 - ENERGY_SHARE) * due {
        Outcome::Creeps
    } else {
        Outcome::Sound
    }
}

impl Study for Vec<Map> {
    const NAME: &'static str = "stability";

    fn csvs(&self) -> Vec<(&'static str, String)> {
        let rows = self
            .iter()
            .flat_map(|map| map.rows.iter().map(move |row| (map, row)));
        let cells = rows.flat_map(|(map, row)| {
            let test = match map.test {
                Test::LuGre => "clinging",
                Test::SteppedSpring => "swinging",
            };
            row.cells.iter().map(move |(step_s, outcome)| {
                Record::default()
                    .with("test", test)
                    .with("integrator", map.integrator.name())
                    .with(
                        "stiffness_n_per_m",
                        format!("{:.4e}", row.stiffness_n_per_m),
                    )
                    .with("step_us", fixed(step_s * 1e6, 4))
                    .with("allowed_us", fixed(row.allowed_s * 1e6, 4))
                    .with("outcome", outcome.name())
            })
        });
        vec![("", csv(cells))]
    }

    fn picture(&self) -> String {
        picture::draw(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_guard_allows_rests() {
        for integrator in integrators() {
            for bristles_n_per_m in [1e3, 1e4, 2e5, 1e6] {
                // A scan is the longest that a scene may ask for.
                let step_s = allowed_s(Test::LuGre, integrator, bristles_n_per_m).min(250e-6);
                assert_eq!(
                    outcome(Test::LuGre, integrator, bristles_n_per_m, 0.98 * step_s),
                    Outcome::Sound,
                    "{integrator:?}, {bristles_n_per_m} N/m"
                );
            }
        }
    }

    #[test]
    fn explicit_steps_of_a_scan_lose_bristles_that_are_as_stiff_as_ours() {
        for integrator in [Integrator::Euler, Integrator::SemiImplicit, Integrator::Rk4] {
            assert_eq!(
                outcome(Test::LuGre, integrator, 2e5, 250e-6),
                Outcome::Diverges,
                "{integrator:?}"
            );
        }
    }

    #[test]
    fn a_swing_grows_beyond_the_guard_s_limit_and_never_within_half_of_it() {
        for integrator in [Integrator::Euler, Integrator::SemiImplicit, Integrator::Rk4] {
            for stiffness_n_per_m in [400.0, 10_000.0] {
                let allowed_s = allowed_s(Test::SteppedSpring, integrator, stiffness_n_per_m);
                let at =
                    |step_s| outcome(Test::SteppedSpring, integrator, stiffness_n_per_m, step_s);
                assert!(
                    at(1.1 * allowed_s) >= Outcome::Chatters,
                    "{integrator:?}, {stiffness_n_per_m} N/m"
                );
                assert!(
                    at(0.5 * allowed_s) < Outcome::Diverges,
                    "{integrator:?}, {stiffness_n_per_m} N/m"
                );
            }
        }
    }

    #[test]
    fn an_implicit_method_never_makes_energy() {
        for stiffness_n_per_m in spread(FINGERTIP_N_PER_M, 8) {
            for step_s in spread(SWINGING_STEPS_S, 12) {
                let outcome = outcome(
                    Test::SteppedSpring,
                    Integrator::Implicit,
                    stiffness_n_per_m,
                    step_s,
                );
                assert!(
                    outcome < Outcome::Diverges,
                    "{stiffness_n_per_m} N/m, {step_s} s: {outcome:?}"
                );
            }
        }
    }
}
