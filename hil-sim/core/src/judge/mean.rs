//! The mean voltage of a channel over a window, wherever the window begins.

/// The integral of a voltage that holds from one instant to the next.
pub struct Held<'a> {
    edges_s: &'a [f64],
    volts: &'a [f64],
    /// Of everything before each edge, in V·s.
    areas: Vec<f64>,
}

impl<'a> Held<'a> {
    /// `volts` holds what the voltage is from each of `edges_s` on; there is at least one.
    pub fn new(edges_s: &'a [f64], volts: &'a [f64]) -> Self {
        let mut area = 0.0;
        let mut areas = Vec::with_capacity(edges_s.len());
        for (index, &at_s) in edges_s.iter().enumerate() {
            if index > 0 {
                area += volts[index - 1] * (at_s - edges_s[index - 1]);
            }
            areas.push(area);
        }
        Self {
            edges_s,
            volts,
            areas,
        }
    }

    /// V·s from the first edge to `t_s`, which is not before it.
    fn area(&self, t_s: f64) -> f64 {
        let index = self.edges_s.partition_point(|&at_s| at_s <= t_s).max(1) - 1;
        self.areas[index] + self.volts[index] * (t_s - self.edges_s[index])
    }

    /// The mean of either sign that is farthest from 0 V, over all windows of `window_s` within
    /// `from_s` to `to_s` that begin at an edge; none if there is no such window.
    ///
    /// Between two beginnings the mean goes in straight lines while no edge passes either end, so that
    /// starts at edges alone miss at most half an edge's worth of it.
    pub fn farthest_mean(&self, (from_s, to_s): (f64, f64), window_s: f64) -> Option<f64> {
        let first = self.edges_s.partition_point(|&t_s| t_s < from_s);
        self.edges_s[first..]
            .iter()
            .take_while(|&&start_s| start_s + window_s <= to_s)
            .map(|&start_s| (self.area(start_s + window_s) - self.area(start_s)) / window_s)
            .max_by(|one, other| one.abs().total_cmp(&other.abs()))
    }
}

/// The whole cycles of `frequency_hz` that come nearest to a second, in s: one cycle at least.
pub fn about_a_second_s(frequency_hz: f64) -> f64 {
    frequency_hz.round().max(1.0) / frequency_hz
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn held(volts: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        (0..10_000)
            .map(|tick| f64::from(tick) / 2_000.0)
            .map(|t_s| (t_s, volts(t_s)))
            .unzip()
    }

    #[test]
    fn whole_cycles_of_a_sine_have_no_mean_and_an_arbitrary_second_has() {
        let (edges, volts) = held(|t| 5.0 * (TAU * 5.4 * t).sin());
        let held = Held::new(&edges, &volts);
        // The window ends between two ticks, of which the hold makes an error of half a tick's step
        // at most: 5 V · 2π 5.4 / 2 kHz · 0.25 ms per second.
        let whole = held
            .farthest_mean((1.0, 4.5), about_a_second_s(5.4))
            .unwrap();
        assert!(whole.abs() < 2.2e-5, "{whole}");
        // 5.4 cycles: the mean of the 0.4 left over is at most 5 V sin(π 0.4) / (π 5.4).
        let second = held.farthest_mean((1.0, 4.5), 1.0).unwrap();
        let due = 5.0 * (std::f64::consts::PI * 0.4).sin() / (std::f64::consts::PI * 5.4);
        assert!((second.abs() - due).abs() < 1e-2 * due, "{second} {due}");
    }

    #[test]
    fn a_standing_voltage_is_found_with_its_sign() {
        let (edges, volts) = held(|t| (TAU * 50.0 * t).sin() - 0.125);
        let held = Held::new(&edges, &volts);
        for window_s in [0.5, 1.0, 2.0] {
            let mean = held.farthest_mean((0.0, 5.0), window_s).unwrap();
            assert!((mean + 0.125).abs() < 1e-9, "{window_s} s: {mean}");
        }
    }

    #[test]
    fn a_window_longer_than_what_is_looked_at_has_no_mean() {
        let (edges, volts) = held(|_| 1.0);
        assert_eq!(
            Held::new(&edges, &volts).farthest_mean((0.0, 0.5), 1.0),
            None
        );
    }

    #[test]
    fn cycles_about_a_second_are_whole_and_at_least_one() {
        assert_eq!(about_a_second_s(5.0), 1.0);
        assert!((about_a_second_s(0.83) - 1.0 / 0.83).abs() < 1e-12);
        assert!((about_a_second_s(0.3) - 1.0 / 0.3).abs() < 1e-12);
        assert!((about_a_second_s(35.6) - 36.0 / 35.6).abs() < 1e-12);
    }
}
