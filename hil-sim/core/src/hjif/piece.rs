//! An effect of a band: where it lies, and its shape.

use std::f64::consts::TAU;

use super::{Band, BandType, BaseSignal, CurveType, Effect, FARTHEST_MM, HjifError, Keyframe};

/// What amplitudes may be.
const AMPLITUDES: std::ops::RangeInclusive<f64> = -1.0..=1.0;
/// What frequencies may be, in cycles per m.
const FREQUENCIES: std::ops::RangeInclusive<f64> = 0.0..=10_000.0;

/// A shape between points: place in the perception's units from the effect's beginning, and value.
pub(super) type Points = Vec<(f64, f64)>;

/// An effect with its keyframes, and where it lies, in the perception's units.
pub(super) struct Piece {
    pub(super) start: u64,
    pub(super) end: u64,
    pub(super) shape: Shape,
}

pub(super) enum Shape {
    /// Straight from point to point.
    Linear(Points),
    /// Level at each point.
    Cubic(Points),
    /// Cycles are the integral of frequency over place, in m.
    Wave {
        base: BaseSignal,
        /// In cycles.
        ahead: f64,
        amplitudes: Points,
        frequencies: Points,
    },
}

impl Piece {
    pub(super) fn of(
        band: &Band,
        effect: &Effect,
        start: u64,
        path: &str,
        metre: f64,
    ) -> Result<Self, HjifError> {
        let is_wave = band.band_type == BandType::VectorialWave;
        let (mut amplitudes, mut frequencies) = (Points::new(), Points::new());
        let mut last = None;
        for (at, keyframe) in effect.keyframes.iter().enumerate() {
            let refuse = |field: &str, message: String| {
                Err(HjifError::at(
                    format!("{path}.keyframes[{at}].{field}"),
                    message,
                ))
            };
            let place = match keyframe.relative_position {
                Some(place) => place,
                None if is_wave => 0,
                None => {
                    let message = "is missing: a curve's keyframes have places".to_owned();
                    return refuse("relative_position", message);
                }
            };
            if let Some(before) = last
                && (place < before || place == before && !is_wave)
            {
                let message = format!("{place} does not increase, after {before}");
                return refuse("relative_position", message);
            }
            last = Some(place);
            let Keyframe {
                amplitude_modulation,
                frequency_modulation,
                ..
            } = *keyframe;
            match amplitude_modulation {
                Some(amplitude) if !AMPLITUDES.contains(&amplitude) => {
                    return refuse("amplitude_modulation", format!("{amplitude}: give −1 to 1"));
                }
                Some(amplitude) => amplitudes.push((place as f64, amplitude)),
                None if is_wave => {}
                None => {
                    let message = "is missing: a curve's keyframes have amplitudes".to_owned();
                    return refuse("amplitude_modulation", message);
                }
            }
            match frequency_modulation {
                Some(frequency) if !FREQUENCIES.contains(&frequency) => {
                    return refuse(
                        "frequency_modulation",
                        format!("{frequency}: give 0 to 10 000"),
                    );
                }
                Some(frequency) => frequencies.push((place as f64, frequency)),
                None => {}
            }
        }
        let shape = if is_wave {
            if frequencies.is_empty() {
                let message = "a wave has no frequency_modulation: give one at least";
                return Err(HjifError::at(format!("{path}.keyframes"), message));
            }
            if amplitudes.is_empty() {
                amplitudes.push((0.0, 1.0));
            }
            Shape::Wave {
                base: effect.base_signal.unwrap_or(BaseSignal::Sine),
                ahead: effect.phase.unwrap_or(0.0) / TAU,
                amplitudes,
                frequencies,
            }
        } else if band.curve_type == Some(CurveType::Cubic) {
            Shape::Cubic(amplitudes)
        } else {
            Shape::Linear(amplitudes)
        };
        let Some(end) = start.checked_add(last.unwrap_or(0)) else {
            return Err(HjifError::at(
                path,
                "its end is beyond all numbers: give a nearer one",
            ));
        };
        // So that an end can be told from the place beside it.
        if end as f64 * metre * 1e3 > FARTHEST_MM {
            let message = format!("ends beyond {FARTHEST_MM} mm: give another unit_exponent");
            return Err(HjifError::at(path, message));
        }
        Ok(Self { start, end, shape })
    }
}
