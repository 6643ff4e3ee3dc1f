//! Whether what is felt goes with time and not with travel: a vibration that is no surface.
//!
//! Over a surface each cycle of a gauge has the same length, and the faster the arm the shorter it takes. What shakes the
//! whole sensor takes the same time for each, and the faster the arm the longer it gets. At constant speed the two are
//! the same. Cycles are taken between two crossings of zero the same way, up to up and down to down, of one gauge without
//! its hum and its drift: a cycle is the least that can be looked at, and a fit over some waves sees no more than a mean.
//!
//! A mean square is kept of how cycles differ from the mean of the last ones, relatively, once of their durations and
//! once of their lengths. Where the arm turns, or is slow, the means begin anew and the mean squares go on.

use crate::estimator::{Finding, Touch};
use crate::travel::{PLACES_PER_UM, Place};

/// Share of a cycle in the means, after as many.
const SHARE: f32 = 1.0 / 8.0;
/// Cycles from which on they tell anything, half of them up to up.
const LEAST_CYCLES: u8 = 12;
/// So many are left out where the arm sets out or turns: the fingertip bends before it slips.
const LEFT_OUT: u8 = 4;
/// Slowest mean speed of a cycle that is taken, in places a ms: 10 mm/s.
const LEAST_SPEED: f32 = 10.0 * PLACES_PER_UM as f32;
/// Mean square from which on lengths or durations differ, (14 %)².
const DIFFER: f32 = 0.02;
/// The most that one cycle adds to a mean square: three that share a moment of a standing encoder are not enough to differ.
const MOST: f32 = 0.06;
/// Mean square up to which durations are a vibration's, (10 %)²: those of noise differ by more.
const STEADY: f32 = 0.01;
/// How many times as much the others have to differ.
const TIMES: f32 = 3.0;
/// By how much the speed has to differ from its mean for cycles to be taken, and for how many estimates they are then.
const CHANGE: f32 = 0.1;
/// See [`CHANGE`].
const LISTENS: u8 = 25;
/// Share of an estimate in the mean speed.
const SPEED_SHARE: f32 = 1.0 / 8.0;
/// How long nothing is stood by after the last sign of a vibration, in estimates: 1.5 s, longer than a stroke.
const HOLDS: u8 = 150;
/// From one sample to the next: 3 % of a cycle of 15 Hz, and 12 % of one of 60 Hz.
pub const PERIOD_MS: u32 = 2;
/// Shares of a sample in two means: what is above some 80 Hz is smoothed, and what is below some 5 Hz taken off.
const SMOOTH: f32 = 0.64;
/// See [`SMOOTH`].
const DRIFT: f32 = 0.06;
/// How far beyond zero a crossing is one, of the mean height: noise crosses a slow wave's zero many times.
const HYSTERESIS: f32 = 0.5;

/// The cycles of a gauge.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vibration {
    now_ms: u32,
    smooth: f32,
    drift: f32,
    /// Mean height above or below zero.
    height: f32,
    is_up: bool,
    /// When and where the last crossings down and up were.
    last: [(u32, Place); 2],
    /// Cycles that have been taken, and those since the arm set out or turned.
    taken: u8,
    met: u8,
    /// Means of duration in ms and length in places, and mean squares of the relative differences from them.
    means: [f32; 2],
    squares: [f32; 2],
    /// Mean speed, and estimates for which cycles are still taken after it has changed.
    speed_mm_s: f32,
    listens: u8,
    /// Estimates for which nothing is stood by.
    holds: u8,
}

impl Vibration {
    /// Takes what is felt every [`PERIOD_MS`].
    #[inline]
    pub fn push(&mut self, touch: &Touch) {
        // At constant speed nothing is told.
        if self.listens > 0 {
            self.listen(touch);
        }
    }

    #[inline(never)]
    fn listen(&mut self, touch: &Touch) {
        // The first of those that take part: all of them shake.
        let gauge = touch.usable.trailing_zeros() as usize;
        let x = touch.gauges.get(gauge).copied().unwrap_or(0.0);
        self.now_ms = self.now_ms.wrapping_add(PERIOD_MS);
        self.smooth += SMOOTH * (x - self.smooth);
        self.drift += DRIFT * (self.smooth - self.drift);
        let height = self.smooth - self.drift;
        self.height += DRIFT * (height.abs() - self.height);
        let beyond = if self.is_up { -height } else { height };
        if beyond > HYSTERESIS * self.height {
            self.is_up = !self.is_up;
            self.cross(touch.place);
        }
    }

    /// Takes an estimate, and the speed in mm/s at it. While what is felt is a vibration, it is not stood by.
    pub fn withhold(&mut self, finding: &mut Finding, speed_mm_s: f32) {
        let change_mm_s = speed_mm_s - self.speed_mm_s;
        if change_mm_s.abs() > CHANGE * self.speed_mm_s {
            self.listens = LISTENS;
        } else {
            self.listens = self.listens.saturating_sub(1);
        }
        if self.listens == 0 {
            self.met = 0;
        }
        self.speed_mm_s += SPEED_SHARE * change_mm_s;
        if self.holds > 0 {
            self.holds -= 1;
            finding.confidence = 0.0;
            finding.valid = false;
        }
    }

    #[inline(never)]
    fn cross(&mut self, place: Place) {
        let [same, other] = [self.is_up, !self.is_up].map(usize::from);
        let (_, half_way) = self.last[other];
        let (then_ms, from) = core::mem::replace(&mut self.last[same], (self.now_ms, place));
        let length = place.wrapping_sub(from);
        let cycle = [
            self.now_ms.wrapping_sub(then_ms) as f32,
            length.unsigned_abs() as f32,
        ];
        // Of a cycle in which the arm has turned back one half is shorter than nothing, or the other longer than all.
        let half = half_way.wrapping_sub(from);
        let is_straight = half ^ length >= 0 && half.unsigned_abs() <= length.unsigned_abs();
        if !is_straight || cycle[1] < LEAST_SPEED * cycle[0] {
            self.met = 0;
            return;
        }
        self.met = self.met.saturating_add(1);
        if self.met <= LEFT_OUT {
            self.means = cycle;
            return;
        }
        self.taken = self.taken.saturating_add(1).min(LEAST_CYCLES);
        let [share, of_mean] = [self.taken, self.met - LEFT_OUT].map(share_of);
        for ((mean, square), x) in self.means.iter_mut().zip(&mut self.squares).zip(cycle) {
            let differs = (x - *mean) / *mean;
            *square += share * ((differs * differs).min(MOST) - *square);
            *mean += of_mean * (x - *mean);
        }
        self.judge();
    }

    fn judge(&mut self) {
        let [duration, length] = self.squares;
        if self.taken < LEAST_CYCLES {
            return;
        }
        if duration < STEADY && length > DIFFER && length > TIMES * duration {
            self.holds = HOLDS;
        } else if duration > DIFFER && duration > TIMES * length {
            self.holds = 0;
        }
    }
}

/// Share of the last of so many in their mean, [`SHARE`] at least.
fn share_of(cycles: u8) -> f32 {
    (1.0 / f32::from(cycles)).max(SHARE)
}

#[cfg(test)]
mod tests {
    use core::f32::consts::TAU;

    use protocol::GAUGES;

    use super::*;

    /// What is felt at a place.
    fn touch(x: f32, x_mm: f32) -> Touch {
        Touch {
            gauges: [x; GAUGES],
            place: (x_mm * 1_000.0 * PLACES_PER_UM as f32) as Place,
            usable: 0b1_1110,
            ..Touch::default()
        }
    }

    /// Whether nothing is stood by at the end of so many seconds of an arm of that speed in mm/s, where the gauges feel that
    /// many turns of the time in s and the travel in mm.
    fn is_one_at(speed: impl Fn(f32) -> f32, turns: impl Fn(f32, f32) -> f32, end_s: f32) -> bool {
        let mut vibration = Vibration::default();
        let (mut x_mm, mut is_one) = (0.0, false);
        for ms in 0..(end_s * 1_000.0) as u32 {
            let t_s = ms as f32 * 1e-3;
            x_mm += speed(t_s) * 1e-3;
            if ms % PERIOD_MS == 0 {
                let felt = 100.0 * libm::sinf(TAU * turns(t_s, x_mm)) + 1_000.0;
                vibration.push(&touch(felt, x_mm));
            }
            if ms % 10 == 9 {
                let mut finding = Finding {
                    wavelength_mm: Some(2.0),
                    confidence: 0.9,
                    valid: true,
                    ..Finding::default()
                };
                vibration.withhold(&mut finding, speed(t_s).abs());
                is_one = !finding.valid;
                assert_eq!(is_one, finding.confidence == 0.0);
            }
        }
        is_one
    }

    /// At 70 mm/s and 0.83 Hz, to and fro.
    fn swing(t_s: f32) -> f32 {
        70.0 * libm::sinf(TAU * 0.83 * t_s)
    }

    /// The same at the end of two seconds of a hand that swings.
    fn is_one(turns: impl Fn(f32, f32) -> f32) -> bool {
        is_one_at(swing, turns, 2.0)
    }

    #[test]
    fn a_wave_that_goes_with_the_time_is_a_vibration() {
        for hz in [10.0, 17.0, 30.0, 57.0, 80.0] {
            assert!(is_one(|t_s, _| hz * t_s), "{hz} Hz");
        }
    }

    #[test]
    fn it_shows_within_the_second_stroke() {
        for hz in [17.0, 30.0, 57.0] {
            assert!(is_one_at(swing, |t_s, _| hz * t_s, 1.1), "{hz} Hz");
        }
    }

    #[test]
    fn a_vibration_that_has_gone_is_forgotten() {
        let swings_and_goes_on = |t_s: f32| if t_s < 2.0 { swing(t_s) } else { 60.0 };
        let vibration_then_surface = |t_s, x_mm| if t_s < 2.0 { 30.0 * t_s } else { x_mm / 2.0 };
        assert!(is_one_at(swings_and_goes_on, vibration_then_surface, 2.02));
        assert!(!is_one_at(swings_and_goes_on, vibration_then_surface, 4.0));
        // Where the arm swings on, the surface is told sooner.
        assert!(!is_one_at(swing, vibration_then_surface, 3.2));
    }

    #[test]
    fn a_surface_is_none_nor_are_two_nor_one_with_a_gradient() {
        for mm in [0.7, 2.0, 4.0, 8.0] {
            assert!(!is_one(|_, x_mm| x_mm / mm), "{mm} mm");
        }
        // Where a wave is a tenth longer or shorter by chance, either way in turn.
        assert!(!is_one(|_, x_mm| x_mm / 2.0 + 0.05 * libm::sinf(5.0 * x_mm)));
        let two = |x_mm: f32, first: f32, second: f32| {
            if x_mm < 13.0 {
                x_mm / first
            } else {
                x_mm / second
            }
        };
        assert!(!is_one(|_, x_mm| two(x_mm, 1.0, 4.0)));
        assert!(!is_one(|_, x_mm| two(x_mm, 4.0, 1.0)));
        assert!(!is_one(|_, x_mm| 40.0 * libm::logf(2.0 + x_mm / 40.0)));
    }

    #[test]
    fn slower_than_ten_millimetres_a_second_nothing_is_told() {
        for (most_mm_s, told) in [(9.0, false), (40.0, true)] {
            let swings = |t_s: f32| most_mm_s * libm::sinf(TAU * 0.83 * t_s);
            assert_eq!(
                is_one_at(swings, |t_s, _| 30.0 * t_s, 2.0),
                told,
                "{most_mm_s}"
            );
        }
    }

    #[test]
    fn a_surface_is_none_to_a_hand_that_trembles_on_it() {
        for half_mm in [0.4, 0.7, 1.0, 1.6, 2.5] {
            for hz in [2.0, 3.5, 5.0, 8.0] {
                let most_mm_s = TAU * hz * half_mm;
                let trembles = |t_s: f32| most_mm_s * libm::sinf(TAU * hz * t_s);
                assert!(
                    !is_one_at(trembles, |_, x_mm| x_mm / 2.0, 3.0),
                    "{half_mm} mm {hz} Hz"
                );
            }
        }
    }

    #[test]
    fn a_surface_is_none_where_the_encoder_stands_still_for_a_moment() {
        let mut told = 0;
        for (speed_mm_s, mm) in [(105.0, 1.478), (60.0, 2.0), (40.0, 4.0), (30.0, 0.7)] {
            for for_ms in 1..60_u8 {
                let for_s = f32::from(for_ms) * 1e-3;
                let stands = |t_s| (1.0..1.0 + for_s).contains(&t_s);
                let speed = |t_s| if stands(t_s) { 0.0 } else { speed_mm_s };
                if is_one_at(speed, |t_s, _| speed_mm_s * t_s / mm, 1.5) {
                    told += 1;
                }
            }
        }
        assert_eq!(told, 0);
    }

    #[test]
    fn a_surface_is_none_where_the_encoder_jumps() {
        let mut told = 0;
        for (speed_mm_s, mm) in [(21.9, 0.688), (60.0, 2.0), (40.0, 4.0), (105.0, 1.478)] {
            for jump_mm in [1.0, -1.0, 3.3, -3.3, 10.0, 27.1, -27.1] {
                let jumps = |t_s| (1.0..1.001).contains(&t_s) || (2.4005..2.4015).contains(&t_s);
                let speed = |t_s| speed_mm_s + if jumps(t_s) { jump_mm * 1e3 } else { 0.0 };
                for end_s in [1.1, 1.3, 1.5, 2.5, 2.7, 2.9] {
                    if is_one_at(speed, |t_s, _| speed_mm_s * t_s / mm, end_s) {
                        told += 1;
                    }
                }
            }
        }
        assert_eq!(told, 0);
    }

    #[test]
    fn at_constant_speed_and_where_it_makes_one_step_nothing_is_a_vibration() {
        for end_s in [0.5, 0.78, 0.82, 1.0, 2.0] {
            let turns = |t_s, _| 25.0 * t_s;
            assert!(!is_one_at(|_| 50.0, turns, end_s), "{end_s}");
            let step = |t_s| if t_s < 0.7 { 50.0 } else { 56.0 };
            assert!(!is_one_at(step, turns, end_s), "{end_s}");
        }
    }

    #[test]
    fn what_was_felt_before_a_turn_is_not_compared_with_what_is_felt_after_it() {
        // 1 mm at 20 mm/s there and 4 mm at 80 mm/s back, in turn: 20 Hz each.
        let there = |t_s: f32| t_s % 1.25 < 1.0;
        let speed = |t_s: f32| if there(t_s) { 20.0 } else { -80.0 };
        let surface = |t_s: f32, x_mm: f32| if there(t_s) { x_mm } else { x_mm / 4.0 };
        for end_s in [2.4, 2.49, 3.6, 3.74, 5.0] {
            assert!(!is_one_at(speed, surface, end_s), "{end_s}");
        }
        // The same where it goes on the same way, and slowly for a fifth of a second between the two.
        let stroke = |t_s: f32| (t_s / 0.5) as usize % 2;
        let speed = |t_s: f32| {
            if t_s % 0.5 < 0.2 {
                10.0
            } else {
                [20.0, 80.0][stroke(t_s)]
            }
        };
        let surface = |t_s: f32, x_mm: f32| x_mm / [1.0, 4.0][stroke(t_s)];
        for end_s in [2.42, 2.92, 3.42] {
            assert!(!is_one_at(speed, surface, end_s), "{end_s}");
        }
    }

    #[test]
    fn a_turn_at_full_speed_is_no_change_of_it() {
        for every_s in [0.21, 0.33, 0.5, 0.77] {
            let there = |t_s: f32| t_s % (2.0 * every_s) < every_s;
            let speed = |t_s: f32| if there(t_s) { 60.0 } else { -60.0 };
            for end_s in [1.0, 2.0, 3.3] {
                let surface = |_, x_mm: f32| x_mm / 2.0;
                assert!(!is_one_at(speed, surface, end_s), "{every_s}");
            }
        }
    }

    #[test]
    fn noise_is_none_and_noise_on_a_vibration_does_not_hide_it() {
        let mut random = 1_u32;
        let mut noise = move || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        for (hz, amplitude) in [(0.0, 0.0), (17.0, 2.0), (45.0, 2.0)] {
            let mut vibration = Vibration::default();
            let (mut x_mm, mut held) = (0.0, 0);
            for ms in (0..10_000).step_by(PERIOD_MS as usize) {
                let t_s = ms as f32 * 1e-3;
                x_mm += swing(t_s) * 1e-3 * PERIOD_MS as f32;
                let felt = amplitude * libm::sinf(TAU * hz * t_s) + noise();
                vibration.push(&touch(felt, x_mm));
                if ms % 10 == 0 {
                    vibration.withhold(&mut Finding::default(), swing(t_s).abs());
                    held += u32::from(vibration.holds > 0);
                }
            }
            let expected = if amplitude > 0.0 { 850..=1_000 } else { 0..=0 };
            assert!(expected.contains(&held), "{hz} Hz: {held}");
        }
    }
}
