//! Whether estimates come faster than a sensor sends them.

use crate::pace::quarters;

/// Most estimates that may come at once: those of 400 ms, which is what a link that has stood still for
/// a while may bring.
const MOST: u32 = 40;
/// They may go on coming four times as fast as a sensor sends them, every 2.5 ms.
const QUARTERS_PER_ESTIMATE: u32 = quarters(10) / 4;

/// A bucket that each estimate fills by one and that runs out at 400 Hz. It floods above 40, and until
/// it is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flood {
    /// In quarters of a millisecond until it is empty.
    level: u32,
    floods: bool,
}

impl Flood {
    /// Nothing has come.
    pub const NONE: Self = Self {
        level: 0,
        floods: false,
    };

    /// An estimate has come. False if it is one too many.
    pub fn take(&mut self) -> bool {
        const FULL: u32 = MOST * QUARTERS_PER_ESTIMATE;
        // It takes as long to run out however many come.
        self.level = (self.level + QUARTERS_PER_ESTIMATE).min(FULL + QUARTERS_PER_ESTIMATE);
        self.floods |= self.level > FULL;
        !self.floods
    }

    /// `quarters` of a millisecond have passed.
    pub fn elapse(&mut self, quarters: u32) {
        self.level = self.level.saturating_sub(quarters);
        self.floods &= self.level > 0;
    }

    /// Whether there are too many.
    pub const fn floods(self) -> bool {
        self.floods
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Milliseconds until estimates that come every `quarters` of a millisecond are a flood.
    fn flooded_after(every: u32) -> Option<u32> {
        let mut flood = Flood::NONE;
        (0..quarters(60_000)).find(|now| {
            if now % every == 0 {
                flood.take();
            }
            flood.elapse(1);
            flood.floods()
        })
    }

    #[test]
    fn four_times_the_sensors_rate_is_never_a_flood_and_more_is() {
        assert_eq!(flooded_after(quarters(10)), None);
        assert_eq!(flooded_after(QUARTERS_PER_ESTIMATE), None);
        assert!(flooded_after(QUARTERS_PER_ESTIMATE - 1).is_some());
    }

    #[test]
    fn one_estimate_in_each_tick_is_a_flood_within_thirty_milliseconds() {
        // The nth finds 10 n − 2 (n − 1) quarters of a millisecond in the bucket at 2 kHz, and
        // 10 n − (n − 1) at 4 kHz: more than 400 at the 50th and the 45th.
        assert_eq!(flooded_after(2), Some(2 * 49));
        assert_eq!(flooded_after(1), Some(44));
    }

    #[test]
    fn a_flood_ends_a_tenth_of_a_second_after_the_last_estimate() {
        let mut flood = Flood::NONE;
        assert_eq!((0..100).filter(|_| flood.take()).count(), 40);
        let mut lasted = 0;
        while flood.floods() {
            flood.elapse(1);
            lasted += 1;
        }
        assert_eq!(lasted, 41 * QUARTERS_PER_ESTIMATE);
        assert!(flood.take());
    }
}
