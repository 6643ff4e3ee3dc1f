//! The slave arm that carries the fingertip over the surface.

use crate::scene::{ArmDrive, Follows, Motion};

/// The arm: with the hand, or behind its own drive.
#[derive(Clone, Debug)]
pub enum Arm {
    /// Moves exactly as the hand does.
    WithHand(Motion),
    /// Integrates what the sensor board commands, through a first-order lag.
    Driven(Drive),
}

/// A velocity-controlled drive: τ dv/dt = command − v.
#[derive(Clone, Debug)]
pub struct Drive {
    lag_s: f64,
    at_s: f64,
    position_mm: f64,
    velocity_mm_s: f64,
    command_mm_s: f64,
    /// The last step asked for and its e^(−step/τ): steps repeat.
    decay: (f64, f64),
}

impl Arm {
    /// The arm of a scene, at t = 0 where the hand is, at rest if it is driven.
    pub fn new(drive: &ArmDrive, hand: &Motion) -> Self {
        match drive.follows {
            Follows::Motion => Arm::WithHand(hand.clone()),
            Follows::Link => Arm::Driven(Drive {
                lag_s: drive.lag_ms / 1000.0,
                at_s: 0.0,
                position_mm: hand.position_mm(0.0),
                velocity_mm_s: 0.0,
                command_mm_s: 0.0,
                decay: (0.0, 1.0),
            }),
        }
    }

    /// Where the arm is at `t_s`, in mm. Instants must not decrease.
    pub fn position_mm(&mut self, t_s: f64) -> f64 {
        match self {
            Arm::WithHand(motion) => motion.position_mm(t_s),
            Arm::Driven(drive) => {
                drive.advance(t_s);
                drive.position_mm
            }
        }
    }

    /// The drive's command from `t_s` on, in mm/s. An arm that goes with the hand takes none.
    pub fn command(&mut self, t_s: f64, velocity_mm_s: f64) {
        if let Arm::Driven(drive) = self {
            drive.advance(t_s);
            drive.command_mm_s = velocity_mm_s;
        }
    }
}

impl Drive {
    /// The exact solution over a time of constant command.
    fn advance(&mut self, t_s: f64) {
        let step_s = t_s - self.at_s;
        if step_s <= 0.0 {
            return;
        }
        self.at_s = t_s;
        if self.lag_s == 0.0 {
            self.velocity_mm_s = self.command_mm_s;
            self.position_mm += self.command_mm_s * step_s;
            return;
        }
        if step_s != self.decay.0 {
            self.decay = (step_s, libm::exp(-step_s / self.lag_s));
        }
        let behind_mm_s = self.velocity_mm_s - self.command_mm_s;
        self.position_mm +=
            self.command_mm_s * step_s + behind_mm_s * self.lag_s * (1.0 - self.decay.1);
        self.velocity_mm_s = self.command_mm_s + behind_mm_s * self.decay.1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driven(lag_ms: f64) -> Arm {
        let hand = Motion::Constant { speed_mm_s: 10.0 };
        Arm::new(
            &ArmDrive {
                follows: Follows::Link,
                lag_ms,
                ..ArmDrive::default()
            },
            &hand,
        )
    }

    #[test]
    fn an_arm_that_goes_with_the_hand_is_where_the_hand_is() {
        let hand = Motion::Sinusoid {
            amplitude_mm_s: 70.0,
            frequency_hz: 0.83,
        };
        let mut arm = Arm::new(&ArmDrive::default(), &hand);
        arm.command(0.1, 1000.0);
        assert_eq!(arm.position_mm(0.7), hand.position_mm(0.7));
    }

    #[test]
    fn a_drive_answers_a_step_with_its_lag_whatever_the_step_size() {
        let (lag_s, command) = (0.02, 50.0);
        for steps in [1, 7, 400] {
            let mut arm = driven(lag_s * 1000.0);
            arm.command(0.0, command);
            let mut position = 0.0;
            for step in 1..=steps {
                position = arm.position_mm(0.1 * f64::from(step) / f64::from(steps));
            }
            // x = v (t − τ (1 − e^(−t/τ))), rounded a few hundred times.
            let closed = command * (0.1 - lag_s * (1.0 - (-0.1 / lag_s).exp()));
            assert!(
                (position - closed).abs() < 1e-9,
                "{steps} steps: {position} for {closed}"
            );
        }
    }

    #[test]
    fn a_drive_without_lag_moves_at_its_command() {
        let mut arm = driven(0.0);
        arm.command(0.0, 40.0);
        arm.command(0.5, -40.0);
        assert!(arm.position_mm(1.0).abs() < 1e-12);
    }
}
