//! Gauges and position that do not belong to the same instant.
//!
//! Gauges that are read late, at t, show the texture at x(t − skew): the contact is given the arm as it
//! was. Gauges that are read early cannot show what has not happened: then it is the encoder that is
//! given the arm as it was, which comes to the same but for the start.

use std::collections::VecDeque;

/// What the ADC and the encoder see of the arm, apart by the skew.
#[derive(Clone, Debug)]
pub struct Skew {
    late_s: f64,
    /// Instant in s and place in mm, the oldest first; the second is the first that is too new.
    past: VecDeque<(f64, f64)>,
}

impl Skew {
    /// The gauges are read `skew_us` later than the encoder; earlier, if negative.
    pub fn new(skew_us: f64) -> Self {
        Self {
            late_s: skew_us * 1e-6,
            past: VecDeque::new(),
        }
    }

    /// Where the arm is for the ADC at `t_s`, in mm, if it is at `arm_mm`. Once a scan, in order.
    #[inline]
    pub fn at_gauges_mm(&mut self, t_s: f64, arm_mm: f64) -> f64 {
        if self.late_s > 0.0 {
            self.delayed_mm(t_s, arm_mm, self.late_s)
        } else {
            arm_mm
        }
    }

    /// Where the arm is for the encoder at `t_s`, in mm, if it is at `arm_mm`. Once a scan, in order.
    #[inline]
    pub fn at_encoder_mm(&mut self, t_s: f64, arm_mm: f64) -> f64 {
        if self.late_s < 0.0 {
            self.delayed_mm(t_s, arm_mm, -self.late_s)
        } else {
            arm_mm
        }
    }

    /// The place `by_s` ago, on the straight line between the scans around it. Before the first scan the
    /// arm rested.
    fn delayed_mm(&mut self, t_s: f64, arm_mm: f64, by_s: f64) -> f64 {
        self.past.push_back((t_s, arm_mm));
        let at_s = t_s - by_s;
        while self.past.get(1).is_some_and(|next| next.0 <= at_s) {
            self.past.pop_front();
        }
        let (from_s, from_mm) = self.past[0];
        match self.past.get(1) {
            Some(&(to_s, to_mm)) if at_s > from_s => {
                from_mm + (to_mm - from_mm) * (at_s - from_s) / (to_s - from_s)
            }
            _ => from_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCAN_S: f64 = 250e-6;

    /// x = 50 t + 1000 t² mm: the straight line between two scans is off by 1000 · (250e-6)² / 4.
    fn place_mm(t_s: f64) -> f64 {
        50.0 * t_s + 1000.0 * t_s * t_s
    }

    #[test]
    fn late_gauges_see_the_arm_as_it_was_and_the_encoder_as_it_is() {
        for skew_us in [1.0, 250.0, 333.0, 5000.0] {
            let mut skew = Skew::new(skew_us);
            for scan in 0..400 {
                let t_s = f64::from(scan) * SCAN_S;
                let seen = skew.at_gauges_mm(t_s, place_mm(t_s));
                let due = place_mm((t_s - skew_us * 1e-6).max(0.0));
                assert!(
                    (seen - due).abs() < 2e-5,
                    "{skew_us} µs, {t_s} s: {seen} for {due}"
                );
                assert_eq!(skew.at_encoder_mm(t_s, 7.0), 7.0);
            }
            assert!(skew.past.len() <= 22, "no more is kept than is needed");
        }
    }

    #[test]
    fn early_gauges_are_an_encoder_that_is_late() {
        let mut skew = Skew::new(-1000.0);
        for scan in 0..400 {
            let t_s = f64::from(scan) * SCAN_S;
            assert_eq!(skew.at_gauges_mm(t_s, 7.0), 7.0);
            let seen = skew.at_encoder_mm(t_s, place_mm(t_s));
            assert!((seen - place_mm((t_s - 1e-3).max(0.0))).abs() < 2e-5);
        }
    }
}
