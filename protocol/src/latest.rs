//! The latest that a board knows of surface and hand, whoever said it.

use crate::message::{Estimate, Message, Motion};

/// The latest [`Estimate`] and [`Motion`], and when they were said or heard, in µs of the owner's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latest {
    estimate: Option<(u64, Estimate)>,
    motion: Option<(u64, Motion)>,
}

impl Latest {
    /// Nothing known yet.
    pub const fn new() -> Self {
        Self {
            estimate: None,
            motion: None,
        }
    }

    /// Takes note of what the owner says itself.
    pub fn said(&mut self, message: &Message) {
        match message {
            Message::Estimate(estimate) => self.estimate = Some((estimate.instant_us, *estimate)),
            Message::Motion(motion) => self.motion = Some((motion.instant_us, *motion)),
            _ => {}
        }
    }

    /// Takes note of what the owner hears at `now_us`.
    pub fn heard(&mut self, now_us: u64, message: &Message) {
        match message {
            Message::Estimate(estimate) => self.estimate = Some((now_us, *estimate)),
            Message::Motion(motion) => self.motion = Some((now_us, *motion)),
            _ => {}
        }
    }

    /// The latest estimate.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref().map(|(_, estimate)| estimate)
    }

    /// The latest motion.
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref().map(|(_, motion)| motion)
    }

    /// Time since the latest estimate, in ms.
    pub fn estimate_age_ms(&self, now_us: u64) -> Option<u64> {
        self.estimate
            .map(|(at_us, _)| now_us.saturating_sub(at_us) / 1_000)
    }

    /// Time since the latest motion, in ms.
    pub fn motion_age_ms(&self, now_us: u64) -> Option<u64> {
        self.motion
            .map(|(at_us, _)| now_us.saturating_sub(at_us) / 1_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, GaugeHealth, Range};

    fn estimate(instant_us: u64) -> Estimate {
        Estimate {
            sequence: 1,
            instant_us,
            wavelength_mm: Some(2.0),
            confidence: 0.9,
            valid: true,
            range: Range::T1,
            contact: Contact::Slip,
            counted_mm: None,
            amplitude_lsb: 90.0,
            velocity_um_s: 50_000,
            lag_um: None,
            gauges_used: 0b1_1111,
            health: [GaugeHealth::Good; 5],
        }
    }

    fn motion(instant_us: u64) -> Motion {
        Motion {
            sequence: 1,
            instant_us,
            position_um: 0,
            velocity_um_s: 0,
        }
    }

    #[test]
    fn what_is_said_ages_from_its_instant_and_what_is_heard_from_when_it_came() {
        let mut latest = Latest::new();
        assert_eq!((latest.estimate(), latest.motion()), (None, None));
        assert_eq!(latest.estimate_age_ms(5_000_000), None);
        assert_eq!(latest.motion_age_ms(5_000_000), None);
        latest.said(&Message::Estimate(estimate(1_000_000)));
        latest.said(&Message::Motion(motion(2_000_000)));
        assert_eq!(latest.estimate(), Some(&estimate(1_000_000)));
        assert_eq!(latest.motion(), Some(&motion(2_000_000)));
        assert_eq!(latest.estimate_age_ms(5_001_999), Some(4_001));
        assert_eq!(latest.motion_age_ms(5_001_999), Some(3_001));
        latest.heard(3_000_000, &Message::Estimate(estimate(7)));
        latest.heard(4_000_000, &Message::Motion(motion(8)));
        assert_eq!(latest.estimate(), Some(&estimate(7)));
        assert_eq!(latest.motion(), Some(&motion(8)));
        assert_eq!(latest.estimate_age_ms(5_002_000), Some(2_002));
        assert_eq!(latest.motion_age_ms(5_002_000), Some(1_002));
        // A clock that was read before is no age below none.
        assert_eq!(latest.motion_age_ms(0), Some(0));
    }
}
