//! Where the arm is and was: the encoder's 16-bit counter without its wraps, and velocities from it.

use crate::amplitude::MAX_WINDOW_MS;
use crate::{MICROMETRES_PER_COUNT, SAMPLE_RATE_HZ, decimate};

/// A place along x in quarters of a µm, which wraps freely: only differences mean anything, and phases,
/// which wrap too.
pub type Place = i32;
/// [`Place`] units in a µm.
pub const PLACES_PER_UM: i32 = 4;
/// [`Place`] units in a mm.
pub const PLACES_PER_MM: i32 = 1_000 * PLACES_PER_UM;

/// Below this speed, in mm/s, there is nothing to estimate: fingertip and surface stick (Okamoto et al.
/// 2009, section III-C), and 5 µm counts make more than a tenth of it.
pub const MIN_SPEED_MM_S: f32 = 2.0;

/// What the band-pass adds to [`decimate::DELAY_MS`], in ms: its group delay lies between 2.6 and 5.3 ms
/// for all frequencies from 20 to 100 Hz.
const BAND_PASS_DELAY_MS: usize = 4;
/// A band-passed sample belongs to where the arm was this many ms before it came out of the filters.
/// Velocities are taken at this delay, which also leaves as much future for their centred difference.
pub const ALIGNMENT_MS: usize = decimate::DELAY_MS + BAND_PASS_DELAY_MS;

/// Half of the time over which a velocity is taken, in ms. 5 µm counts make an error of ±1 count in
/// 16 ms, ±0.31 mm/s or 1 % of 30 mm/s, at worst; its mean is 0 and its RMS 0.4 %.
const HALF_SPAN_MS: usize = ALIGNMENT_MS;
/// So long does a jump of the encoder make velocities, in ms.
pub const SPAN_MS: usize = 2 * HALF_SPAN_MS + 1;

/// Milliseconds of positions kept: a power of two, so that indices wrap freely.
const HISTORY_MS: usize = 256;
const _: () = assert!(ALIGNMENT_MS + MAX_WINDOW_MS + HALF_SPAN_MS < HISTORY_MS);

/// The arm's positions of the last 256 ms.
#[derive(Clone, Debug)]
pub struct Travel {
    encoder: u16,
    /// Where the arm is, in µm.
    position_um: i64,
    newest: usize,
    /// The low 32 bits of each position: no two of them are 2³¹ µm apart.
    positions_um: [i32; HISTORY_MS],
}
// 164 mm a millisecond at most, see `Travel::push`.
const _: () = assert!(HISTORY_MS as i64 * 32_768 * (MICROMETRES_PER_COUNT as i64) < 1 << 31);

impl Travel {
    /// An arm that has been standing at position 0, where its encoder reads `encoder`.
    pub fn new(encoder: u16) -> Self {
        Self {
            encoder,
            position_um: 0,
            newest: 0,
            positions_um: [0; HISTORY_MS],
        }
    }

    /// Takes the encoder's counter, once per ms. Less than 2¹⁵ counts (164 mm) may lie between.
    pub fn push(&mut self, encoder: u16) {
        let counts = encoder.wrapping_sub(self.encoder).cast_signed();
        self.encoder = encoder;
        self.position_um += i64::from(counts) * i64::from(MICROMETRES_PER_COUNT);
        self.newest = (self.newest + 1) % HISTORY_MS;
        self.positions_um[self.newest] = self.position_um as i32;
    }

    /// Position `ms_ago`, below 256, in µm from where the arm stood at first.
    pub fn position_um(&self, ms_ago: usize) -> i64 {
        self.position_um - i64::from(self.wrapped_um(0).wrapping_sub(self.wrapped_um(ms_ago)))
    }

    /// The same in quarters of a µm, wrapped.
    pub fn place(&self, ms_ago: usize) -> Place {
        self.wrapped_um(ms_ago).wrapping_mul(PLACES_PER_UM)
    }

    fn wrapped_um(&self, ms_ago: usize) -> i32 {
        self.positions_um[self.newest.wrapping_sub(ms_ago) % HISTORY_MS]
    }

    /// Velocity in mm/s at `half_ms_ago` / 2 ms before the band-passed sample's instant (see
    /// [`ALIGNMENT_MS`]), 0 to 400: a centred difference over 16 ms, or over 17 ms if that instant is
    /// half-way between two positions.
    pub fn velocity_mm_s(&self, half_ms_ago: usize) -> f32 {
        let span_ms = 2 * HALF_SPAN_MS + half_ms_ago % 2;
        let newer_ms_ago = half_ms_ago / 2 + ALIGNMENT_MS - HALF_SPAN_MS;
        let travel_um = self
            .wrapped_um(newer_ms_ago)
            .wrapping_sub(self.wrapped_um(newer_ms_ago + span_ms));
        // µm per ms are mm/s.
        const _: () = assert!(SAMPLE_RATE_HZ == 1_000);
        travel_um as f32 / span_ms as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    fn encoder(position_um: f64) -> u16 {
        (libm::floor(position_um / f64::from(MICROMETRES_PER_COUNT)) as i64) as u16
    }

    #[test]
    fn follows_the_counter_through_its_wraps_in_both_directions() {
        let mut travel = Travel::new(65_000);
        let mut position_um = 0;
        let mut counter = 65_000_u16;
        for step in (0..50).map(|_| 12_345_i16).chain((0..90).map(|_| -9_876)) {
            counter = counter.wrapping_add_signed(step);
            position_um += i64::from(step) * 5;
            travel.push(counter);
            assert_eq!(travel.position_um(0), position_um);
        }
        assert_eq!(travel.position_um(1), position_um + 9_876 * 5);
    }

    #[test]
    fn keeps_differences_of_places_where_they_wrap() {
        let mut travel = Travel::new(0);
        // 2²⁹ µm, where places wrap, are passed after 5 369 steps of 100 mm; 2³¹ µm after 21 475.
        let mut counter = 0_u16;
        for step in 1..=22_000_i64 {
            counter = counter.wrapping_add(20_000);
            travel.push(counter);
            assert_eq!(travel.position_um(0), step * 100_000);
            assert_eq!(travel.position_um(200), (step - 200).max(0) * 100_000);
            let moved = travel.place(0).wrapping_sub(travel.place(3));
            assert_eq!(moved, 100_000 * 4 * step.min(3) as i32);
            assert_eq!(
                travel.velocity_mm_s(0),
                100_000.0 * (step.min(16) as f32 / 16.0)
            );
        }
    }

    #[test]
    fn was_standing_before_it_started() {
        let travel = Travel::new(1_234);
        assert_eq!(travel.position_um(255), 0);
        assert_eq!(travel.velocity_mm_s(400), 0.0);
    }

    #[test]
    fn has_a_steady_velocity_within_one_count_and_without_bias() {
        for speed_mm_s in [-70.0, -30.0, 29.7, 30.0, 50.0, 70.0, 123.4] {
            let mut travel = Travel::new(encoder(0.0));
            let mut sum = 0.0;
            let (first, last) = (300, 2_300);
            for ms in 1..last {
                travel.push(encoder(speed_mm_s * f64::from(ms)));
                if ms >= first {
                    let error = f64::from(travel.velocity_mm_s(80)) - speed_mm_s;
                    assert!(
                        error.abs() <= 5.0 / 16.0 + 1e-5,
                        "{error} at {speed_mm_s} mm/s"
                    );
                    sum += error;
                }
            }
            // The sum telescopes to 16 differences over 2 s, each within one count.
            let mean = sum / f64::from(last - first);
            assert!(
                mean.abs() <= 5.0 / 2_000.0 + 1e-5,
                "{mean} at {speed_mm_s} mm/s"
            );
        }
    }

    #[test]
    fn takes_velocities_at_the_instants_asked_for() {
        let (amplitude_um, angular) = (13_422.0, 2.0 * PI * 0.83);
        let mut travel = Travel::new(encoder(0.0));
        for ms in 1..3_000 {
            travel.push(encoder(
                amplitude_um * libm::sin(angular * f64::from(ms) / 1_000.0),
            ));
            for half_ms_ago in [0, 1, 80, 81, 160, 400] {
                if ms < 300 {
                    continue;
                }
                let t_s =
                    (f64::from(ms) - ALIGNMENT_MS as f64 - half_ms_ago as f64 / 2.0) / 1_000.0;
                let want = amplitude_um * angular * libm::cos(angular * t_s) / 1_000.0;
                let got = f64::from(travel.velocity_mm_s(half_ms_ago));
                // One count over the span, and the span's chord: |v‴| (T/2)² / 6.
                let chord = amplitude_um / 1_000.0 * angular.powi(3) * 0.0085_f64.powi(2) / 6.0;
                let bound = 5.0 / 16.0 + chord + 1e-4;
                assert!(
                    (got - want).abs() <= bound,
                    "{got} is not {want} at {half_ms_ago}"
                );
            }
        }
    }
}
