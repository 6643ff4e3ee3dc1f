//! The stimulus' phase, accumulated from the hand's travel.
//!
//! Equation (12) of Okamoto et al. 2009, y = 5 sin(2π (v/λ) t) V, holds while v and λ are constant.
//! Read as φ = 2π ∫ v/λ dt = 2π ∫ dx/λ it holds always: each encoder count turns the phase by
//! Δx/λ, and a change of λ changes how fast the phase turns from now on, never where it is.
//!
//! The phase is an integer, so nothing is lost however long the hand rubs, it wraps freely, and
//! travel taken back takes the phase back to the same bit: a reversed stroke plays the wave back.

use crate::MICROMETRES_PER_COUNT;
use crate::pace::RateChange;

/// The shortest wavelength followed, in mm: 20 counts of the encoder.
pub const SHORTEST_WAVELENGTH_MM: f32 = 0.1;
/// The longest wavelength followed, in mm: longer than a fingertip's stroke needs.
pub const LONGEST_WAVELENGTH_MM: f32 = 50.0;

/// One turn, 2π, in phase units.
pub const TURN: f64 = (1_u64 << 32) as f64;

const MILLIMETRES_PER_COUNT: f64 = MICROMETRES_PER_COUNT as f64 / 1_000.0;

/// A surface wavelength that the stimulus can follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wavelength {
    mm: f32,
}

impl Wavelength {
    /// Takes `mm` if it is finite and from [`SHORTEST_WAVELENGTH_MM`] to [`LONGEST_WAVELENGTH_MM`].
    pub fn new(mm: f32) -> Option<Self> {
        // A NaN is in no range.
        (SHORTEST_WAVELENGTH_MM..=LONGEST_WAVELENGTH_MM)
            .contains(&mm)
            .then_some(Self { mm })
    }

    /// The wavelength in mm.
    pub const fn mm(self) -> f32 {
        self.mm
    }

    /// Phase of one encoder count, in turns / 2³², rounded to the nearest: off by half a unit at
    /// most, which is 1.2·10⁻⁶ of the longest wavelength's step and less of any other's.
    pub const fn phase_per_count(self) -> u32 {
        (TURN * MILLIMETRES_PER_COUNT / self.mm as f64 + 0.5) as u32
    }

    /// Phase of one micrometre, in turns / 2³², rounded to the nearest: off by half a unit at most, so
    /// by 2.4·10⁻⁶ turns at the furthest actuator.
    pub const fn phase_per_micrometre(self) -> u32 {
        (TURN / 1_000.0 / self.mm as f64 + 0.5) as u32
    }
}

/// A phase accumulator: 2³² is one turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Phase {
    turns: u32,
    /// The wavenumber, on its way to the target.
    per_count: u32,
    target: u32,
    per_tick: i32,
    ticks_left: u32,
}

impl Phase {
    /// Follows `wavelength` from here on: the wavenumber is there after `ticks` ticks, at once if none.
    pub const fn follow(&mut self, wavelength: Wavelength, ticks: u32) {
        let target = wavelength.phase_per_count();
        if target == self.target {
            return;
        }
        self.target = target;
        if ticks == 0 {
            self.settle();
        } else {
            self.glide(ticks);
        }
    }

    /// Has the wavenumber after `ticks` ticks, by equal steps; nothing changes with none.
    const fn glide(&mut self, ticks: u32) {
        self.ticks_left = ticks;
        if ticks > 0 {
            // A twentieth of a turn at most: no overflow.
            self.per_tick = (self.target as i32 - self.per_count as i32) / ticks as i32;
        }
    }

    /// Ticks until the wavenumber is that of the wavelength followed; 0 if it is.
    pub const fn ticks_left(&self) -> u32 {
        self.ticks_left
    }

    /// Ticks last another time from now on.
    pub const fn change_rate(&mut self, change: RateChange) {
        self.glide(change.ticks(self.ticks_left));
    }

    /// Has the wavenumber of the wavelength followed at once: for when nobody feels it.
    pub const fn settle(&mut self) {
        self.per_count = self.target;
        self.ticks_left = 0;
    }

    /// One tick in which the hand moves by `counts` of the encoder, back if negative. Before the first
    /// [`Phase::follow`] nothing moves. Returns by how much the phase turned, in turns / 2³², or almost a
    /// quarter of a turn if it was more.
    pub fn advance(&mut self, counts: i16) -> i32 {
        match self.ticks_left {
            0 => {}
            1 => self.settle(),
            _ => {
                self.per_count = self.per_count.wrapping_add_signed(self.per_tick);
                self.ticks_left -= 1;
            }
        }
        // Two of them may be subtracted from each other.
        const MOST: i64 = (1 << 30) - 1;
        let turned = i64::from(counts) * i64::from(self.per_count);
        // Two's complement: modulo 2³² a negative count takes the phase back by as much as the
        // positive one took it forward.
        self.turns = self.turns.wrapping_add(turned as u32);
        turned.clamp(-MOST, MOST) as i32
    }

    /// The phase, in turns / 2³².
    pub const fn turns(self) -> u32 {
        self.turns
    }

    /// Phase of one count now, in turns / 2³²; 0 before the first wavelength.
    pub const fn per_count(self) -> u32 {
        self.per_count
    }
}

#[cfg(test)]
mod tests {
    use protocol::UpdateRate;

    use super::*;

    #[test]
    fn phase_after_five_metres_is_travel_over_wavelength() {
        for mm in [0.1_f32, 0.83, 1.0, 2.0, 3.0, 4.0, 7.77, 50.0] {
            let mut phase = Phase::default();
            phase.follow(Wavelength::new(mm).unwrap(), 0);
            const COUNTS: u32 = 1_000_000;
            for _ in 0..COUNTS {
                phase.advance(1);
            }
            let expected = f64::from(COUNTS) * MILLIMETRES_PER_COUNT / f64::from(mm);
            // Each count is off by half a unit at most; f64 adds far less than one unit a turn.
            let bound = f64::from(COUNTS) * 0.5 / TURN + 1e-9;
            let off = f64::from(phase.turns()) / TURN - expected;
            let off = off - off.round();
            assert!(
                off.abs() <= bound,
                "{mm} mm: off by {off} turns, bound {bound}"
            );
        }
    }

    #[test]
    fn travel_taken_back_takes_the_phase_back_to_the_bit() {
        let mut phase = Phase::default();
        phase.follow(Wavelength::new(1.7).unwrap(), 0);
        let there: std::vec::Vec<u32> = (0..5_000_i32)
            .map(|i| {
                phase.advance((i % 37 - 3) as i16);
                phase.turns()
            })
            .collect();
        for i in (1..5_000_i32).rev() {
            phase.advance(-((i % 37 - 3) as i16));
            assert_eq!(phase.turns(), there[i as usize - 1]);
        }
    }

    #[test]
    fn one_large_step_equals_many_small_ones() {
        let mut once = Phase::default();
        once.follow(Wavelength::new(0.1).unwrap(), 0);
        let mut often = once;
        once.advance(i16::MIN);
        for _ in 0..32_768 {
            often.advance(-1);
        }
        assert_eq!(once, often);
    }

    #[test]
    fn a_new_wavelength_leaves_the_phase_where_it_is() {
        for ticks in [0, 40] {
            let mut phase = Phase::default();
            phase.follow(Wavelength::new(2.0).unwrap(), 0);
            phase.advance(123);
            let before = phase.turns();
            phase.follow(Wavelength::new(3.0).unwrap(), ticks);
            phase.advance(0);
            assert_eq!(phase.turns(), before);
        }
    }

    #[test]
    fn the_wavenumber_glides_by_equal_steps_and_arrives_exactly_in_its_time() {
        for (before_mm, after_mm) in [(2.0, 3.0), (0.1, 50.0), (50.0, 0.1)] {
            let [before, after] = [before_mm, after_mm].map(|mm| Wavelength::new(mm).unwrap());
            let mut phase = Phase::default();
            phase.follow(before, 0);
            phase.follow(after, 40);
            let whole = i64::from(after.phase_per_count()) - i64::from(before.phase_per_count());
            for tick in 1..=40 {
                phase.advance(1);
                let gone = i64::from(phase.per_count()) - i64::from(before.phase_per_count());
                // A step is short by less than a unit.
                assert!((gone - whole * tick / 40).abs() <= 40, "tick {tick}");
            }
            assert_eq!(phase.per_count(), after.phase_per_count());
            // The same wavelength told again does not begin anew.
            phase.follow(after, 40);
            assert_eq!(phase.ticks_left, 0);
        }
    }

    #[test]
    fn however_often_the_rate_changes_no_wavenumber_goes_beyond_its_end() {
        let [slow, fast] = [UpdateRate::Hz2000, UpdateRate::Hz4000];
        for every in [1, 2, 3, 5, 11] {
            for (before_mm, after_mm) in [(0.1, 50.0), (50.0, 0.1), (2.0, 3.0)] {
                let [before, after] = [before_mm, after_mm].map(|mm| Wavelength::new(mm).unwrap());
                let mut phase = Phase::default();
                phase.follow(before, 0);
                phase.follow(after, 40);
                let end = after.phase_per_count();
                let (mut last, is_rising) = (phase.per_count(), phase.per_count() < end);
                let mut rate = slow;
                for tick in 1..=200 {
                    phase.advance(1);
                    let now = phase.per_count();
                    assert!(now.abs_diff(end) <= last.abs_diff(end), "{tick}: {now}");
                    assert!(now == end || (now < end) == is_rising, "{tick}: {now}");
                    last = now;
                    if tick % every == 0 {
                        let from = rate;
                        rate = if rate == slow { fast } else { slow };
                        phase.change_rate(RateChange { from, to: rate });
                    }
                }
                assert_eq!(phase.per_count(), end);
            }
        }
    }

    #[test]
    fn the_turn_told_is_the_phases_up_to_a_quarter() {
        let mut phase = Phase::default();
        phase.follow(Wavelength::new(1.0).unwrap(), 0);
        for counts in [0, 1, -1, 49, -49] {
            let before = phase.turns();
            let turned = phase.advance(counts);
            assert_eq!(phase.turns().wrapping_sub(before) as i32, turned);
        }
        assert_eq!(phase.advance(i16::MAX), (1 << 30) - 1);
        assert_eq!(phase.advance(i16::MIN), 1 - (1 << 30));
    }

    #[test]
    fn wavelengths_that_cannot_be_followed_are_refused() {
        for mm in [
            0.0,
            -1.0,
            0.099,
            50.01,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            1e-40,
        ] {
            assert_eq!(Wavelength::new(mm), None, "{mm}");
        }
        assert!(Wavelength::new(SHORTEST_WAVELENGTH_MM).is_some());
        assert!(Wavelength::new(LONGEST_WAVELENGTH_MM).is_some());
    }
}
