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

use crate::estimator::Place;

/// Marks kept: four half waves.
pub const MARKS: usize = 5;

/// A spacing of less than this part of the mean of the others, or a mark found again farther away than
/// that, is not this texture's.
const SHORTEST: f32 = 0.4;
/// Nor is one of more than this multiple.
const LONGEST: f32 = 1.7;

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
    /// Takes the next crossing. A spacing that does not go with the others begins anew.
    pub fn cross(&mut self, place: Place, forward: bool) {
        if self.count == 0 {
            *self = Self {
                places: [place; MARKS],
                count: 1,
                cursor: 0,
                forward,
            };
            return;
        }
        let turned = forward != self.forward;
        self.forward = forward;
        let half_wave = self.half_wave();
        let cursor = usize::from(self.cursor);
        let last = usize::from(self.count) - 1;
        let known = match (turned, forward) {
            (true, _) => Some(cursor),
            (false, true) => (cursor < last).then_some(cursor + 1),
            (false, false) => cursor.checked_sub(1),
        };
        if let Some(mark) = known {
            let off = place.wrapping_sub(self.places[mark]);
            if half_wave.is_some_and(|half_wave| off.abs() as f32 > SHORTEST * half_wave) {
                self.begin(place, forward);
                return;
            }
            // Delays that are left push the marks one way going and the other way coming.
            self.places[mark] = self.places[mark].wrapping_add(off / 2);
            self.cursor = mark as u8;
            return;
        }
        let spacing = place.wrapping_sub(self.places[cursor]);
        let spacing = if forward {
            spacing
        } else {
            spacing.wrapping_neg()
        };
        let odd = match half_wave {
            Some(half_wave) => {
                (spacing as f32) < SHORTEST * half_wave || spacing as f32 > LONGEST * half_wave
            }
            None => spacing <= 0,
        };
        if odd {
            // The spacing itself may be the first of a new texture.
            let before = self.places[cursor];
            self.begin(before, forward);
            if spacing > 0 {
                self.append(place, forward);
            } else {
                self.begin(place, forward);
            }
            return;
        }
        self.append(place, forward);
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
            5 => Some(0.2 * (at(last)) + 0.1 * (at(places[3]) - at(places[1]))),
            4 => Some(0.3 * at(last) + 0.1 * (at(places[2]) - at(places[1]))),
            3 => Some(0.5 * at(last)),
            2 => Some(at(last)),
            _ => None,
        }
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

    fn begin(&mut self, place: Place, forward: bool) {
        *self = Self {
            places: [place; MARKS],
            count: 1,
            cursor: 0,
            forward,
        };
    }

    /// A mark at either end.
    fn append(&mut self, place: Place, forward: bool) {
        let count = usize::from(self.count);
        if forward {
            if count == MARKS {
                self.places.copy_within(1.., 0);
                self.places[MARKS - 1] = place;
            } else {
                self.places[count] = place;
                self.count += 1;
            }
            self.cursor = self.count - 1;
        } else {
            self.places.copy_within(..MARKS - 1, 1);
            self.places[0] = place;
            self.count = (self.count + 1).min(MARKS as u8);
            self.cursor = 0;
        }
    }
}
