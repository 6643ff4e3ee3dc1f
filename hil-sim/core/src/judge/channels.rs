//! The mean voltage of each channel over the whole cycles that are at full amplitude.
//!
//! What full is, is known at the end of a run only. Until then the cycles' sums are kept by amplitude: one by one
//! while there are few, and where they are many, together with those of nearly the same amplitude. Only if the
//! amplitude that decides falls among such cycles are some on its wrong side: only of those within a hundredth of
//! the range of all amplitudes. Else the means are exact.

use crate::judge::voltage::Edge;
use crate::run::recording::{ACTUATORS, WORD_V};

/// The word for 0 V.
const ZERO: f64 = 32_768.0;
/// Sums kept at most, 0.4 kB each.
const SUMS_KEPT: usize = 256;

/// An instant in s, and the cycles travelled by then.
type Place = (f64, f64);

/// The integrals over travel of all channels' voltages, which go straight from point to point, in a cycle.
#[derive(Clone, Debug, Default)]
pub struct Cycle {
    sum: Sum,
    /// The weight that the last point has so far, in cycles.
    carried: f64,
}

#[derive(Clone, Debug)]
struct Sum {
    /// In words·cycles from 0 V.
    words: [f64; ACTUATORS],
    /// In cycles.
    travel: f64,
}

impl Default for Sum {
    fn default() -> Self {
        Self {
            words: [0.0; ACTUATORS],
            travel: 0.0,
        }
    }
}

impl Cycle {
    /// Adds what is between two places on the way from one point to the next: the last one to the one after it.
    pub fn add(&mut self, (from, to): (&Edge, &Edge), start: Place, end: Place) {
        let (mut advance, mut way) = (0.0, 0.0);
        if to.t_s > from.t_s {
            advance = end.1 - start.1;
            way = (0.5 * (start.0 + end.0) - from.t_s) / (to.t_s - from.t_s);
        }
        self.sum.weigh(from, self.carried + (1.0 - way) * advance);
        self.sum.travel += advance;
        self.carried = way * advance;
    }

    /// The whole of it, once it has come to an end before `last`.
    fn ended(mut self, last: &Edge) -> Sum {
        self.sum.weigh(last, self.carried);
        self.sum
    }
}

impl Sum {
    fn weigh(&mut self, edge: &Edge, weight: f64) {
        for (sum, &word) in self.words.iter_mut().zip(&edge.words) {
            *sum += weight * (f64::from(word) - ZERO);
        }
    }

    fn add(&mut self, other: &Self) {
        for (sum, more) in self.words.iter_mut().zip(&other.words) {
            *sum += more;
        }
        self.travel += other.travel;
    }
}

/// The cycles' sums by amplitude.
#[derive(Clone, Debug, Default)]
pub struct Means {
    /// Amplitudes rise, and do not overlap.
    kept: Vec<Alike>,
}

/// Cycles of nearly the same amplitude.
#[derive(Clone, Debug)]
struct Alike {
    lowest_v: f64,
    highest_v: f64,
    sum: Box<Sum>,
}

impl Means {
    /// Adds a cycle of this amplitude, in V, that ended before the point `last`.
    pub fn add(&mut self, amplitude_v: f64, cycle: Cycle, last: &Edge) {
        let sum = cycle.ended(last);
        let place = self
            .kept
            .partition_point(|alike| alike.highest_v < amplitude_v);
        match self.kept.get_mut(place) {
            Some(alike) if alike.lowest_v <= amplitude_v => alike.sum.add(&sum),
            _ => self.kept.insert(
                place,
                Alike {
                    lowest_v: amplitude_v,
                    highest_v: amplitude_v,
                    sum: Box::new(sum),
                },
            ),
        }
        if self.kept.len() > SUMS_KEPT {
            self.unite();
        }
    }

    /// Puts the two that are most alike together.
    fn unite(&mut self) {
        let range_v = |place: usize| self.kept[place + 1].highest_v - self.kept[place].lowest_v;
        let closest = (0..self.kept.len() - 1).min_by(|&a, &b| range_v(a).total_cmp(&range_v(b)));
        if let Some(place) = closest {
            let upper = self.kept.remove(place + 1);
            let lower = &mut self.kept[place];
            lower.highest_v = upper.highest_v;
            lower.sum.add(&upper.sum);
        }
    }

    /// Each channel's mean in V over the cycles of this amplitude or more; not finite if there is none.
    pub fn from(&self, amplitude_v: f64) -> [f64; ACTUATORS] {
        let mut whole = Sum::default();
        let enough = |alike: &&Alike| 0.5 * (alike.lowest_v + alike.highest_v) >= amplitude_v;
        for alike in self.kept.iter().filter(enough) {
            whole.add(&alike.sum);
        }
        whole.words.map(|words| words / whole.travel * WORD_V)
    }

    /// How many sums are held.
    pub fn held(&self) -> usize {
        self.kept.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cycle of one channel's voltage, the others at 0 V: so many words over 0 V, and back.
    fn cycle(means: &mut Means, amplitude_v: f64, words: u16) {
        let edge = |t_s: f64| {
            let mut edge = Edge {
                t_s,
                words: [0x8000; ACTUATORS],
            };
            edge.words[7] += words;
            edge
        };
        let mut cycle = Cycle::default();
        for part in 0..10 {
            let [from, to] = [part, part + 1].map(|part| 0.1 * f64::from(part));
            cycle.add((&edge(from), &edge(to)), (from, from), (to, to));
        }
        means.add(amplitude_v, cycle, &edge(1.0));
    }

    #[test]
    fn few_cycles_are_told_apart_to_the_last_bit_of_their_amplitude() {
        let mut means = Means::default();
        cycle(&mut means, 4.0, 100);
        cycle(&mut means, f64::next_up(4.0), 300);
        cycle(&mut means, 4.5, 200);
        let mean_v = |from_v: f64| means.from(from_v)[7];
        assert!((mean_v(4.0) - 200.0 * WORD_V).abs() < 1e-12);
        assert!((mean_v(f64::next_up(4.0)) - 250.0 * WORD_V).abs() < 1e-12);
        assert!((mean_v(4.5) - 200.0 * WORD_V).abs() < 1e-12);
        assert!(!mean_v(5.0).is_finite());
        assert_eq!(means.from(4.0)[8], 0.0);
    }

    #[test]
    fn many_cycles_need_no_more_room_and_their_mean_is_off_by_a_share_of_them() {
        let mut means = Means::default();
        // Amplitudes spread evenly over 0 to 5 V, in an order that knows nothing of it; 100 words in the upper
        // half, 200 in the lower.
        const CYCLES: u32 = 20_000;
        for number in 0..CYCLES {
            let place = number * 7_919 % CYCLES;
            let amplitude_v = 5.0 * f64::from(place) / f64::from(CYCLES);
            cycle(
                &mut means,
                amplitude_v,
                if amplitude_v >= 2.5 { 100 } else { 200 },
            );
            assert!(means.held() <= SUMS_KEPT);
        }
        // A 100th of the upper half at most is on the wrong side, at twice the voltage.
        let mean = means.from(2.5)[7] / WORD_V;
        assert!((100.0..=101.0).contains(&mean), "{mean}");
        let all = means.from(0.0)[7] / WORD_V;
        assert!((all - 150.0).abs() < 1e-9, "{all}");
    }
}
