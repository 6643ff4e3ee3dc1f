//! Whether what is felt goes with time and not with travel: a vibration that is no surface.
//!
//! A surface keeps its λ whatever the speed is. What shakes the whole sensor keeps its frequency, so that its λ goes with
//! the speed. At constant speed the two are the same.

use crate::estimator::Finding;

/// Share of an estimate in the means: a third of a second of them.
const SHARE: f32 = 1.0 / 32.0;
/// The same of the speed: a λ̂ is about what was felt some 60 ms ago, and goes with the speed of then.
const SPEED_SHARE: f32 = 1.0 / 6.0;
/// Changes are looked at over so many estimates.
const APART: usize = 6;
/// Mean square of λ's relative changes from which on it changes, (7 %)²: more than a fit's error.
const CHANGES: f32 = 0.005;
/// How many times as much λ has to change as the frequency does. Where one surface ends and another begins, both change
/// alike.
const TIMES: f32 = 2.0;

/// What is remembered of the last estimates.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vibration {
    speed_mm_s: f32,
    /// λ and frequency of the last estimates, how many there are, and where the next one goes.
    last: [[f32; 2]; APART],
    count: usize,
    next: usize,
    /// Mean squares of their relative changes.
    changes: [f32; 2],
}

impl Vibration {
    /// Takes an estimate, and the speed in mm/s at it. From a confidence of `level` on its λ is probable; if it is a
    /// vibration's, it is not stood by.
    pub fn withhold(&mut self, finding: &mut Finding, speed_mm_s: f32, level: f32) {
        self.speed_mm_s += SPEED_SHARE * (speed_mm_s - self.speed_mm_s);
        match finding.wavelength_mm {
            Some(mm) if finding.confidence >= level => {
                if self.is_one(mm) {
                    finding.confidence = 0.0;
                    finding.valid = false;
                }
            }
            _ => self.count = 0,
        }
    }

    fn is_one(&mut self, wavelength_mm: f32) -> bool {
        let now = [wavelength_mm, self.speed_mm_s / wavelength_mm];
        let before = core::mem::replace(&mut self.last[self.next], now);
        self.next = (self.next + 1) % APART;
        if self.count < APART {
            self.count += 1;
        } else {
            for ((mean, now), before) in self.changes.iter_mut().zip(now).zip(before) {
                let change = (now - before) / (now + before);
                *mean += SHARE * (4.0 * change * change - *mean);
            }
        }
        let [wavelength, frequency] = self.changes;
        wavelength > CHANGES && TIMES * frequency < wavelength
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether it is taken for one at the end of so many seconds of a hand of that speed in mm/s, where its λ̂ in mm is made
    /// of the speed some 60 ms ago and the time in s. Below 15 mm/s nothing is probable.
    fn is_one_at(
        speed: impl Fn(f32) -> f32,
        wavelength_mm: impl Fn(f32, f32) -> f32,
        end_s: f32,
    ) -> bool {
        let mut vibration = Vibration::default();
        let mut is_one = false;
        let mut t_s = 0.1;
        while t_s < end_s {
            let then = speed(t_s - 0.06);
            let mut finding = Finding {
                wavelength_mm: Some(wavelength_mm(then, t_s)),
                confidence: if then < 15.0 { 0.3 } else { 0.9 },
                valid: then >= 15.0,
                ..Finding::default()
            };
            vibration.withhold(&mut finding, speed(t_s), 0.6);
            is_one = then >= 15.0 && !finding.valid;
            t_s += 0.01;
        }
        is_one
    }

    /// At 70 mm/s and 0.83 Hz.
    fn swing(t_s: f32) -> f32 {
        70.0 * libm::fabsf(libm::sinf(core::f32::consts::TAU * 0.83 * t_s))
    }

    /// The same at the end of a second of a hand that swings.
    fn is_one(wavelength_mm: impl Fn(f32, f32) -> f32) -> bool {
        is_one_at(swing, wavelength_mm, 1.1)
    }

    #[test]
    fn a_vibration_that_has_gone_is_forgotten() {
        let swings_and_goes_on = |t_s: f32| if t_s < 1.0 { swing(t_s) } else { 60.0 };
        let vibration_then_surface = |speed, t_s| if t_s < 1.0 { speed / 30.0 } else { 2.0 };
        assert!(is_one_at(swings_and_goes_on, vibration_then_surface, 1.02));
        assert!(!is_one_at(swings_and_goes_on, vibration_then_surface, 4.0));
    }

    #[test]
    fn one_step_of_the_speed_is_no_vibration_whatever_is_felt() {
        let step = |t_s| if t_s < 0.7 { 50.0 } else { 56.0 };
        for end_s in [0.78, 0.82, 1.0] {
            assert!(!is_one_at(step, |speed, _| speed / 25.0, end_s), "{end_s}");
        }
    }

    #[test]
    fn what_was_felt_before_a_turn_is_not_compared_with_what_is_felt_after_it() {
        // 1 mm at 20 mm/s and 4 mm at 80 mm/s, in turn: 20 Hz each.
        let stroke = |t_s: f32| (t_s / 0.5) as u32 % 2;
        let speed = |t_s: f32| {
            let turns = t_s % 0.5 < 0.2;
            [[20.0, 80.0], [10.0, 10.0]][usize::from(turns)][stroke(t_s) as usize]
        };
        let surface = |speed, _| if speed > 50.0 { 4.0 } else { 1.0 };
        for end_s in [2.42, 2.92, 3.42] {
            assert!(!is_one_at(speed, surface, end_s), "{end_s}");
        }
    }

    #[test]
    fn a_wave_that_goes_with_the_speed_is_a_vibration() {
        for hz in [17.0, 30.0, 57.0] {
            assert!(is_one(|speed, _| speed / hz), "{hz} Hz");
        }
    }

    #[test]
    fn a_surface_is_none_nor_are_two_nor_one_with_a_gradient() {
        assert!(!is_one(|_, _| 2.0));
        // Where λ̂ is a tenth off by chance, either way in turn.
        assert!(!is_one(|_, t_s| 2.0 + 0.2 * libm::sinf(37.0 * t_s)));
        assert!(!is_one(|_, t_s| if t_s < 0.7 { 1.0 } else { 4.0 }));
        assert!(!is_one(|_, t_s| if t_s < 0.7 { 4.0 } else { 1.0 }));
        assert!(!is_one(|_, t_s| 2.0 + 0.5 * t_s));
    }
}
