//! A rival with all that it needs between the ADC and λ.

use firmware_sensor::decimate::{self, AntiAlias, History};
use firmware_sensor::travel::{ALIGNMENT_MS, Travel};
use firmware_sensor::{ESTIMATE_RATE_HZ, SAMPLE_RATE_HZ, SCANS_PER_SAMPLE, Scan};
use protocol::GAUGES;

use super::Rival;

/// λ in mm for which an answer counts as one: a little more than what is asked of the estimators.
const RANGE_MM: core::ops::RangeInclusive<f32> = 0.5..=8.0;
/// Below this speed, in mm/s, no answer counts: as for the paper's count.
const MIN_SPEED_MM_S: f32 = 2.0;
const SAMPLES_PER_ANSWER: u32 = SAMPLE_RATE_HZ / ESTIMATE_RATE_HZ;
/// Half milliseconds by which [`Travel`]'s velocities are older than the samples behind the anti-aliasing
/// filter: it counts from behind the band-pass.
const LEAD_HALF_MS: usize = 2 * (ALIGNMENT_MS - decimate::DELAY_MS);

/// What a rival says of the surface, every tenth millisecond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// λ in mm, above 0, if it found a frequency while the arm moved.
    pub wavelength_mm: Option<f32>,
    /// Whether it counts: rivals have no word of their own for that, so an answer within 0.5 to 8 mm
    /// while the arm moves at 2 mm/s or more.
    pub valid: bool,
}

/// A rival behind the firmware's own anti-aliasing filter and beside its velocities.
#[derive(Clone, Debug)]
pub struct Entrant<R> {
    rival: R,
    anti_alias: AntiAlias,
    started: Option<(History, Travel)>,
    samples: u32,
}

impl<R: Rival> Entrant<R> {
    /// A rival before its first scan.
    pub fn new(rival: R) -> Self {
        Self {
            rival,
            anti_alias: AntiAlias::new(),
            started: None,
            samples: 0,
        }
    }

    /// Takes a millisecond's four scans, oldest first, and the encoder's counter at the last of them.
    /// Every tenth time there is an answer.
    pub fn step(&mut self, scans: &[Scan; SCANS_PER_SAMPLE], encoder: u16) -> Option<Answer> {
        let (history, travel) = self
            .started
            .get_or_insert_with(|| (History::settled(&scans[0]), Travel::new(encoder)));
        let sample = self.anti_alias.step(history, scans);
        travel.push(encoder);
        let mut gauges = [0.0; GAUGES];
        gauges.copy_from_slice(&sample[..GAUGES]);
        self.rival.push(&gauges);
        self.samples = self.samples.wrapping_add(1);
        if !self.samples.is_multiple_of(SAMPLES_PER_ANSWER) {
            return None;
        }
        let half_ms_ago = self.rival.age_half_ms().saturating_sub(LEAD_HALF_MS);
        let speed_mm_s = travel.velocity_mm_s(half_ms_ago).abs();
        let wavelength_mm = self
            .rival
            .frequency_hz()
            .map(|frequency_hz| speed_mm_s / frequency_hz)
            .filter(|wavelength_mm| *wavelength_mm > 0.0 && wavelength_mm.is_finite());
        Some(Answer {
            wavelength_mm,
            valid: wavelength_mm.is_some_and(|mm| RANGE_MM.contains(&mm))
                && speed_mm_s >= MIN_SPEED_MM_S,
        })
    }
}
