//! What the way between the boards does to a stream of bytes, frame by frame.
//!
//! A frame ends with its 0x00. Its bytes keep their distances; delay and jitter move it as a whole, and
//! a frame never overtakes another unless `reorder` says so: that one comes right after the frame that
//! was sent after it. Everything is drawn from the seed, in the order in which bytes are pushed.

use std::collections::VecDeque;

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::scene::Link;

/// Time that a byte takes on the wire, in ns: ten bits at 921 600 baud.
pub const BYTE_NS: u64 = (10 * 1_000_000_000 + 921_600 / 2) / 921_600;

/// The way of one stream of bytes.
#[derive(Clone, Debug)]
pub struct Impairments {
    link: Link,
    delay_ns: u64,
    draws: Xoshiro256PlusPlus,
    /// Bytes on their way and when they arrive, in that order.
    way: VecDeque<(u64, u8)>,
    /// What becomes of the frame that is being pushed; none between frames.
    fate: Option<Fate>,
    /// The frame that waits for the next one to pass.
    held: Vec<u8>,
    last_due_ns: u64,
}

#[derive(Clone, Copy, Debug)]
enum Fate {
    Passes { delay_ns: u64 },
    IsLost,
    IsHeld,
}

impl Impairments {
    /// The way in one `direction` (any number; two directions draw differently) of a scene's link.
    pub fn new(link: &Link, seed: u64, direction: u64) -> Self {
        // The generator's seeding spreads neighbouring numbers.
        let seed = seed.wrapping_mul(4).wrapping_add(direction).wrapping_add(1);
        Self {
            link: *link,
            delay_ns: nanoseconds(link.delay_ms),
            draws: Xoshiro256PlusPlus::seed_from_u64(seed),
            way: VecDeque::with_capacity(1024),
            fate: None,
            held: Vec::new(),
            last_due_ns: 0,
        }
    }

    /// A byte whose last bit has left the sender's UART at `at_ns`. Instants must not decrease.
    #[inline]
    pub fn push(&mut self, at_ns: u64, byte: u8) {
        let fate = match self.fate {
            Some(fate) => fate,
            None => self.draw_fate(),
        };
        self.fate = Some(fate);
        match fate {
            Fate::Passes { delay_ns } => self.send(at_ns + delay_ns, byte),
            Fate::IsLost => {}
            Fate::IsHeld => self.held.push(byte),
        }
        if byte == 0 {
            self.fate = None;
            if matches!(fate, Fate::Passes { .. }) && !self.held.is_empty() {
                let held = std::mem::take(&mut self.held);
                for byte in held {
                    self.send(0, byte);
                }
            }
        }
    }

    /// The next byte that has arrived by `now_ns`, and when it did.
    #[inline]
    pub fn pop(&mut self, now_ns: u64) -> Option<(u64, u8)> {
        self.way.pop_front_if(|&mut (due_ns, _)| due_ns <= now_ns)
    }

    /// When the next byte arrives.
    #[inline]
    pub fn next_due(&self) -> Option<u64> {
        self.way.front().map(|&(due_ns, _)| due_ns)
    }

    fn draw_fate(&mut self) -> Fate {
        if self.link.loss > 0.0 && self.draws.random_bool(self.link.loss) {
            return Fate::IsLost;
        }
        // One waits at a time: two that wait would keep their order.
        if self.link.reorder > 0.0
            && self.held.is_empty()
            && self.draws.random_bool(self.link.reorder)
        {
            return Fate::IsHeld;
        }
        let mut delay_ns = self.delay_ns;
        if self.link.jitter_ms > 0.0 {
            delay_ns += nanoseconds(self.link.jitter_ms * self.draws.random::<f64>());
        }
        Fate::Passes { delay_ns }
    }

    fn send(&mut self, due_ns: u64, byte: u8) {
        let byte = if self.link.corrupt > 0.0 && self.draws.random_bool(self.link.corrupt) {
            byte ^ (1 << (self.draws.next_u32() % 8))
        } else {
            byte
        };
        // Not before the byte in front has left the wire.
        let free_ns = if self.last_due_ns == 0 {
            0
        } else {
            self.last_due_ns + BYTE_NS
        };
        self.last_due_ns = due_ns.max(free_ns);
        self.way.push_back((self.last_due_ns, byte));
    }
}

fn nanoseconds(ms: f64) -> u64 {
    (ms * 1e6).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME_SPACING_NS: u64 = 1_000_000;

    /// A fair link but for what `spoil` does to it.
    fn link(spoil: fn(&mut Link)) -> Link {
        let mut link = Link::default();
        spoil(&mut link);
        link
    }

    /// Sends frames `n n 0` for n from 1 to 200, again and again, a millisecond apart; gives what arrives.
    fn send(link: Link, seed: u64, frames: usize) -> Vec<(u64, u8)> {
        let mut weather = Impairments::new(&link, seed, 0);
        for frame in 0..frames {
            let number = 1 + (frame % 200) as u8;
            for (place, byte) in [number, number, 0].into_iter().enumerate() {
                let at_ns = frame as u64 * FRAME_SPACING_NS + (place as u64 + 1) * BYTE_NS;
                weather.push(at_ns, byte);
            }
        }
        let mut arrived = Vec::new();
        while let Some(due_ns) = weather.next_due() {
            assert_eq!(weather.pop(due_ns - 1), None);
            arrived.extend(weather.pop(due_ns));
        }
        arrived
    }

    fn numbers(arrived: &[(u64, u8)]) -> Vec<u8> {
        arrived.chunks(3).map(|frame| frame[0].1).collect()
    }

    #[test]
    fn a_byte_takes_ten_bits_of_921_600_baud() {
        assert_eq!(BYTE_NS, 10_851);
    }

    #[test]
    fn fair_weather_changes_nothing() {
        let arrived = send(Link::default(), 1, 300);
        assert_eq!(arrived.len(), 900);
        assert_eq!(arrived[0], (BYTE_NS, 1));
        assert_eq!(arrived[899], (299 * FRAME_SPACING_NS + 3 * BYTE_NS, 0));
    }

    #[test]
    fn delay_moves_every_byte_by_the_same_time() {
        let fair = send(Link::default(), 1, 100);
        let late = send(link(|link| link.delay_ms = 20.0), 1, 100);
        assert!(
            fair.iter()
                .zip(&late)
                .all(|(f, l)| l.0 == f.0 + 20_000_000 && l.1 == f.1)
        );
    }

    #[test]
    fn loss_takes_whole_frames_at_its_share() {
        let arrived = send(link(|link| link.loss = 0.25), 7, 20_000);
        assert!(
            arrived
                .chunks(3)
                .all(|frame| frame[0].1 == frame[1].1 && frame[2].1 == 0)
        );
        // Binomial: σ = √(20 000 · 0.25 · 0.75) = 61; 5 σ.
        let lost = 20_000 - arrived.len() as i64 / 3;
        assert!((lost - 5_000).abs() < 306, "{lost} lost");
        assert!(send(link(|link| link.loss = 1.0), 7, 100).is_empty());
    }

    #[test]
    fn jitter_spreads_frames_within_its_bound_and_keeps_their_order() {
        let fair = send(Link::default(), 3, 200);
        let arrived = send(link(|link| link.jitter_ms = 5.0), 3, 200);
        assert_eq!(numbers(&arrived), numbers(&fair));
        assert!(
            arrived
                .windows(2)
                .all(|pair| pair[0].0 + BYTE_NS <= pair[1].0)
        );
        let late: Vec<u64> = arrived.iter().zip(&fair).map(|(a, f)| a.0 - f.0).collect();
        // Five frames at most wait for one another: each adds its own length at most.
        assert!(late.iter().all(|&ns| ns <= 5_000_000 + 5 * 3 * BYTE_NS));
        assert!(late.iter().any(|&ns| ns > 4_000_000) && late.iter().any(|&ns| ns < 1_000_000));
    }

    #[test]
    fn reordered_frames_come_right_after_the_one_that_followed_them() {
        let arrived = numbers(&send(link(|link| link.reorder = 0.1), 5, 200));
        // Nothing is lost, but a held last frame has nothing to come after.
        assert!(arrived.len() >= 199);
        let mut swapped = 0;
        let mut at = 0;
        let mut expected = 1;
        while at < arrived.len() {
            if arrived[at] == expected {
                (at, expected) = (at + 1, expected + 1);
            } else {
                assert_eq!(arrived[at..at + 2], [expected + 1, expected]);
                (at, expected, swapped) = (at + 2, expected + 2, swapped + 1);
            }
        }
        // A frame that follows a held one is never held: a share of 0.1 / 1.1 of 200; σ < 4.3; 4 σ.
        assert!((2..=35).contains(&swapped), "{swapped} swapped");
        let all = numbers(&send(link(|link| link.reorder = 1.0), 5, 4));
        assert_eq!(all, [2, 1, 4, 3]);
    }

    #[test]
    fn corruption_turns_one_bit_of_its_share_of_bytes() {
        let fair = send(Link::default(), 9, 20_000);
        let arrived = send(link(|link| link.corrupt = 0.01), 9, 20_000);
        assert_eq!(arrived.len(), fair.len());
        let turned: Vec<u32> = arrived
            .iter()
            .zip(&fair)
            .map(|(a, f)| (a.1 ^ f.1).count_ones())
            .filter(|&n| n > 0)
            .collect();
        assert!(turned.iter().all(|&bits| bits == 1));
        // Binomial: σ = √(60 000 · 0.01 · 0.99) = 24.4; 5 σ.
        assert!(
            (turned.len() as i64 - 600).abs() < 122,
            "{} turned",
            turned.len()
        );
    }

    #[test]
    fn the_same_seed_gives_the_same_weather_and_another_seed_another() {
        let link = Link {
            delay_ms: 3.0,
            jitter_ms: 2.0,
            loss: 0.1,
            reorder: 0.1,
            corrupt: 0.01,
        };
        assert_eq!(send(link, 11, 2_000), send(link, 11, 2_000));
        assert_ne!(send(link, 11, 2_000), send(link, 12, 2_000));
    }

    #[test]
    fn the_two_directions_have_their_own_weather() {
        let link = link(|link| link.loss = 0.5);
        let survivors = |direction| {
            let mut weather = Impairments::new(&link, 1, direction);
            (0..64u64).for_each(|at| weather.push(at * BYTE_NS, 0));
            std::iter::from_fn(|| weather.pop(u64::MAX))
                .map(|(due, _)| due)
                .collect::<Vec<_>>()
        };
        assert_ne!(survivors(0), survivors(1));
    }
}
