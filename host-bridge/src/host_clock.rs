//! The host's clock: monotonic for what is measured, tied once to the calendar for what is written down. It
//! goes on while the computer sleeps, so that what is heard afterwards has its right place on the calendar.

use std::sync::OnceLock;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

/// A time of one of the system's clocks, since that clock's zero.
trait Clocks {
    /// Since the computer was started, what it slept included; never steps back.
    fn since_boot(&self) -> Duration;

    /// Since 1970.
    fn calendar(&self) -> Duration;
}

/// The computer's own.
struct System;

impl Clocks for System {
    fn since_boot(&self) -> Duration {
        read(ClockId::CLOCK_BOOTTIME)
    }

    fn calendar(&self) -> Duration {
        // A clock before 1970 is as good as one that stands at its beginning.
        read(ClockId::CLOCK_REALTIME)
    }
}

/// Every Linux since 2.6.39 has both.
fn read(clock: ClockId) -> Duration {
    clock_gettime(clock).map_or(Duration::ZERO, |time| {
        let s = u64::try_from(time.tv_sec()).unwrap_or(0);
        Duration::new(s, u32::try_from(time.tv_nsec()).unwrap_or(0))
    })
}

/// The same moment on both clocks.
struct Epoch<C> {
    clocks: C,
    started: Duration,
    unix_ns: u64,
}

impl<C: Clocks> Epoch<C> {
    fn begin(clocks: C) -> Self {
        Self {
            started: clocks.since_boot(),
            unix_ns: u64::try_from(clocks.calendar().as_nanos()).unwrap_or(u64::MAX),
            clocks,
        }
    }

    fn now_us(&self) -> u64 {
        let elapsed = self.clocks.since_boot().saturating_sub(self.started);
        u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX)
    }

    fn unix_ns(&self, at_us: u64) -> u64 {
        self.unix_ns.saturating_add(at_us.saturating_mul(1_000))
    }
}

static EPOCH: OnceLock<Epoch<System>> = OnceLock::new();

fn epoch() -> &'static Epoch<System> {
    EPOCH.get_or_init(|| Epoch::begin(System))
}

/// µs since this program first asked, what the computer slept included; never steps back.
pub fn now_us() -> u64 {
    epoch().now_us()
}

/// A moment of [`now_us`] in ns since 1970, by the calendar as it stood when this program first asked.
pub fn unix_ns(at_us: u64) -> u64 {
    epoch().unix_ns(at_us)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::time::{Instant, SystemTime, UNIX_EPOCH};

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

    /// A computer that is put to sleep.
    struct Sleeper {
        awake: Cell<Duration>,
        asleep: Cell<Duration>,
    }

    impl Clocks for &Sleeper {
        fn since_boot(&self) -> Duration {
            self.awake.get() + self.asleep.get()
        }

        fn calendar(&self) -> Duration {
            Duration::from_secs(1_000_000) + self.since_boot()
        }
    }

    #[test]
    fn what_is_heard_after_the_computer_slept_lies_right_on_the_calendar() {
        let sleeper = Sleeper {
            awake: Cell::new(Duration::from_secs(10)),
            asleep: Cell::default(),
        };
        let epoch = Epoch::begin(&sleeper);
        sleeper.awake.set(Duration::from_secs(13));
        sleeper.asleep.set(Duration::from_secs(3_600));
        assert_eq!(epoch.now_us(), 3_603_000_000);
        let today_ns = (&sleeper).calendar().as_nanos();
        assert_eq!(u128::from(epoch.unix_ns(epoch.now_us())), today_ns);
    }

    #[test]
    fn the_clock_is_the_systems_that_counts_its_sleep() {
        // The kernel's own word for it, in s with two decimals.
        let uptime_s = || -> f64 {
            let text = std::fs::read_to_string("/proc/uptime").expect("Linux has it");
            let first = text.split(' ').next().unwrap_or_default();
            first.parse().expect("a number")
        };
        let (before_s, began) = (uptime_s(), Instant::now());
        let since_boot_s = System.since_boot().as_secs_f64();
        let took_s = began.elapsed().as_secs_f64();
        assert!(since_boot_s >= before_s, "{since_boot_s} before {before_s}");
        assert!(
            since_boot_s <= before_s + took_s + 0.02,
            "{since_boot_s} after {before_s}"
        );
    }
}
