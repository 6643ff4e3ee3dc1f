//! Places at which a gauge's signal crosses its mean, as marks along the surface.
//!
//! A texture crosses its mean at fixed places. As long as the arm goes one way, each crossing is a new
//! place. After a reversal the signal runs back through the places it has just passed: those crossings
//! are no new spacings, and an unsigned spacing across the turning point would be wrong by any amount.
//! So the marks are kept in the order in which they lie on the surface, with the one that was crossed
//! last as a cursor. A crossing in the direction of the last one moves the cursor on by one; the first
//! crossing in the other direction meets the same mark again. Only beyond the outermost marks does a
//! crossing add one, and drop the farthest.
//!
//! That needs crossings which alternate between rising and falling in time, as those of a signal with
//! hysteresis do: then a crossing of the same direction of travel is the neighbour's, and the first one
//! after a reversal has the same slope along the surface as the last, so it is the same mark.

use crate::travel::Place;

/// Marks kept: four half waves.
pub const MARKS: usize = 5;

/// A spacing of less than this part of the mean of the others is not this texture's; nor is a mark that is
/// found again farther away than that.
const SHORTEST: f32 = 0.4;
/// Nor is a spacing of more than this multiple.
pub const LONGEST: f32 = 1.7;
/// Waves that differ by less than this part of their mean are even.
const EVEN: f32 = 0.15;

/// The last marks, in the order of their places.
#[derive(Clone, Copy, Debug, Default)]
pub struct Landmarks {
    places: [Place; MARKS],
    count: u8,
    /// The mark that was crossed last.
    cursor: u8,
    forward: bool,
}

impl Landmarks {
    /// Takes the next crossing, at `place`, on the way to larger places if `forward`. A spacing that does
    /// not go with the others begins anew.
    pub fn cross(&mut self, place: Place, forward: bool) {
        let turned = forward != self.forward;
        self.forward = forward;
        let Some(last) = self.count().checked_sub(1) else {
            self.begin(place);
            return;
        };
        let cursor = usize::from(self.cursor);
        let known = if turned {
            Some(cursor)
        } else if forward {
            (cursor < last).then_some(cursor + 1)
        } else {
            cursor.checked_sub(1)
        };
        match known {
            Some(mark) => self.find_again(mark, place),
            None => self.go_beyond(cursor, place),
        }
    }

    fn find_again(&mut self, mark: usize, place: Place) {
        let off = place.wrapping_sub(self.places[mark]);
        let elsewhere = self
            .half_wave()
            .is_some_and(|half_wave| off.unsigned_abs() as f32 > SHORTEST * half_wave);
        if elsewhere {
            self.begin(place);
        } else {
            // Half way: what is left of delays pushes a mark ahead going and back coming.
            self.places[mark] = self.places[mark].wrapping_add(off / 2);
            self.cursor = mark as u8;
        }
    }

    fn go_beyond(&mut self, outermost: usize, place: Place) {
        let before = self.places[outermost];
        let ahead = place.wrapping_sub(before);
        let spacing = if self.forward {
            ahead
        } else {
            ahead.wrapping_neg()
        };
        let fits = |half_wave: f32| {
            (SHORTEST * half_wave..=LONGEST * half_wave).contains(&(spacing as f32))
        };
        if spacing <= 0 {
            self.begin(place);
            return;
        }
        if !self.half_wave().is_none_or(fits) {
            // It may be the first spacing of another texture.
            self.begin(before);
        }
        self.append(place);
    }

    /// The distance in places of two marks, by a straight line through all of them; none with less than
    /// two.
    ///
    /// The line's weights are odd about the middle, so an offset of the signal, which moves rising
    /// and falling crossings by the same amount in opposite directions, cancels with an odd number of
    /// marks.
    pub fn half_wave(&self) -> Option<f32> {
        let places = &self.places[..usize::from(self.count)];
        let (first, last) = (*places.first()?, *places.last()?);
        let at = |place: Place| place.wrapping_sub(first) as f32;
        match places.len() {
            5 => Some(0.2 * at(last) + 0.1 * (at(places[3]) - at(places[1]))),
            4 => Some(0.3 * at(last) + 0.1 * (at(places[2]) - at(places[1]))),
            3 => Some(0.5 * at(last)),
            2 => Some(at(last)),
            _ => None,
        }
    }

    /// Whether all waves between the marks, from one to the next but one, are about as long. Half waves need
    /// not be.
    pub fn is_even(&self) -> bool {
        let places = &self.places[..self.count()];
        let waves = || {
            places
                .windows(3)
                .map(|marks| marks[2].wrapping_sub(marks[0]))
        };
        let (Some(shortest), Some(longest)) = (waves().min(), waves().max()) else {
            return false;
        };
        (longest - shortest) as f32 <= EVEN / 2.0 * (longest + shortest) as f32
    }

    /// How many marks there are.
    pub fn count(&self) -> usize {
        usize::from(self.count)
    }

    /// How far `place` lies beyond the outermost marks; 0 between them.
    pub fn beyond(&self, place: Place) -> u32 {
        let first = self.places[0];
        let last = self.places[usize::from(self.count).saturating_sub(1)];
        let before = first.wrapping_sub(place).max(0);
        let after = place.wrapping_sub(last).max(0);
        before.max(after).unsigned_abs()
    }

    /// With this mark alone.
    fn begin(&mut self, place: Place) {
        self.places[0] = place;
        self.count = 1;
        self.cursor = 0;
    }

    /// A mark at the end that lies ahead.
    fn append(&mut self, place: Place) {
        let count = self.count();
        if self.forward && count < MARKS {
            self.places[count] = place;
        } else if self.forward {
            self.places.copy_within(1.., 0);
            self.places[MARKS - 1] = place;
        } else {
            self.places.copy_within(..MARKS - 1, 1);
            self.places[0] = place;
        }
        self.count = (count + 1).min(MARKS) as u8;
        self.cursor = if self.forward { self.count - 1 } else { 0 };
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::vec::Vec;

    use super::*;

    fn after(crossings: &[(Place, bool)]) -> Landmarks {
        let mut landmarks = Landmarks::default();
        for &(place, forward) in crossings {
            landmarks.cross(place, forward);
        }
        landmarks
    }

    fn marks(landmarks: &Landmarks) -> &[Place] {
        &landmarks.places[..landmarks.count()]
    }

    #[test]
    fn keeps_the_last_five_places_of_a_stroke_in_either_direction() {
        let forward: Vec<_> = (0..20).map(|n| (1_000 * n, true)).collect();
        let landmarks = after(&forward);
        assert_eq!(marks(&landmarks), [15_000, 16_000, 17_000, 18_000, 19_000]);
        assert_eq!(landmarks.half_wave(), Some(1_000.0));
        let backward: Vec<_> = (0..20).map(|n| (-1_000 * n, false)).collect();
        let landmarks = after(&backward);
        assert_eq!(
            marks(&landmarks),
            [-19_000, -18_000, -17_000, -16_000, -15_000]
        );
        assert_eq!(landmarks.half_wave(), Some(1_000.0));
    }

    #[test]
    fn keeps_spacings_where_places_wrap() {
        let start = i32::MAX - 2_500;
        let crossings: Vec<_> = (0..5)
            .map(|n| (start.wrapping_add(1_000 * n), true))
            .collect();
        let landmarks = after(&crossings);
        assert_eq!(landmarks.half_wave(), Some(1_000.0));
        assert!(landmarks.is_even());
        assert_eq!(landmarks.beyond(start.wrapping_add(4_100)), 100);
        assert_eq!(landmarks.beyond(start.wrapping_sub(50)), 50);
        assert_eq!(landmarks.beyond(start.wrapping_add(3_100)), 0);
    }

    #[test]
    fn meets_its_marks_again_after_a_reversal_and_goes_on_beyond_them() {
        let mut landmarks = after(&[(0, true), (1_000, true), (2_000, true), (3_000, true)]);
        // Back, and each of them is met again, with the same half wave all the while.
        for place in [3_000, 2_000, 1_000, 0] {
            landmarks.cross(place, false);
            let half_wave = landmarks.half_wave().unwrap_or(f32::NAN);
            assert!((half_wave - 1_000.0).abs() < 1_000.0 * 1e-6);
            assert_eq!(landmarks.count(), 4);
        }
        landmarks.cross(-1_000, false);
        landmarks.cross(-2_000, false);
        assert_eq!(marks(&landmarks), [-2_000, -1_000, 0, 1_000, 2_000]);
        // And forward again, in the middle of things.
        landmarks.cross(-2_000, true);
        landmarks.cross(-1_000, true);
        landmarks.cross(-1_000, false);
        landmarks.cross(-2_000, false);
        assert_eq!(marks(&landmarks), [-2_000, -1_000, 0, 1_000, 2_000]);
    }

    #[test]
    fn halves_what_delays_do_to_a_mark() {
        let mut landmarks = after(&[(10, true), (1_010, true), (2_010, true)]);
        landmarks.cross(1_990, false);
        landmarks.cross(990, false);
        assert_eq!(marks(&landmarks), [10, 1_000, 2_000]);
    }

    #[test]
    fn begins_anew_with_the_first_spacing_of_another_texture() {
        let mut landmarks = after(&[(0, true), (500, true), (1_000, true), (1_500, true)]);
        landmarks.cross(3_500, true);
        assert_eq!(marks(&landmarks), [1_500, 3_500]);
        landmarks.cross(4_000, true);
        assert_eq!(marks(&landmarks), [3_500, 4_000]);
        // A mark that is not where it was.
        landmarks.cross(3_000, false);
        assert_eq!(marks(&landmarks), [3_000]);
        // The arm went forward, the crossing lies behind.
        landmarks.cross(2_900, false);
        landmarks.cross(2_950, false);
        assert_eq!(marks(&landmarks), [2_950]);
    }

    #[test]
    fn an_offset_of_the_signal_does_not_touch_the_half_wave() {
        // Rising crossings 120 late, falling ones 120 early.
        let landmarks = after(&[
            (120, true),
            (880, true),
            (2_120, true),
            (2_880, true),
            (4_120, true),
        ]);
        assert_eq!(landmarks.half_wave(), Some(1_000.0));
        assert!(landmarks.is_even());
        let uneven = after(&[(0, true), (1_000, true), (2_000, true), (3_400, true)]);
        assert!(!uneven.is_even());
    }

    #[test]
    fn fits_the_straight_line_of_least_squares() {
        let places = [0, 1_040, 1_950, 3_010, 4_020];
        for count in 2..=5 {
            let crossings: Vec<_> = places[..count].iter().map(|&place| (place, true)).collect();
            let middle = (count - 1) as f64 / 2.0;
            let (mut above, mut below) = (0.0, 0.0);
            for (n, &place) in places[..count].iter().enumerate() {
                above += (n as f64 - middle) * f64::from(place);
                below += (n as f64 - middle).powi(2);
            }
            let got = f64::from(after(&crossings).half_wave().unwrap_or(f32::NAN));
            // f32, a few operations.
            assert!((got - above / below).abs() < 4_020.0 * 1e-6, "{got}");
        }
        assert_eq!(after(&[(5, true)]).half_wave(), None);
        assert_eq!(Landmarks::default().half_wave(), None);
    }
}
