//! When the outputs change, against the ticks that they belong to.

use crate::run::recording::{OutputRecord, TickRecord};

/// A spread of times, in µs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Half of them are no longer.
    pub p50_us: f64,
    /// 99 % of them are no longer.
    pub p99_us: f64,
    /// None is longer.
    pub max_us: f64,
}

impl Spread {
    /// Of times in µs, in any order; none of no times. A quantile is the time at which its share of all
    /// of them is reached.
    pub fn of(mut times_us: Vec<f64>) -> Option<Self> {
        times_us.sort_by(f64::total_cmp);
        let last = times_us.len().checked_sub(1)?;
        let quantile = |share: f64| {
            let reached = (share * times_us.len() as f64).ceil() as usize;
            times_us[reached.max(1) - 1]
        };
        Some(Self {
            p50_us: quantile(0.5),
            p99_us: quantile(0.99),
            max_us: times_us[last],
        })
    }
}

/// The LDAC edges of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Edges {
    /// From each edge's tick to the edge, in µs.
    pub after_us: Vec<f64>,
    /// The same, its spread.
    pub after: Spread,
    /// How far each is from the median of them, whichever way.
    pub jitter: Spread,
    /// From the first channel's change to the last's at one edge, the longest, in µs.
    pub skew_us: f64,
}

/// Measures the edges from `from_ns` on; none if there are none. An edge belongs to the last tick that
/// is not after it.
pub fn edges(ticks: &[TickRecord], outputs: &[OutputRecord], from_ns: u64) -> Option<Edges> {
    let mut after_us = Vec::new();
    let mut skew_ns = 0;
    for output in outputs.iter().filter(|output| output.at_ns >= from_ns) {
        let next = ticks.partition_point(|tick| tick.at_ns <= output.at_ns);
        let Some(tick) = next.checked_sub(1).and_then(|index| ticks.get(index)) else {
            continue;
        };
        after_us.push((output.at_ns - tick.at_ns) as f64 * 1e-3);
        skew_ns = skew_ns.max(output.skew_ns);
    }
    let after = Spread::of(after_us.clone())?;
    let jitter = Spread::of(
        after_us
            .iter()
            .map(|after_us| (after_us - after.p50_us).abs())
            .collect(),
    )?;
    Some(Edges {
        after_us,
        after,
        jitter,
        skew_us: skew_ns as f64 * 1e-3,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::recording::ACTUATORS;

    #[test]
    fn quantiles_are_the_times_at_which_their_share_is_reached() {
        let spread = Spread::of((1..=200).rev().map(f64::from).collect()).unwrap();
        assert_eq!(
            (spread.p50_us, spread.p99_us, spread.max_us),
            (100.0, 198.0, 200.0)
        );
        assert_eq!(Spread::of(Vec::new()), None);
        assert_eq!(Spread::of(vec![7.0]).unwrap().p50_us, 7.0);
    }

    #[test]
    fn an_edge_is_measured_from_its_own_tick_and_jitter_from_the_median_edge() {
        let ticks: Vec<TickRecord> = (0..100)
            .map(|tick| TickRecord {
                at_ns: tick * 500_000,
                encoder: 0,
                position_mm: 0.0,
            })
            .collect();
        // 40 µs after each tick, every tenth edge 3 µs later; the last is skewed by 250 ns.
        let outputs: Vec<OutputRecord> = ticks
            .iter()
            .enumerate()
            .map(|(index, tick)| OutputRecord {
                at_ns: tick.at_ns + 40_000 + if index % 10 == 9 { 3_000 } else { 0 },
                words: [0x8000; ACTUATORS],
                skew_ns: if index == 99 { 250 } else { 0 },
            })
            .collect();
        let edges = edges(&ticks, &outputs, 0).unwrap();
        assert_eq!((edges.after.p50_us, edges.after.max_us), (40.0, 43.0));
        assert_eq!((edges.jitter.p50_us, edges.jitter.p99_us), (0.0, 3.0));
        assert_eq!(edges.skew_us, 0.25);
        assert_eq!(edges.after_us.len(), 100);
        assert_eq!(super::edges(&ticks, &outputs, 60_000_000), None);
    }
}
