//! Says to a board what its peer said, as a peer that has just started.

use protocol::{Estimate, Message, Motion, Role};

use crate::link::Event;

/// Between two estimates, in µs: what lies between the last one before a restart and the first one after.
const PAUSE_US: u64 = 10_000;

/// A board's peer.
pub struct StandIn {
    board: Role,
    speed: f64,
    sequence: u32,
    clock: Option<Clock>,
}

/// How recorded instants lie on the stand-in's clock.
#[derive(Clone, Copy)]
struct Clock {
    recorded_us: u64,
    own_us: u64,
    last_us: u64,
}

impl StandIn {
    /// The peer of the board of role `board`, in a replay at `speed`.
    pub const fn new(board: Role, speed: f64) -> Self {
        Self {
            board,
            speed,
            sequence: 0,
            clock: None,
        }
    }

    /// What is to be said to the board when the board of `role` said this: a sensor's estimates to a
    /// display, a display's motions to a sensor, nothing else. Numbers count from 0, as a board's do that
    /// has just started, which is how the other one follows; instants begin at `now_us` and run, as the
    /// speeds that are told, with the replay.
    pub fn say(&mut self, role: Role, event: &Event, now_us: u64) -> Option<Message> {
        let Event::Heard { message, .. } = event else {
            return None;
        };
        match (self.board, role, message) {
            (Role::Display, Role::Sensor, Message::Estimate(estimate)) => {
                let (sequence, instant_us) = self.number(estimate.instant_us, now_us);
                Some(Message::Estimate(Estimate {
                    sequence,
                    instant_us,
                    velocity_um_s: self.velocity_um_s(estimate.velocity_um_s),
                    ..*estimate
                }))
            }
            (Role::Sensor, Role::Display, Message::Motion(motion)) => {
                let (sequence, instant_us) = self.number(motion.instant_us, now_us);
                Some(Message::Motion(Motion {
                    sequence,
                    instant_us,
                    velocity_um_s: self.velocity_um_s(motion.velocity_um_s),
                    ..*motion
                }))
            }
            _ => None,
        }
    }

    fn number(&mut self, recorded_us: u64, now_us: u64) -> (u32, u64) {
        let sequence = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        let clock = match self.clock {
            Some(clock) if recorded_us >= clock.recorded_us => clock,
            // The first one, or the recorded board started anew.
            before => {
                let own_us = before.map_or(now_us, |clock| clock.last_us + PAUSE_US);
                Clock {
                    recorded_us,
                    own_us,
                    last_us: own_us,
                }
            }
        };
        let passed_us = (recorded_us - clock.recorded_us) as f64 / self.speed;
        let instant_us = clock.own_us + passed_us.round() as u64;
        self.clock = Some(Clock {
            last_us: instant_us,
            ..clock
        });
        (sequence, instant_us)
    }

    fn velocity_um_s(&self, recorded_um_s: i32) -> i32 {
        // Saturates.
        (f64::from(recorded_um_s) * self.speed).round() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(sequence: u32, instant_us: u64, velocity_um_s: i32) -> Event {
        Event::Heard {
            at_us: 0,
            message: Message::Motion(Motion {
                sequence,
                instant_us,
                position_um: 7,
                velocity_um_s,
            }),
        }
    }

    fn said(message: Option<Message>) -> (u32, u64, i32) {
        let Some(Message::Motion(motion)) = message else {
            panic!("{message:?} is no motion");
        };
        assert_eq!(motion.position_um, 7);
        (motion.sequence, motion.instant_us, motion.velocity_um_s)
    }

    #[test]
    fn a_peer_that_has_just_started_counts_from_0_and_its_time_goes_with_the_replay() {
        let mut peer = StandIn::new(Role::Sensor, 2.0);
        let mut say = |event: &Event| said(peer.say(Role::Display, event, 1_000));
        assert_eq!(say(&motion(70, 500_000, -3)), (0, 1_000, -6));
        assert_eq!(say(&motion(71, 502_000, i32::MAX)), (1, 2_000, i32::MAX));
        // Started anew.
        assert_eq!(say(&motion(0, 2_000, 0)), (2, 12_000, 0));
        assert_eq!(say(&motion(1, 4_000, 0)), (3, 13_000, 0));
    }

    #[test]
    fn a_board_hears_its_peer_only() {
        let event = motion(0, 0, 0);
        assert_eq!(
            StandIn::new(Role::Display, 1.0).say(Role::Display, &event, 0),
            None
        );
        assert_eq!(
            StandIn::new(Role::Sensor, 1.0).say(Role::Sensor, &event, 0),
            None
        );
        let turned = Event::Restarted;
        assert_eq!(
            StandIn::new(Role::Sensor, 1.0).say(Role::Display, &turned, 0),
            None
        );
    }
}
