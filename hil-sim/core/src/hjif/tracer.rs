//! A shape's values, from place to place.

use std::f64::consts::TAU;

use super::BaseSignal;
use super::piece::Shape;

/// Follows a shape from place to place, forwards.
pub(super) struct Tracer<'s> {
    shape: &'s Shape,
    /// m in a unit of place.
    metre: f64,
    /// The point after the last place.
    amplitude: usize,
    frequency: usize,
    /// Cycles up to the frequency's point before.
    cycles: f64,
}

impl<'s> Tracer<'s> {
    pub(super) const fn new(shape: &'s Shape, metre: f64) -> Self {
        Self {
            shape,
            metre,
            amplitude: 0,
            frequency: 0,
            cycles: 0.0,
        }
    }

    /// The value at a place from the effect's beginning; places rise from call to call.
    pub(super) fn value(&mut self, place: f64) -> f64 {
        match self.shape {
            Shape::Linear(points) => between(points, &mut self.amplitude, place, |share| share),
            Shape::Cubic(points) => between(points, &mut self.amplitude, place, |share| {
                share * share * (3.0 - 2.0 * share)
            }),
            Shape::Wave {
                base,
                ahead,
                amplitudes,
                frequencies,
            } => {
                let amplitude = between(amplitudes, &mut self.amplitude, place, |share| share);
                amplitude * base.value(ahead + self.turned(frequencies, place))
            }
        }
    }

    /// Cycles from the effect's beginning: the first frequency holds before its point, the last behind it.
    fn turned(&mut self, frequencies: &[(f64, f64)], place: f64) -> f64 {
        while let Some(&(next, after)) = frequencies.get(self.frequency)
            && next <= place
        {
            let (at, before) = match self.frequency.checked_sub(1) {
                Some(index) => frequencies[index],
                None => (0.0, after),
            };
            self.cycles += 0.5 * (before + after) * (next - at) * self.metre;
            self.frequency += 1;
        }
        let mut next = self.frequency;
        let here = between(frequencies, &mut next, place, |share| share);
        let (at, before) = match self.frequency.checked_sub(1) {
            Some(index) => frequencies[index],
            None => (0.0, here),
        };
        self.cycles + 0.5 * (before + here) * (place - at) * self.metre
    }
}

/// The value at a place: `ease` says which share of the way from point to point is gone. `next` is the point after the
/// last place that was asked for.
fn between(points: &[(f64, f64)], next: &mut usize, place: f64, ease: impl Fn(f64) -> f64) -> f64 {
    while points.get(*next).is_some_and(|&(at, _)| at <= place) {
        *next += 1;
    }
    match (
        next.checked_sub(1).map(|before| points[before]),
        points.get(*next),
    ) {
        (Some((from, before)), Some(&(to, after))) => {
            before + (after - before) * ease((place - from) / (to - from))
        }
        (Some((_, only)), None) | (None, Some(&(_, only))) => only,
        (None, None) => 0.0,
    }
}

impl BaseSignal {
    /// The wave after so many cycles.
    pub(super) fn value(self, cycles: f64) -> f64 {
        let share = cycles - cycles.floor();
        match self {
            Self::Sine => (TAU * share).sin(),
            Self::Square => {
                if share < 0.5 {
                    1.0
                } else {
                    -1.0
                }
            }
            Self::Triangle => {
                let from_crest = cycles - 0.25;
                1.0 - 4.0 * (from_crest.round() - from_crest).abs()
            }
            Self::SawToothUp => 2.0 * (cycles - (cycles + 0.5).floor()),
            Self::SawToothDown => 2.0 * ((cycles + 0.5).floor() - cycles),
        }
    }
}
