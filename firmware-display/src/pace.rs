//! How long a tick is. Times are counted in quarters of a millisecond, the shorter of the two ticks, so
//! that a change of the update rate changes none of them.

use protocol::UpdateRate;

/// The fastest update rate, in Hz.
const FASTEST_HZ: u32 = UpdateRate::Hz4000.hz();
/// Quarters of a millisecond in a millisecond.
const PER_MS: u32 = FASTEST_HZ / 1_000;

const _: () = assert!(FASTEST_HZ.is_multiple_of(1_000));
const _: () = assert!(FASTEST_HZ.is_multiple_of(UpdateRate::Hz2000.hz()));

/// Quarters of a millisecond in `ms` milliseconds.
pub const fn quarters(ms: u32) -> u32 {
    ms * PER_MS
}

/// Quarters of a millisecond in a tick.
pub const fn per_tick(rate: UpdateRate) -> u32 {
    FASTEST_HZ / rate.hz()
}

/// From one update rate to another: what is counted in ticks, and averages of what happens in a tick, go on as they were in
/// time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RateChange {
    /// The rate before.
    pub from: UpdateRate,
    /// The rate from now on.
    pub to: UpdateRate,
}

impl RateChange {
    /// Ticks that last as long as `ticks` did; none of none alone.
    pub const fn ticks(self, ticks: u32) -> u32 {
        ticks
            .saturating_mul(per_tick(self.from))
            .div_ceil(per_tick(self.to))
    }

    /// What happens in a tick where `amount` did.
    pub const fn a_tick(self, amount: i32) -> i32 {
        amount.saturating_mul(per_tick(self.to) as i32) / per_tick(self.from) as i32
    }
}
