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
