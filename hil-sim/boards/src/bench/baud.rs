//! What a UART makes of a line at another baud rate than its own: not noise, but the sender's bits,
//! sampled at the wrong instants.

use std::collections::VecDeque;

/// A start bit, eight bits of data, a stop bit.
const WORD_BITS: u32 = 10;
/// From the edge of the start bit to the middle of the stop bit.
const HEARD_BITS: f64 = 9.5;

/// A line with its sender at one rate and its receiver at another, 8N1.
#[derive(Clone, Debug)]
pub struct Mismatch {
    sent_bit_ns: f64,
    heard_bit_ns: f64,
    /// Words on the line: when each begins, in ns, and its bits, the start bit lowest.
    words: VecDeque<(f64, u16)>,
    /// From when on the receiver looks for the next start bit.
    looks_from_ns: f64,
}

impl Mismatch {
    /// A line at rest; the rates are in baud.
    pub fn new(sent_baud: u32, heard_baud: u32) -> Self {
        Self {
            sent_bit_ns: 1e9 / f64::from(sent_baud),
            heard_bit_ns: 1e9 / f64::from(heard_baud),
            words: VecDeque::new(),
            looks_from_ns: 0.0,
        }
    }

    /// The time of a word of the sender's, in ns.
    pub fn word_ns(&self) -> f64 {
        self.sent_bit_ns * f64::from(WORD_BITS)
    }

    /// The sender begins `byte` at `at_ns`, or when the word before is over.
    pub fn send(&mut self, at_ns: f64, byte: u8) {
        let free_ns = self
            .words
            .back()
            .map_or(0.0, |(begins_ns, _)| begins_ns + self.word_ns());
        let bits = 1 << (WORD_BITS - 1) | u16::from(byte) << 1;
        self.words.push_back((at_ns.max(free_ns), bits));
    }

    /// The next byte that the receiver has heard of a line that is known up to `until_ns`. A word without
    /// its stop bit counts as one.
    pub fn hear(&mut self, until_ns: f64) -> Option<u8> {
        let word_ns = self.word_ns();
        let starts_ns = self.low_from(self.looks_from_ns)?;
        let heard_ns = starts_ns + HEARD_BITS * self.heard_bit_ns;
        if heard_ns > until_ns {
            return None;
        }
        let bit = |bit: u32| starts_ns + (1.5 + f64::from(bit)) * self.heard_bit_ns;
        let byte = (0..8).fold(0, |byte, nth| byte | u8::from(self.level(bit(nth))) << nth);
        self.looks_from_ns = heard_ns;
        while let Some((begins_ns, _)) = self.words.front()
            && begins_ns + word_ns <= heard_ns
        {
            self.words.pop_front();
        }
        Some(byte)
    }

    fn level(&self, at_ns: f64) -> bool {
        let bit = |&(begins_ns, bits): &(f64, u16)| {
            let bit = ((at_ns - begins_ns) / self.sent_bit_ns).floor();
            let within = (0.0..f64::from(WORD_BITS)).contains(&bit);
            within.then(|| bits >> bit as u32 & 1 == 1)
        };
        self.words.iter().find_map(bit).unwrap_or(true)
    }

    /// When the line is low for the first time from `from_ns` on.
    fn low_from(&self, from_ns: f64) -> Option<f64> {
        let low = |&(begins_ns, bits): &(f64, u16)| {
            (0..WORD_BITS)
                .filter(|bit| bits >> bit & 1 == 0)
                .map(|bit| begins_ns + f64::from(bit) * self.sent_bit_ns)
                .find(|bit_ns| bit_ns + self.sent_bit_ns > from_ns)
                .map(|bit_ns| bit_ns.max(from_ns))
        };
        self.words.iter().find_map(low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heard(sent_baud: u32, heard_baud: u32, bytes: &[u8]) -> Vec<u8> {
        let mut line = Mismatch::new(sent_baud, heard_baud);
        for &byte in bytes {
            line.send(1_000.0, byte);
        }
        let all = std::iter::from_fn(|| line.hear(1e12)).collect();
        assert!(line.words.len() <= 1, "nothing is kept that has been heard");
        all
    }

    #[test]
    fn rates_within_two_percent_understand_each_other() {
        let all: Vec<u8> = (0..=255).collect();
        for other in [921_600, 904_000, 940_000] {
            assert_eq!(heard(921_600, other, &all), all);
            assert_eq!(heard(other, 921_600, &all), all);
        }
    }

    #[test]
    fn at_a_third_of_the_rate_every_third_bit_is_seen() {
        // 0x66 is 0 0110 0110 1 on the line, from the start bit on. The receiver samples it 4.5 and 7.5 bits
        // after the edge, then rest.
        assert_eq!(heard(115_200, 38_400, &[0x66]), [0b1111_1110]);
    }

    #[test]
    fn a_fast_receiver_sees_every_slow_bit_many_times() {
        // A start bit of eight times the length: one word of zeros, then the ones of 0xFF and rest.
        assert_eq!(heard(115_200, 921_600, &[0xFF]), [0x80]);
    }

    #[test]
    fn what_is_not_known_yet_is_not_heard() {
        let mut line = Mismatch::new(115_200, 38_400);
        line.send(0.0, 0x66);
        let heard_ns = 9.5e9 / 38_400.0;
        assert_eq!(line.hear(heard_ns - 1.0), None);
        assert_eq!(line.hear(heard_ns + 1.0), Some(0b1111_1110));
        assert_eq!(line.hear(1e12), None);
    }
}
