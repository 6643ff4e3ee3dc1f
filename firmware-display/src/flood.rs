//! Whether messages come faster than a sensor sends them.

use crate::pace::quarters;

/// A bucket that each message fills by one and that runs out at four times the sensor's rate. It floods when it is
/// full, and until it is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flood {
    /// Most messages that may come at once: those of 400 ms, which is what a link that has stood still for a while
    /// may bring.
    most: u32,
    /// They may go on coming so often, in quarters of a millisecond.
    every: u32,
    /// In quarters of a millisecond until it is empty.
    level: u32,
    floods: bool,
}

impl Flood {
    /// No estimate has come; a sensor sends one every 10 ms.
    pub const OF_ESTIMATES: Self = Self::every_ms(10);
    /// No texture has come; a sensor sends one every 50 ms.
    pub const OF_TEXTURES: Self = Self::every_ms(50);

    const fn every_ms(ms: u32) -> Self {
        Self {
            most: 400 / ms,
            every: quarters(ms) / 4,
            level: 0,
            floods: false,
        }
    }

    /// A message has come. False if it is one too many.
    pub fn take(&mut self) -> bool {
        let full = self.most * self.every;
        // It takes as long to run out however many come.
        self.level = (self.level + self.every).min(full + self.every);
        self.floods |= self.level > full;
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

    const EVERY: u32 = Flood::OF_ESTIMATES.every;

    /// Milliseconds until estimates that come every `quarters` of a millisecond are a flood.
    fn flooded_after(every: u32) -> Option<u32> {
        let mut flood = Flood::OF_ESTIMATES;
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
        assert_eq!(flooded_after(EVERY), None);
        assert!(flooded_after(EVERY - 1).is_some());
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
        let mut flood = Flood::OF_ESTIMATES;
        assert_eq!((0..100).filter(|_| flood.take()).count(), 40);
        let mut lasted = 0;
        while flood.floods() {
            flood.elapse(1);
            lasted += 1;
        }
        assert_eq!(lasted, 41 * EVERY);
        assert!(flood.take());
    }
}
