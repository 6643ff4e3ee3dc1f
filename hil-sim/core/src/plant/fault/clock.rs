//! A board's own clock beside the scene's.

use crate::scene::fault::{Fault, Kind};

/// The sensor board's clock under a scene's drifts; without any, the scene's own.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    drifts: Vec<Fault>,
}

impl Clock {
    /// The sensor board's clock under a scene's `faults`.
    pub fn new(faults: &[Fault]) -> Self {
        let drifts = faults.iter().filter(|fault| fault.kind == Kind::ClockDrift);
        Self {
            drifts: drifts.copied().collect(),
        }
    }

    /// Whether it is the scene's own.
    pub fn is_true(&self) -> bool {
        self.drifts.is_empty()
    }

    /// What the board's clock says when the scene's says `true_ns`.
    pub fn local_ns(&self, true_ns: u64) -> u64 {
        let ahead_ns: f64 = self
            .drifts
            .iter()
            .map(|drift| ahead_ns(drift, true_ns))
            .sum();
        true_ns.saturating_add_signed(ahead_ns.round() as i64)
    }

    /// What the scene's clock says when the board's says `local_ns`.
    pub fn true_ns(&self, local_ns: u64) -> u64 {
        if self.is_true() {
            return local_ns;
        }
        // Each turn leaves a thousandth of the error at most: a drift is 1000 ppm at most.
        let mut true_ns = local_ns;
        for _ in 0..8 {
            let ahead_ns = self.local_ns(true_ns).wrapping_sub(true_ns).cast_signed();
            true_ns = local_ns.saturating_add_signed(-ahead_ns);
        }
        true_ns
    }
}

fn ahead_ns(drift: &Fault, true_ns: u64) -> f64 {
    let to_ns = drift
        .ends_ns()
        .map_or(true_ns, |end_ns| end_ns.min(true_ns));
    to_ns.saturating_sub(drift.begins_ns()) as f64 * drift.values[0] * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drifting_clock_is_ahead_by_its_ppm_and_there_is_a_way_back() {
        let drift = Fault {
            values: [200.0, 0.0],
            for_s: Some(2.0),
            ..Fault::new(Kind::ClockDrift, 1.0)
        };
        let clock = Clock::new(&[drift]);
        for (true_s, ahead_us) in [(0.5, 0), (1.0, 0), (2.0, 200), (3.0, 400), (9.0, 400)] {
            let true_ns = (true_s * 1e9) as u64;
            let local_ns = clock.local_ns(true_ns);
            assert_eq!(local_ns, true_ns + ahead_us * 1_000);
            assert_eq!(clock.true_ns(local_ns), true_ns);
        }
    }
}
