//! A stranger's record, played to the firmware's own libraries.

use std::f64::consts::TAU;

use firmware_display::{Display, Senses, Settings, TICK_RATE_HZ};
use firmware_sensor::Sensor;
use protocol::texture::measured;
use protocol::{DisplayState, SensorConfiguration, Texture};
use realfft::num_complex::Complex64;

use super::counts::{Counts, Worth};
use super::stranger::Record;

/// Slower than this the arm rests, in mm/s.
pub(super) const MOVING_MM_S: f32 = 5.0;
/// v/λ that the sensor promises to follow, in Hz.
const LOWEST_HZ: f32 = 2.5;
const HIGHEST_HZ: f32 = 150.0;
/// The highest frequency in Hz at which a partial is measured.
const HIGHEST_PARTIAL_HZ: f32 = firmware_sensor::texture::HIGHEST_HZ;
/// Waves of travel after the start, and after a boundary, from which on it counts.
const WAVES_TO_SETTLE: f32 = 3.0;
const TICKS_PER_MS: u16 = (TICK_RATE_HZ / 1_000) as u16;
const _: () = assert!(TICK_RATE_HZ.is_multiple_of(1_000));

/// What came of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Played {
    /// The estimates in the time that counts.
    pub said: Counts,
    /// That time itself, in ms, by what the operator's finger gets.
    pub felt: Counts,
    /// The textures in that time, by the shape of the wave that they tell of, where the surface has one wave alone.
    pub shaped: Counts,
}

/// Plays a record to a sensor board, and its estimates at once to a display board whose hand moves as the
/// arm does.
///
/// What is played is the λ of the last estimate that the display trusted, for as long as it drives or
/// fades out; the 20 ms in which it glides from one λ to the next are taken as the next.
pub fn play(record: &Record, sensor: SensorConfiguration, display: &Settings) -> Played {
    let mut played = Played::default();
    let mut sensor = Sensor::new(sensor);
    let mut display = Display::new(display, None);
    display.started(Ok(()));
    let mut trusted_mm = None;
    let mut before = record.encoder.first().copied().unwrap_or_default();
    for (ms, (scans, &encoder)) in record.scans.iter().zip(&record.encoder).enumerate() {
        let counts = record.counts(ms);
        let truth_mm = f64::from(record.truth_mm[ms]);
        let instant_us = 1_000 * (ms as u64 + 1);
        let heard = sensor.step(instant_us, scans, encoder);
        let texture = heard.texture.filter(|_| counts);
        if let Some(worth) = texture.and_then(|texture| record.worth_of_shape(ms, &texture)) {
            played.shaped.count(worth);
        }
        if let Some(estimate) = heard.estimate {
            let said_mm = estimate.wavelength_mm.filter(|_| estimate.valid);
            if counts {
                played
                    .said
                    .count(Worth::of(said_mm.map(f64::from), truth_mm));
            }
            let trusted = display.counters().estimates;
            display.on_estimate(&estimate);
            if display.counters().estimates != trusted {
                trusted_mm = said_mm.map(f64::from);
            }
        }
        // The encoder is known once a ms: in between it is half way.
        let moved = encoder.wrapping_sub(before) as i16;
        for tick in 1..=TICKS_PER_MS {
            let part = i32::from(moved) * i32::from(tick) / i32::from(TICKS_PER_MS);
            display.tick(before.wrapping_add_signed(part as i16), &Senses::default());
        }
        before = encoder;
        if counts {
            let sounds = matches!(
                display.state(),
                DisplayState::Driving | DisplayState::Fading(_)
            );
            let felt_mm = trusted_mm.filter(|_| sounds);
            played.felt.count(Worth::of(felt_mm, truth_mm));
        }
    }
    played
}

impl Record {
    /// What a texture that was told at a ms is worth by its partials; none where the surface has not one wave alone, or is
    /// rubbed too fast for any to be felt.
    fn worth_of_shape(&self, ms: usize, texture: &Texture) -> Option<Worth> {
        let truth = self.partials?;
        let hz = self.speed_mm_s[ms].abs() / self.truth_mm[ms];
        let felt = [2.0, 3.0].iter().filter(|&n| n * hz <= HIGHEST_PARTIAL_HZ);
        let felt = felt.count();
        if felt == 0 {
            return None;
        }
        if !texture.valid {
            return Some(Worth::Silent);
        }
        let ratios = texture.partials.map(|partial| measured(partial.ratio));
        if ratios[..felt].contains(&None) {
            return Some(Worth::Silent);
        }
        let told = std::array::from_fn(|n| {
            let ratio = f64::from(ratios[n].unwrap_or(0.0));
            Complex64::from_polar(ratio, TAU * f64::from(texture.partials[n].phase) / 65_536.0)
        });
        Some(Worth::of_shape(told, truth, felt))
    }

    /// Whether a ms counts: the arm moves; and where there is a period, v/λ is in the band, and the
    /// fingertip has come 3 λ far on this specimen.
    pub fn counts(&self, ms: usize) -> bool {
        let speed_mm_s = self.speed_mm_s[ms].abs();
        let truth_mm = self.truth_mm[ms];
        let in_band = || (LOWEST_HZ * truth_mm..=HIGHEST_HZ * truth_mm).contains(&speed_mm_s);
        let settled = || self.travelled_mm[ms] >= WAVES_TO_SETTLE * truth_mm;
        speed_mm_s > MOVING_MM_S && (truth_mm == 0.0 || in_band() && settled())
    }
}
