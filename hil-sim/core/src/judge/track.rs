//! Where the hand or the arm truly was, at any instant.

use crate::judge::seconds;
use crate::run::recording::Recording;

/// Half the time over which a velocity is taken, in s: two scans of the ADC.
const VELOCITY_REACH_S: f64 = 0.5e-3;

/// A true position over time, in s and mm, straight between the recorded instants.
#[derive(Clone, Debug, Default)]
pub struct Track {
    points: Vec<(f64, f64)>,
}

impl Track {
    /// A track through these points; the instants must not fall.
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            points: points.into_iter().collect(),
        }
    }

    /// The arm's, from the scans of the ADC.
    pub fn of_arm(recording: &Recording) -> Self {
        Self::new(
            recording
                .scans
                .iter()
                .map(|scan| (seconds(scan.at_ns), scan.position_mm)),
        )
    }

    /// The hand's, from the display's ticks.
    pub fn of_hand(recording: &Recording) -> Self {
        Self::new(
            recording
                .ticks
                .iter()
                .map(|tick| (seconds(tick.at_ns), tick.position_mm)),
        )
    }

    /// The recorded points: s, mm.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// The position at an instant, in mm; before the first point and after the last, theirs. None
    /// if there are no points.
    pub fn position_mm(&self, t_s: f64) -> Option<f64> {
        interpolate(&self.points, t_s)
    }

    /// When it went one way only, or not at all: the spans from one turning point to the next, in s.
    pub fn strokes(&self) -> Vec<(f64, f64)> {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else {
            return Vec::new();
        };
        let mut turns = Turns::default();
        let mut strokes = Vec::new();
        let (mut from_s, mut before_s) = (first.0, first.0);
        for &(t_s, position_mm) in &self.points {
            if turns.turned(position_mm) {
                strokes.push((from_s, before_s));
                from_s = before_s;
            }
            before_s = t_s;
        }
        strokes.push((from_s, last.0));
        strokes
    }

    /// The velocity at an instant, in mm/s. None with fewer than two points.
    pub fn velocity_mm_s(&self, t_s: f64) -> Option<f64> {
        let (start, end) = (self.points.first()?.0, self.points.last()?.0);
        let from = (t_s - VELOCITY_REACH_S).clamp(start, end);
        let to = (t_s + VELOCITY_REACH_S).clamp(start, end);
        if to <= from {
            return None;
        }
        Some((self.position_mm(to)? - self.position_mm(from)?) / (to - from))
    }
}

/// Finds where something turns back, from one point to the next.
#[derive(Clone, Copy, Debug, Default)]
pub struct Turns {
    before_mm: Option<f64>,
    forwards: Option<bool>,
}

impl Turns {
    /// Whether it turned at the point before this one, in mm. What rests before it turns back turns when it
    /// goes again.
    pub fn turned(&mut self, position_mm: f64) -> bool {
        let step_mm = position_mm - self.before_mm.replace(position_mm).unwrap_or(position_mm);
        step_mm != 0.0 && self.forwards.replace(step_mm > 0.0) == Some(step_mm < 0.0)
    }
}

/// The value at `t` of straight lines between `points` (t, value) with rising t; the ends go on
/// level. None without points.
pub(super) fn interpolate(points: &[(f64, f64)], t: f64) -> Option<f64> {
    let after = points.partition_point(|point| point.0 <= t);
    let Some(&(t1, value1)) = points.get(after) else {
        return points.last().map(|point| point.1);
    };
    let Some(&(t0, value0)) = after.checked_sub(1).and_then(|before| points.get(before)) else {
        return Some(value1);
    };
    Some(value0 + (value1 - value0) * (t - t0) / (t1 - t0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_is_straight_between_its_points_and_level_beyond() {
        let track = Track::new([(0.0, 1.0), (0.1, 2.0)]);
        assert_eq!(track.position_mm(-1.0), Some(1.0));
        assert!((track.position_mm(0.05).unwrap() - 1.5).abs() < 1e-12);
        assert_eq!(track.position_mm(1.0), Some(2.0));
        assert!((track.velocity_mm_s(0.05).unwrap() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn strokes_go_from_one_turning_point_to_the_next() {
        let track = Track::new([
            (0.0, 1.0),
            (1.0, 1.0),
            (2.0, 2.0),
            (3.0, 3.0),
            // A rest on the way, and one at the turning point.
            (4.0, 3.0),
            (5.0, 4.0),
            (6.0, 4.0),
            (7.0, 3.5),
            (8.0, 3.6),
        ]);
        assert_eq!(track.strokes(), [(0.0, 6.0), (6.0, 7.0), (7.0, 8.0)]);
        assert_eq!(Track::default().strokes(), []);
        assert_eq!(Track::new([(2.0, 1.0)]).strokes(), [(2.0, 2.0)]);
    }

    #[test]
    fn a_track_without_points_has_no_position_and_with_one_no_velocity() {
        assert_eq!(Track::default().position_mm(0.0), None);
        assert_eq!(Track::default().velocity_mm_s(0.0), None);
        let resting = Track::new([(0.0, 1.0)]);
        assert_eq!(resting.position_mm(3.0), Some(1.0));
        assert_eq!(resting.velocity_mm_s(0.0), None);
    }
}
