//! The fingertip as a spring and a damper, without friction: it lags and swings where the arm speeds up.
//!
//! m·a = k (x_arm − x) + c (v_arm − v)
//!
//! Solved exactly while the arm moves in a straight line: in the arm's own frame nothing drives it.

use super::integrator::System;
use super::path::{Leg, Path};
use super::slider::{DAMPING_N_S_PER_M, MASS_KG};

/// Mass, spring and damper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// k in N/m.
    pub stiffness_n_per_m: f64,
}

impl System<2> for Spring {
    const VELOCITY: usize = 1;
    /// A micrometre, a millimetre a second.
    const SIZES: [f64; 2] = [1e-6, 1e-3];

    /// Of x_arm − x in m, and v in m/s.
    #[inline]
    fn slope(&self, &[stretch_m, velocity_m_s]: &[f64; 2], arm_m_s: f64) -> [f64; 2] {
        let pull_n =
            self.stiffness_n_per_m * stretch_m + DAMPING_N_S_PER_M * (arm_m_s - velocity_m_s);
        [arm_m_s - velocity_m_s, pull_n / MASS_KG]
    }
}

impl Spring {
    /// Its frequency without damping, √(k/m), in rad/s: 316 with 400 N/m.
    pub fn omega(&self) -> f64 {
        (self.stiffness_n_per_m / MASS_KG).sqrt()
    }

    /// Its damping ratio, c/(2√(k·m)): 0.06 with 400 N/m.
    pub fn damping(&self) -> f64 {
        DAMPING_N_S_PER_M / (2.0 * (self.stiffness_n_per_m * MASS_KG).sqrt())
    }

    /// The exact solution over a time.
    pub fn over(&self, time_s: f64) -> Swing {
        let (omega, zeta) = (self.omega(), self.damping());
        let decay = libm::exp(-zeta * omega * time_s);
        // cos and sin/ω of the damped swing; cosh and sinh/ω where it creeps back.
        let square = omega * omega * (1.0 - zeta * zeta);
        let (cosine, sine) = if square > 0.0 {
            let damped = square.sqrt();
            let (sine, cosine) = libm::sincos(damped * time_s);
            (cosine, sine / damped)
        } else if square < 0.0 {
            let damped = (-square).sqrt();
            (
                libm::cosh(damped * time_s),
                libm::sinh(damped * time_s) / damped,
            )
        } else {
            (1.0, time_s)
        };
        let half = zeta * omega;
        Swing {
            time_s,
            keep: [
                [decay * (cosine + half * sine), decay * sine],
                [
                    -decay * omega * omega * sine,
                    decay * (cosine - half * sine),
                ],
            ],
        }
    }
}

/// What a time does to a spring that swings freely.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    time_s: f64,
    /// Stretch and its rate, from stretch and its rate.
    keep: [[f64; 2]; 2],
}

impl Swing {
    /// Stretch in m and its rate in m/s after the time, from those before.
    pub fn after(&self, [stretch_m, rate_m_s]: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.keep;
        [a * stretch_m + b * rate_m_s, c * stretch_m + d * rate_m_s]
    }
}

/// A fingertip on a spring that follows the arm.
#[derive(Clone, Debug)]
pub struct SpringDamper {
    spring: Spring,
    path: Path,
    /// Stretch in m and velocity in m/s; none until the arm's first velocity is known: it is set down
    /// with that.
    state: Option<[f64; 2]>,
    swing: Swing,
}

impl SpringDamper {
    /// A fingertip that is set down relaxed and moving with the arm.
    pub fn new(stiffness_n_per_m: f64) -> Self {
        let spring = Spring { stiffness_n_per_m };
        Self {
            spring,
            path: Path::default(),
            state: None,
            swing: spring.over(0.0),
        }
    }

    /// Moves on to `t_s`, the arm in a straight line to `arm_m`. Nothing happens if `t_s` is not after
    /// the last.
    pub fn follow(&mut self, t_s: f64, arm_m: f64) {
        let Some(Leg {
            time_s, arm_m_s, ..
        }) = self.path.to(t_s, arm_m)
        else {
            return;
        };
        // Scans repeat to the last digits of their instants; so small a change changes nothing.
        if (time_s - self.swing.time_s).abs() > 1e-9 * time_s {
            self.swing = self.spring.over(time_s);
        }
        let [stretch_m, velocity_m_s] = self.state.unwrap_or([0.0, arm_m_s]);
        let [stretch_m, rate_m_s] = self.swing.after([stretch_m, arm_m_s - velocity_m_s]);
        self.state = Some([stretch_m, arm_m_s - rate_m_s]);
    }

    /// x_arm − x in m.
    pub fn stretch_m(&self) -> f64 {
        self.state.map_or(0.0, |[stretch_m, _]| stretch_m)
    }

    /// v in m/s.
    pub fn velocity_m_s(&self) -> f64 {
        self.state.map_or(0.0, |[_, velocity_m_s]| velocity_m_s)
    }

    /// The spring's force k (x_arm − x) in N, positive towards +x.
    pub fn spring_n(&self) -> f64 {
        self.spring.stiffness_n_per_m * self.stretch_m()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Integrator;

    const SCAN_S: f64 = 250e-6;

    #[test]
    fn a_steady_arm_is_followed_without_a_swing() {
        let mut hanging = SpringDamper::new(400.0);
        for scan in 0..4_000 {
            let t_s = f64::from(scan) * SCAN_S;
            hanging.follow(t_s, 0.05 * t_s);
        }
        // x_arm of 50 mm is rounded to 7e-18 m, taken as a velocity over 250 µs: 3e-14 m/s.
        assert!(hanging.stretch_m().abs() < 1e-12);
        assert!((hanging.velocity_m_s() - 0.05).abs() < 1e-12);
    }

    #[test]
    fn a_shaking_arm_is_followed_with_the_gain_of_a_resonance() {
        for hz in [2.0, 10.0, 20.0, 50.0, 100.0] {
            let omega = std::f64::consts::TAU * hz;
            let mut hanging = SpringDamper::new(400.0);
            let (mut sine, mut cosine, mut count) = (0.0, 0.0, 0u32);
            for scan in 0..16_000 {
                let t_s = f64::from(scan) * SCAN_S;
                let arm_m = 1e-3 * (omega * t_s).sin();
                hanging.follow(t_s, arm_m);
                // e^(−c/2m · 2 s) = e^(−37) of the start's swing is left; whole cycles of every hz.
                if scan >= 8_000 {
                    let x_m = arm_m - hanging.stretch_m();
                    sine += x_m * (omega * t_s).sin();
                    cosine += x_m * (omega * t_s).cos();
                    count += 1;
                }
            }
            let gain = sine.hypot(cosine) * 2.0 / f64::from(count) / 1e-3;
            let spring = Spring {
                stiffness_n_per_m: 400.0,
            };
            let ratio = omega / spring.omega();
            let twice = 2.0 * spring.damping() * ratio;
            let due = 1f64.hypot(twice) / (1.0 - ratio * ratio).hypot(twice);
            // Straight lines between scans take sinc²(f/4000) off the arm: (π f/4000)²/3 = 2e-3 at 100 Hz.
            assert!((gain / due - 1.0).abs() < 3e-3, "{hz} Hz: {gain} for {due}");
        }
    }

    #[test]
    fn the_exact_swing_is_what_small_steps_come_to_at_any_stiffness() {
        // c² = 4 k m at 1.4 N/m: below it creeps back instead of swinging.
        for stiffness_n_per_m in [1.0, 1.40625, 10.0, 400.0, 10_000.0] {
            let spring = Spring { stiffness_n_per_m };
            let mut hanging = SpringDamper::new(stiffness_n_per_m);
            let mut state = [0.0, 0.0];
            let arm_m = |t_s: f64| 0.01 * (40.0 * t_s).sin();
            hanging.state = Some(state);
            hanging.follow(0.0, 0.0);
            for scan in 1..=400 {
                let t_s = f64::from(scan) * SCAN_S;
                hanging.follow(t_s, arm_m(t_s));
                let arm_m_s = (arm_m(t_s) - arm_m(t_s - SCAN_S)) / SCAN_S;
                for _ in 0..25 {
                    state = Integrator::Rk4.advance(&spring, state, SCAN_S / 25.0, arm_m_s);
                }
            }
            // (ωh)⁵/120 a step, 1e4 steps: 1e-9 of 10 mm where ωh = 0.016.
            assert!(
                (hanging.stretch_m() - state[0]).abs() < 1e-10,
                "{stiffness_n_per_m}"
            );
        }
    }
}
