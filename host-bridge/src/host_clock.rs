//! The host's clock: monotonic for what is measured, tied once to the calendar for what is written down.

use std::sync::OnceLock;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The same moment on both clocks.
struct Epoch {
    started: Instant,
    unix_ns: u64,
}

static EPOCH: OnceLock<Epoch> = OnceLock::new();

fn epoch() -> &'static Epoch {
    EPOCH.get_or_init(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        Epoch {
            started: Instant::now(),
            // A clock before 1970 is as good as one that stands at its beginning.
            unix_ns: since.map_or(0, |since| {
                u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
            }),
        }
    })
}

/// µs since this program first asked; never steps back.
pub fn now_us() -> u64 {
    u64::try_from(epoch().started.elapsed().as_micros()).unwrap_or(u64::MAX)
}

/// A moment of [`now_us`] in ns since 1970, by the calendar as it stood when this program first asked.
pub fn unix_ns(at_us: u64) -> u64 {
    epoch().unix_ns.saturating_add(at_us.saturating_mul(1_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_lie_on_the_calendar_as_far_apart_as_on_the_clock() {
        let now_us = now_us();
        assert_eq!(unix_ns(now_us + 7) - unix_ns(now_us), 7_000);
        let today_ns = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map(|since| since.as_nanos())
            .unwrap_or(0);
        let off_ns = i128::from(unix_ns(super::now_us())) - today_ns.cast_signed();
        assert!(off_ns.abs() < 1_000_000_000, "{off_ns} ns off");
    }
}
