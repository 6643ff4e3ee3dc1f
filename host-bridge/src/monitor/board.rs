//! What is known of one board.

use protocol::{Configuration, PortCounters, Status, Trip};

use super::orders::Orders;
use crate::link::Clocks;
use crate::state::State;

/// One board, as far as it is known.
#[derive(Clone, Debug, Default)]
pub struct Board {
    /// How the way to it stands; none before anything was heard of it.
    pub state: Option<State>,
    /// What it said of itself last, and when, in µs of [`crate::clock::now_us`].
    pub status: Option<(u64, Status)>,
    /// What has stopped a sensor board's arm for good; none while it may follow, or is not known.
    pub arm_stopped: Option<Trip>,
    /// Its configuration, once it was asked for.
    pub configuration: Option<Configuration>,
    /// What this program's end of the line counts; none where a recording is watched.
    pub counters: Option<PortCounters>,
    /// Its clock against this program's; none before the first exchange.
    pub clocks: Option<Clocks>,
    /// How often its fastest message comes: [`protocol::Estimate`] or [`protocol::Motion`].
    pub rate: Rate,
    /// What is to be said to it.
    pub orders: Orders,
}

impl Board {
    /// Whether the board is there and understood.
    pub fn is_known(&self) -> bool {
        self.state.as_ref().is_some_and(State::is_known)
    }

    /// Whether the way to it is known to lead nowhere.
    pub fn is_lost(&self) -> bool {
        self.state.as_ref().is_some_and(|state| !state.is_known())
    }

    /// An instant of the board's clock on this program's, for a message that came at `at_us`: by the
    /// clocks' offset where it is known and can be right, else when it came.
    pub fn own_us(&self, instant_us: u64, at_us: u64) -> u64 {
        /// Longer than any message is on its way.
        const MOST_US: u64 = 200_000;
        self.clocks
            .and_then(|clocks| instant_us.checked_add_signed(clocks.offset_us.checked_neg()?))
            .filter(|own_us| own_us.abs_diff(at_us) < MOST_US)
            .unwrap_or(at_us)
    }

    /// Time since its start, in µs, if it has said so and is still there.
    pub fn uptime_us(&self, now_us: u64) -> Option<u64> {
        let (at_us, status) = self.status.as_ref().filter(|_| !self.is_lost())?;
        let since_us = now_us.saturating_sub(*at_us);
        Some(status.uptime_us.saturating_add(since_us))
    }
}

/// How many come a second.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rate {
    since_us: u64,
    count: u32,
    per_s: u32,
}

impl Rate {
    /// Over so long it is taken, in µs.
    const OVER_US: u64 = 1_000_000;

    pub fn count(&mut self) {
        self.count += 1;
    }

    pub fn elapse(&mut self, now_us: u64) {
        let elapsed_us = now_us.saturating_sub(self.since_us);
        if elapsed_us >= Self::OVER_US {
            let per_s = (u64::from(self.count) * 1_000_000 + elapsed_us / 2) / elapsed_us;
            self.per_s = u32::try_from(per_s).unwrap_or(u32::MAX);
            self.count = 0;
            self.since_us = now_us;
        }
    }

    /// Of the last second, in Hz.
    pub const fn per_s(&self) -> u32 {
        self.per_s
    }
}

#[cfg(test)]
mod tests {
    use protocol::{ResetCause, RoleCounters, SensorCounters};

    use super::*;

    #[test]
    fn a_clock_at_its_end_stands() {
        let status = Status {
            uptime_us: u64::MAX,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            stack_free_bytes: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: RoleCounters::Sensor(SensorCounters::ZERO),
        };
        let board = Board {
            status: Some((0, status)),
            ..Board::default()
        };
        assert_eq!(board.uptime_us(7), Some(u64::MAX));
    }
}
