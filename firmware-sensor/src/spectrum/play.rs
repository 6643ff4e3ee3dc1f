//! A follower with play, so that an encoder that dithers between counts is no travel.

use crate::travel::Place;

/// A follower with play: moves only once the place has moved more than the play's half width.
#[derive(Clone, Copy, Debug)]
pub(super) struct Play {
    pub(super) at: Option<Place>,
    half: i32,
}

impl Play {
    /// A follower that is put down where the first place is, with play of ± `half` places.
    pub(super) fn new(half: i32) -> Self {
        Self { at: None, half }
    }

    /// The place's movement beyond the play, in places.
    pub(super) fn follow(&mut self, place: Place) -> i32 {
        let at = self.at.get_or_insert(place);
        let away = place.wrapping_sub(*at);
        let travel = away - away.clamp(-self.half, self.half);
        *at = at.wrapping_add(travel);
        travel
    }
}
