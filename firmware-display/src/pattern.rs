//! How the wave lies over the fingertip: the phase by which each actuator is ahead.
//!
//! In travelling mode the actuator at xᵢ is 2π xᵢ/λ ahead of the fingertip's middle, so that the pattern
//! moves across the skin as the surface would; in uniform mode no place is ahead. Each actuator's trim
//! is added.
//!
//! The hand's phase goes on smoothly when λ changes, but 2π xᵢ/λ would jump. So each actuator glides to
//! its new phase by equal steps, the shorter way round: by half a turn at most.

use protocol::actuators::Actuator;
use protocol::{ACTUATORS, Mode};

use crate::pace::RateChange;
use crate::sine::sine;

/// The phase of each place ahead of the middle, on its way to where it is to be. Actuators that are at the same place
/// along the scan and have the same trim are one place, which is worked out once: all actuators in uniform mode
/// without trims, the columns of a grid in travelling mode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    travelling: bool,
    /// Which of the places below each actuator is at.
    place_of: [u8; ACTUATORS],
    /// So many of what follows are in use.
    places: usize,
    /// In µm from the fingertip's middle; 0 in uniform mode.
    places_um: [i16; ACTUATORS],
    /// Turns / 2¹⁶.
    trims: [u16; ACTUATORS],
    /// Turns / 2³².
    ahead: [u32; ACTUATORS],
    targets: [u32; ACTUATORS],
    per_tick: [i32; ACTUATORS],
    ticks_left: u32,
    /// Whether all targets are one.
    flat: bool,
}

impl Pattern {
    /// Places and trims of these actuators, with a wavenumber of 0.
    pub fn new(mode: Mode, actuators: &[Actuator; ACTUATORS]) -> Self {
        let mut pattern = Self {
            travelling: mode == Mode::Travelling,
            place_of: [0; ACTUATORS],
            places: 0,
            places_um: [0; ACTUATORS],
            trims: [0; ACTUATORS],
            ahead: [0; ACTUATORS],
            targets: [0; ACTUATORS],
            per_tick: [0; ACTUATORS],
            ticks_left: 0,
            flat: true,
        };
        for (actuator, place_of) in actuators.iter().zip(0..) {
            let place = pattern.place_for(actuator);
            pattern.place_of[place_of] = place as u8;
        }
        pattern.set_targets(0);
        pattern.settle();
        pattern
    }

    /// The place of an actuator; a new one if none of those before has it.
    fn place_for(&mut self, actuator: &Actuator) -> usize {
        let (x_um, trim) = (self.place_um(actuator), actuator.phase);
        let places = self.places_um.iter().zip(&self.trims);
        let found = places
            .take(self.places)
            .position(|place| place == (&x_um, &trim));
        found.unwrap_or_else(|| {
            let place = self.places;
            self.places_um[place] = x_um;
            self.trims[place] = trim;
            self.places += 1;
            place
        })
    }

    const fn place_um(&self, actuator: &Actuator) -> i16 {
        if self.travelling { actuator.x_um } else { 0 }
    }

    /// How many places are worked out, 1 to [`ACTUATORS`].
    pub const fn places(&self) -> usize {
        self.places
    }

    /// Which of the places each actuator is at.
    pub const fn place_of(&self) -> &[u8; ACTUATORS] {
        &self.place_of
    }

    /// Whether mode, place and trim of one actuator, of those there are, follow from its description.
    pub fn is_of(&self, index: usize, mode: Mode, actuator: &Actuator) -> bool {
        let place = usize::from(self.place_of[index]);
        self.travelling == (mode == Mode::Travelling)
            && place < self.places
            && self.places_um.get(place) == Some(&self.place_um(actuator))
            && self.trims.get(place) == Some(&actuator.phase)
    }

    /// Lies as a wave of `per_micrometre` (turns / 2³²) does after `ticks` ticks, one at least.
    pub fn aim(&mut self, per_micrometre: u32, ticks: u32) {
        if !self.travelling || !self.set_targets(per_micrometre) {
            return;
        }
        self.glide_to_targets(ticks.max(1));
    }

    /// Is there after `ticks` ticks, by equal steps; nothing changes with none.
    fn glide_to_targets(&mut self, ticks: u32) {
        self.ticks_left = ticks;
        if ticks == 0 {
            return;
        }
        for ((step, target), ahead) in self.per_tick.iter_mut().zip(&self.targets).zip(&self.ahead)
        {
            // As a signed number the difference is the shorter way.
            *step = target.wrapping_sub(*ahead) as i32 / ticks as i32;
        }
    }

    /// Whether any changed.
    fn set_targets(&mut self, per_micrometre: u32) -> bool {
        let mut changed = false;
        let mut flat = true;
        let first = self.target(0, per_micrometre);
        for place in 0..self.places {
            let target = self.target(place, per_micrometre);
            changed |= target != self.targets[place];
            flat &= target == first;
            self.targets[place] = target;
        }
        self.flat = flat;
        changed
    }

    fn target(&self, place: usize, per_micrometre: u32) -> u32 {
        let way = (i32::from(self.places_um[place]) as u32).wrapping_mul(per_micrometre);
        way.wrapping_add(u32::from(self.trims[place]) << 16)
    }

    /// Ticks last another time from now on.
    pub fn change_rate(&mut self, change: RateChange) {
        self.glide_to_targets(change.ticks(self.ticks_left));
    }

    /// Is there at once: for when nobody feels it.
    pub fn settle(&mut self) {
        self.ahead = self.targets;
        self.ticks_left = 0;
    }

    /// One tick of the glide.
    pub fn glide(&mut self) {
        match self.ticks_left {
            0 => {}
            1 => self.settle(),
            _ => {
                let places = self.ahead.iter_mut().zip(&self.per_tick);
                for (ahead, step) in places.take(self.places) {
                    *ahead = ahead.wrapping_add_signed(*step);
                }
                self.ticks_left -= 1;
            }
        }
    }

    /// Whether there is something left to glide.
    pub const fn is_gliding(&self) -> bool {
        self.ticks_left > 0
    }

    /// Whether all actuators are at the same phase.
    pub const fn is_flat(&self) -> bool {
        self.flat && self.ticks_left == 0
    }

    /// The places' sines in Q28, from the first one on, with `turns` / 2³² in the fingertip's middle.
    pub fn sines(&self, turns: u32, lanes: &mut [i32]) {
        for (lane, ahead) in lanes.iter_mut().zip(&self.ahead) {
            *lane = sine(turns.wrapping_add(*ahead));
        }
    }

    /// Each place: its phase ahead of the middle, in turns / 2³², and where it is along the scan, in µm from the middle
    /// (0 in uniform mode, where all are in the middle).
    pub fn iter(&self) -> impl Iterator<Item = (u32, i32)> {
        let places = self.ahead.iter().zip(&self.places_um);
        places
            .take(self.places)
            .map(|(ahead, x_um)| (*ahead, i32::from(*x_um)))
    }
}

#[cfg(test)]
mod tests {
    use protocol::actuators::{DEFAULT_ACTUATORS, grid};

    use super::*;
    use crate::phase::Wavelength;

    fn per_micrometre(mm: f32) -> u32 {
        Wavelength::new(mm).unwrap().phase_per_micrometre()
    }

    #[test]
    fn actuators_are_ahead_by_their_place_over_the_wavelength_and_their_trim() {
        let mut actuators = grid(1_501);
        actuators[17].phase = 12_345;
        actuators[20].x_um = -20_000;
        for (mode, far) in [(Mode::Travelling, 1.0), (Mode::Uniform, 0.0)] {
            for mm in [0.1_f32, 2.0, 50.0] {
                let mut pattern = Pattern::new(mode, &actuators);
                pattern.aim(per_micrometre(mm), 1);
                pattern.glide();
                for (place, actuator) in pattern.place_of.iter().zip(&actuators) {
                    let ahead = &pattern.ahead[usize::from(*place)];
                    let place = far * f64::from(actuator.x_um) / 1_000.0 / f64::from(mm);
                    let off = f64::from(*ahead) / 2_f64.powi(32)
                        - f64::from(actuator.phase) / 65_536.0
                        - place;
                    // Half a unit per micrometre.
                    let bound = 0.5 * f64::from(actuator.x_um.unsigned_abs()) / 2_f64.powi(32);
                    assert!((off - off.round()).abs() <= bound + 1e-12, "{mm} mm: {off}");
                }
                assert!(!pattern.is_flat());
            }
        }
    }

    #[test]
    fn actuators_at_the_same_place_are_worked_out_once() {
        let mut actuators = DEFAULT_ACTUATORS;
        assert_eq!(Pattern::new(Mode::Uniform, &actuators).places(), 1);
        assert_eq!(Pattern::new(Mode::Travelling, &actuators).places(), 10);
        actuators[13].phase = 1;
        let pattern = Pattern::new(Mode::Uniform, &actuators);
        assert_eq!(pattern.places(), 2);
        assert_eq!(pattern.place_of()[12..15], [0, 1, 0]);
        for (index, actuator) in actuators.iter_mut().enumerate() {
            actuator.phase = index as u16;
        }
        for mode in [Mode::Uniform, Mode::Travelling] {
            let pattern = Pattern::new(mode, &actuators);
            assert_eq!(pattern.places(), ACTUATORS);
            assert!((0..ACTUATORS).all(|index| pattern.is_of(index, mode, &actuators[index])));
            assert!(!pattern.is_of(7, mode, &actuators[8]));
        }
    }

    #[test]
    fn each_actuator_glides_by_equal_steps_the_shorter_way_and_arrives_exactly() {
        for ticks in [1, 7, 40, 1_000] {
            let mut pattern = Pattern::new(Mode::Travelling, &DEFAULT_ACTUATORS);
            pattern.aim(per_micrometre(2.0), 0);
            pattern.glide();
            let before = pattern.clone();
            pattern.aim(per_micrometre(3.1), ticks);
            for tick in 1..=ticks {
                assert!(pattern.is_gliding());
                pattern.glide();
                for i in 0..pattern.places() {
                    let whole = i64::from(pattern.targets[i].wrapping_sub(before.ahead[i]) as i32);
                    let gone = i64::from(pattern.ahead[i].wrapping_sub(before.ahead[i]) as i32);
                    let even = whole * i64::from(tick) / i64::from(ticks);
                    assert!(
                        (gone - even).abs() <= i64::from(ticks),
                        "{i}: {gone} {even}"
                    );
                }
            }
            assert_eq!(pattern.ahead, pattern.targets);
            assert!(!pattern.is_gliding());
        }
    }

    #[test]
    fn nothing_glides_in_uniform_mode_or_to_where_it_is() {
        let mut uniform = Pattern::new(Mode::Uniform, &DEFAULT_ACTUATORS);
        uniform.aim(per_micrometre(2.0), 40);
        assert!(uniform.is_flat() && !uniform.is_gliding());
        let mut pattern = Pattern::new(Mode::Travelling, &DEFAULT_ACTUATORS);
        for expected in [true, false] {
            pattern.aim(per_micrometre(2.0), 40);
            assert_eq!(pattern.is_gliding(), expected);
            pattern.settle();
        }
    }
}
