//! Virtual time, held to a wall clock.

use std::time::{Duration, Instant};

use crate::WARM_UP_NS;

/// How far virtual time runs after the wall clock that it has fallen behind; what is more is given up.
const CATCHES_UP: Duration = Duration::from_millis(50);

/// How fast virtual time goes by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// So many virtual seconds in a second, above 0. Bytes that nobody reads in time are lost, as a
    /// serial port's are.
    Times(f64),
    /// As fast as it can, and no faster than the ports' readers: nothing is lost.
    Max,
}

impl Pace {
    /// As on a bench.
    pub const REAL: Self = Self::Times(1.0);
}

/// Waits for the wall clock.
#[derive(Debug)]
pub struct Pacer {
    pace: Pace,
    begun: Instant,
    begun_ns: u64,
    /// Time that was given up, in all.
    slipped: Duration,
}

impl Pacer {
    /// From the emulator's start on.
    pub fn new(pace: Pace) -> Self {
        Self {
            pace,
            begun: Instant::now(),
            begun_ns: 0,
            slipped: Duration::ZERO,
        }
    }

    /// Returns when the wall clock has come to the virtual instant `now_ns`. Instants must not decrease. The
    /// wall clock begins to count when the emulator has warmed up: before, nothing is waited for.
    /// Tells how far it is ahead, time given up included.
    pub fn wait(&mut self, now_ns: u64) -> Duration {
        let wall = Instant::now();
        if now_ns <= WARM_UP_NS {
            (self.begun, self.begun_ns) = (wall, now_ns);
        }
        match self.lag(now_ns, wall) {
            Ok(behind) => behind,
            Err(early) => {
                std::thread::sleep(early);
                self.slipped
            }
        }
    }

    /// How far behind `now_ns` is at `wall`, or how long to wait.
    fn lag(&mut self, now_ns: u64, wall: Instant) -> Result<Duration, Duration> {
        let Pace::Times(factor) = self.pace else {
            return Ok(Duration::ZERO);
        };
        let passed_s = (now_ns - self.begun_ns) as f64 * 1e-9 / factor;
        let due = self.begun + Duration::from_secs_f64(passed_s);
        if due > wall {
            return Err(due - wall);
        }
        let behind = wall - due;
        if behind > CATCHES_UP {
            // From here on as if it had been so from the start.
            self.slipped += behind - CATCHES_UP;
            self.begun = wall - CATCHES_UP;
            self.begun_ns = now_ns;
            return Ok(self.slipped + CATCHES_UP);
        }
        Ok(self.slipped + behind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn virtual_time_waits_for_the_wall_clock() {
        let mut pacer = Pacer::new(Pace::Times(2.0));
        let begun = pacer.begun;
        assert_eq!(pacer.lag(20_000_000, begun + 4 * MS), Err(6 * MS));
        assert_eq!(pacer.lag(20_000_000, begun + 12 * MS), Ok(2 * MS));
    }

    #[test]
    fn nothing_is_waited_for_until_the_emulator_has_warmed_up() {
        let mut pacer = Pacer::new(Pace::Times(0.01));
        for now_ns in (0..=WARM_UP_NS).step_by(500_000) {
            assert_eq!(pacer.wait(now_ns), Duration::ZERO);
        }
        let begun = pacer.begun;
        let due = pacer.lag(WARM_UP_NS + 1_000_000, begun);
        assert_eq!(due, Err(100 * MS));
    }

    #[test]
    fn it_catches_up_by_fifty_milliseconds_and_gives_up_the_rest() {
        let mut pacer = Pacer::new(Pace::REAL);
        let begun = pacer.begun;
        assert_eq!(pacer.lag(10_000_000, begun + 310 * MS), Ok(300 * MS));
        // 250 ms are gone for good; of the 50 that are left it has made up for 20, and for all.
        assert_eq!(pacer.lag(40_000_000, begun + 320 * MS), Ok(280 * MS));
        assert_eq!(pacer.lag(80_000_000, begun + 320 * MS), Err(10 * MS));
        assert_eq!(pacer.lag(80_000_000, begun + 330 * MS), Ok(250 * MS));
    }

    #[test]
    fn at_most_nothing_is_waited_for() {
        let mut pacer = Pacer::new(Pace::Max);
        let begun = pacer.begun;
        assert_eq!(pacer.lag(1 << 60, begun), Ok(Duration::ZERO));
    }
}
