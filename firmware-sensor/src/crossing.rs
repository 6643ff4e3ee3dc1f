//! The impulse p(t) at each zero crossing of the band-passed signal (Okamoto et al. 2009, equation (1)).

/// Which side of zero a signal was on last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crossing {
    positive: Option<bool>,
}

impl Crossing {
    /// p(t): whether the signal changed sides between the sample before and this one, in either
    /// direction. Zero itself counts as positive, so that touching it is at most one crossing each
    /// way; the first sample is never a crossing.
    pub fn step(&mut self, x: f32) -> bool {
        let positive = x >= 0.0;
        self.positive
            .replace(positive)
            .is_some_and(|before| before != positive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn impulses<const N: usize>(signal: [f32; N]) -> [bool; N] {
        let mut crossing = Crossing::default();
        signal.map(|x| crossing.step(x))
    }

    #[test]
    fn emits_an_impulse_at_a_crossing_of_either_direction() {
        assert_eq!(
            impulses([1.0, -1.0, -2.0, 3.0, 4.0]),
            [false, true, false, true, false]
        );
    }

    #[test]
    fn counts_a_sample_that_is_exactly_zero_once() {
        assert_eq!(impulses([-1.0, 0.0, 1.0]), [false, true, false]);
        assert_eq!(impulses([1.0, -0.0, -1.0]), [false, false, true]);
    }

    #[test]
    fn is_silent_on_a_dead_gauge() {
        assert_eq!(impulses([0.0; 8]), [false; 8]);
        assert_eq!(impulses([f32::NAN; 8]), [false; 8]);
    }

    #[test]
    fn counts_two_impulses_per_cycle_of_a_sine() {
        let mut crossing = Crossing::default();
        let count = (0..1_000)
            .filter(|&ms| {
                let t_s = f64::from(ms) / 1_000.0;
                let x = libm::sin(2.0 * core::f64::consts::PI * 35.0 * t_s + 0.3);
                crossing.step(x as f32)
            })
            .count();
        assert_eq!(count, 70);
    }
}
