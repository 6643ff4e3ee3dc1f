//! How far the peer's clock is ahead of one's own, from [`Ping`](crate::Ping) and [`Pong`].

use crate::message::Pong;

/// Exchanges looked back on.
const EXCHANGES: usize = 8;

/// One exchange's result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Exchange {
    offset_us: i64,
    round_trip_us: u64,
}

/// The peer's clock against one's own, as NTP finds it (RFC 5905, section 8):
/// offset θ = ((t₂ − t₁) + (t₃ − t₄)) / 2, round trip δ = (t₄ − t₁) − (t₃ − t₂).
///
/// Of the last eight exchanges the one with the shortest round trip counts: it has waited least in
/// queues, and θ is wrong by no more than δ/2. At one exchange a second, two crystals 100 ppm apart
/// drift 0.8 ms over those eight.
#[derive(Clone, Debug, Default)]
pub struct ClockOffset {
    exchanges: [Option<Exchange>; EXCHANGES],
    next: usize,
}

impl ClockOffset {
    /// No exchange yet.
    pub const fn new() -> Self {
        Self {
            exchanges: [None; EXCHANGES],
            next: 0,
        }
    }

    /// Takes an answer that came at `now_us` of one's own clock. False, and nothing is changed, if
    /// its instants contradict each other: an answer before the question, or more time spent at the
    /// peer than passed here.
    pub fn on_pong(&mut self, pong: &Pong, now_us: u64) -> bool {
        let Some(elapsed_us) = now_us.checked_sub(pong.sent_us) else {
            return false;
        };
        let Some(held_us) = pong.answered_us.checked_sub(pong.received_us) else {
            return false;
        };
        let Some(round_trip_us) = elapsed_us.checked_sub(held_us) else {
            return false;
        };
        // In 128 bits nothing that a peer may claim overflows.
        let there = i128::from(pong.received_us) - i128::from(pong.sent_us);
        let back = i128::from(pong.answered_us) - i128::from(now_us);
        let Ok(offset_us) = i64::try_from((there + back).div_euclid(2)) else {
            return false;
        };
        self.exchanges[self.next] = Some(Exchange {
            offset_us,
            round_trip_us,
        });
        self.next = (self.next + 1) % EXCHANGES;
        true
    }

    /// Forgets everything: the peer was restarted, and its clock with it.
    pub fn clear(&mut self) {
        *self = Self::new();
    }

    /// The peer's clock minus one's own, in µs. None before the first exchange.
    pub fn offset_us(&self) -> Option<i64> {
        Some(self.best()?.offset_us)
    }

    /// The shortest round trip of the last eight exchanges, without the time spent at the peer, in
    /// µs: twice the bound of the offset's error.
    pub fn round_trip_us(&self) -> Option<u64> {
        Some(self.best()?.round_trip_us)
    }

    /// An instant of the peer's clock on one's own, in µs. None before the first exchange, or if it
    /// lies before one's own clock's start.
    pub fn to_own_us(&self, peer_us: u64) -> Option<u64> {
        let own_us = i128::from(peer_us) - i128::from(self.offset_us()?);
        u64::try_from(own_us).ok()
    }

    fn best(&self) -> Option<&Exchange> {
        self.exchanges
            .iter()
            .flatten()
            .min_by_key(|exchange| exchange.round_trip_us)
    }
}
