//! Times in a fixed number of counters, for percentiles without keeping every time.

/// Counters for each doubling: a time is known to 1/32 of itself.
const STEPS: usize = 32;
/// log₂ of [`STEPS`].
const STEP_BITS: u32 = STEPS.ilog2();
/// Doublings, from [`STEPS`] µs to 2³⁶ µs, 19 h; what is longer counts as that.
const DOUBLINGS: usize = 32;

/// How often each time came, in µs.
#[derive(Clone, Debug)]
pub struct Histogram {
    counts: Box<[u64; STEPS * DOUBLINGS]>,
    count: u64,
    longest_us: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            counts: Box::new([0; STEPS * DOUBLINGS]),
            count: 0,
            longest_us: 0,
        }
    }
}

/// What a histogram comes to, in µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Percentiles {
    /// Half of all times were no longer.
    pub p50_us: u64,
    /// All but one in a hundred were no longer.
    pub p99_us: u64,
    /// The longest.
    pub max_us: u64,
}

impl Histogram {
    /// Counts a time.
    pub fn add(&mut self, time_us: u64) {
        self.counts[place(time_us)] += 1;
        self.count += 1;
        self.longest_us = self.longest_us.max(time_us);
    }

    /// Counts all that `other` has counted.
    pub fn add_all(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(other.counts.iter()) {
            *count += more;
        }
        self.count += other.count;
        self.longest_us = self.longest_us.max(other.longest_us);
    }

    /// Median, 99th percentile and longest, rounded up by at most 1/32; none if nothing was counted.
    pub fn percentiles(&self) -> Option<Percentiles> {
        (self.count > 0).then(|| Percentiles {
            p50_us: self.quantile_us(50),
            p99_us: self.quantile_us(99),
            max_us: self.longest_us,
        })
    }

    /// The time that `percent` of all times did not exceed.
    fn quantile_us(&self, percent: u64) -> u64 {
        let wanted = (self.count * percent).div_ceil(100);
        let mut seen = 0;
        for (place, count) in self.counts.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                return highest_us(place).min(self.longest_us);
            }
        }
        self.longest_us
    }
}

/// The counter of a time.
fn place(time_us: u64) -> usize {
    if time_us < STEPS as u64 {
        return time_us as usize;
    }
    let shift = time_us.ilog2() - STEP_BITS;
    let doubling = shift as usize + 1;
    let step = (time_us >> shift) as usize - STEPS;
    (doubling * STEPS + step).min(STEPS * DOUBLINGS - 1)
}

/// The longest time that a counter counts.
const fn highest_us(place: usize) -> u64 {
    let (doubling, step) = (place / STEPS, (place % STEPS) as u64);
    if doubling == 0 {
        return step;
    }
    ((STEPS as u64 + step + 1) << (doubling - 1)) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_time_is_counted_where_it_lies_within_a_thirty_second_of_itself() {
        for time_us in (0..5_000)
            .chain((1..36).map(|bit| 1 << bit))
            .chain([123_456_789])
        {
            let highest_us = highest_us(place(time_us));
            assert!(highest_us >= time_us, "{time_us} in {highest_us}");
            assert!(
                highest_us - time_us <= time_us / 32,
                "{time_us} in {highest_us}"
            );
        }
    }

    #[test]
    fn percentiles_are_those_of_the_times() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.percentiles(), None);
        for time_us in 1..=1_000 {
            histogram.add(time_us);
        }
        histogram.add(u64::MAX);
        let found = histogram.percentiles().expect("times were counted");
        assert!((501..=517).contains(&found.p50_us), "{found:?}");
        assert!((991..=1_023).contains(&found.p99_us), "{found:?}");
        assert_eq!(found.max_us, u64::MAX);
    }

    #[test]
    fn two_histograms_are_one_of_all_their_times() {
        let (mut one, mut other) = (Histogram::default(), Histogram::default());
        one.add(10);
        other.add(30);
        one.add_all(&other);
        let found = one.percentiles().expect("times were counted");
        assert_eq!((found.p50_us, found.p99_us, found.max_us), (10, 30, 30));
    }
}
