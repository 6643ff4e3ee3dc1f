//! How old messages were: percentiles without keeping every age.

use hdrhistogram::Histogram as Counts;

/// What is longer counts as that, in µs: 19 h.
const LONGEST_US: u64 = 1 << 36;
/// Decimal digits to which a time is known.
const DIGITS: u8 = 2;

/// How often each time came, in µs.
#[derive(Clone, Debug)]
pub struct Histogram(Counts<u64>);

impl Default for Histogram {
    fn default() -> Self {
        let counts = Counts::new_with_bounds(1, LONGEST_US, DIGITS);
        Self(counts.expect("bounds and digits that a histogram may have"))
    }
}

/// What times come to, in µs.
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
        self.0.saturating_record(time_us);
    }

    /// Median, 99th percentile and longest, rounded up by at most 1/100; `None` if nothing was counted.
    pub fn percentiles(&self) -> Option<Percentiles> {
        (!self.0.is_empty()).then(|| Percentiles {
            p50_us: self.0.value_at_quantile(0.5),
            p99_us: self.0.value_at_quantile(0.99),
            max_us: self.0.max(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_times_to_a_hundredth() {
        let mut times = Histogram::default();
        assert_eq!(times.percentiles(), None);
        (1..=1_000).for_each(|time_us| times.add(time_us));
        let found = times.percentiles().expect("times were counted");
        assert!((500..=505).contains(&found.p50_us), "{found:?}");
        assert!((990..=1_000).contains(&found.p99_us), "{found:?}");
        assert!((1_000..=1_010).contains(&found.max_us), "{found:?}");
        times.add(u64::MAX);
        let found = times.percentiles().expect("times were counted");
        assert!(found.max_us >= LONGEST_US, "{found:?}");
    }
}
