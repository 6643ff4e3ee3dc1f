//! The way of the arm: straight from scan to scan.

/// Where the arm was last; nowhere before the fingertip is set down.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path {
    last: Option<(f64, f64)>,
}

/// A straight piece of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// When it begins, in s.
    pub begin_s: f64,
    /// For how long it lasts, in s: above 0.
    pub time_s: f64,
    /// The arm's velocity on it, in m/s.
    pub arm_m_s: f64,
}

impl Path {
    /// Goes on to `arm_m` at `t_s`. None for the first place, and for an instant that is not after the last,
    /// which is passed over.
    pub fn to(&mut self, t_s: f64, arm_m: f64) -> Option<Leg> {
        let Some((begin_s, begin_m)) = self.last else {
            self.last = Some((t_s, arm_m));
            return None;
        };
        let time_s = t_s - begin_s;
        if time_s <= 0.0 {
            return None;
        }
        self.last = Some((t_s, arm_m));
        Some(Leg {
            begin_s,
            time_s,
            arm_m_s: (arm_m - begin_m) / time_s,
        })
    }
}
