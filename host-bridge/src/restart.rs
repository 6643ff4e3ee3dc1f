//! Whether a board has started anew, by its clock.

use protocol::Message;

/// A board's messages are made and sent in order, some later than others: a block of samples bears the
/// instant of its first one. A clock that steps back further than this has begun again, in µs.
const STEP_US: u64 = 100_000;

/// The latest instant of the board's clock in each kind of message that bears one.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoardClock {
    latest_us: [Option<u64>; 7],
}

impl BoardClock {
    /// Takes note of `message`; whether the board has started anew since the one before.
    pub fn is_restart(&mut self, message: &Message) -> bool {
        let (kind, instant_us) = match message {
            Message::Estimate(estimate) => (0, estimate.instant_us),
            Message::Motion(motion) => (1, motion.instant_us),
            Message::Gauges(gauges) => (2, gauges.instant_us),
            Message::Status(status) => (3, status.uptime_us),
            Message::Pong(pong) => (4, pong.received_us),
            Message::Safety(safety) => (5, safety.instant_us),
            Message::Texture(texture) => (6, texture.instant_us),
            _ => return false,
        };
        let is_restart = self.latest_us[kind]
            .is_some_and(|latest_us| instant_us.saturating_add(STEP_US) < latest_us);
        if is_restart {
            *self = Self::default();
        }
        self.latest_us[kind] = Some(instant_us);
        is_restart
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{Motion, Pong};

    fn motion(instant_us: u64) -> Message {
        Message::Motion(Motion {
            sequence: 0,
            instant_us,
            position_um: 0,
            velocity_um_s: 0,
        })
    }

    fn pong(received_us: u64) -> Message {
        Message::Pong(Pong {
            sent_us: 0,
            received_us,
            answered_us: received_us,
        })
    }

    #[test]
    fn a_clock_that_steps_back_has_begun_again_and_is_told_of_once() {
        let mut clock = BoardClock::default();
        let told = [
            motion(9_000_000),
            pong(9_010_000),
            motion(9_002_000),
            motion(700),
            pong(900),
            motion(2_700),
        ]
        .map(|message| clock.is_restart(&message));
        assert_eq!(told, [false, false, false, true, false, false]);
    }

    #[test]
    fn little_steps_are_none() {
        let mut clock = BoardClock::default();
        assert!(!clock.is_restart(&motion(9_000_000)));
        assert!(!clock.is_restart(&motion(9_000_000 - STEP_US)));
        assert!(clock.is_restart(&motion(9_000_000 - 2 * STEP_US - 1)));
    }
}
