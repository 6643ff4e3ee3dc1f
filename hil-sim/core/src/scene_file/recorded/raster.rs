//! Lays rows on an even raster: the ADC's instants, or the points at which a surface is stored.
//!
//! ```text
//! rows ─> even raster of their own ─┬─ denser ─> resampler ─┬─ between the wanted points ─> windowed sinc ─┬─> points
//!                                   └───────────────────────┴──────────────── on them ─────────────────────┘
//! ```

use super::resampler::{Ratio, resample};
use crate::scene::Series;
use crate::scene::Waveform;

/// Rows may lie so far beside an even raster, in its steps, and be evenly spaced all the same: their times
/// were rounded when they were written.
const ROUNDED: f64 = 0.25;
/// Rows this close to a wanted point, in steps of the wanted raster, are there: 2.5 µs of the ADC's.
const THERE: f64 = 0.01;
/// What a raster that is only nearly the wanted one may be off at the end of a recording, in steps.
const DRIFT: f64 = 0.001;
/// A recording's step relative to the wanted one below which it is denser: above, the windowed sinc folds half a
/// percent of the band at most.
const DENSER: f64 = 0.99;

/// A raster that a recording is brought to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    /// Points in a second or a mm.
    pub per_unit: f64,
    /// Whether 0 is one of its points; else the recording's first row is one.
    pub through_zero: bool,
}

/// An even raster that rows lie on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Even {
    /// Where the first row lies.
    pub first: f64,
    /// From row to row.
    pub step: f64,
}

impl Even {
    /// The raster of two rows or more, rising; none if they are not evenly spaced.
    pub fn of(at: &[f64]) -> Option<Self> {
        // Least squares: rounded times are off by as much at the ends as anywhere.
        let middle = (at.len() - 1) as f64 / 2.0;
        let mean = at[0] + at.iter().map(|here| here - at[0]).sum::<f64>() / at.len() as f64;
        let (mut slope, mut weight) = (0.0, 0.0);
        for (index, here) in at.iter().enumerate() {
            let from_middle = index as f64 - middle;
            slope += from_middle * (here - mean);
            weight += from_middle * from_middle;
        }
        let step = slope / weight;
        let first = mean - middle * step;
        let is_near = |(index, here): (usize, &f64)| {
            (here - (first + index as f64 * step)).abs() <= ROUNDED * step
        };
        at.iter()
            .enumerate()
            .all(is_near)
            .then_some(Self { first, step })
    }
}

impl Raster {
    /// Two rows or more on this raster: as they are if they lie there, else band-limited to the lower one of the two
    /// rates. None if the ratio of the two rates is beyond all reason.
    pub fn lay(self, rows: Series) -> Option<Series> {
        if self.holds(&rows.at) {
            return Some(rows);
        }
        let width = rows.width;
        let (even, values) = match Even::of(&rows.at) {
            Some(even) => (even, rows.values),
            None => stretched(&rows),
        };
        let origin = self.origin(even.first);
        let (step, values) = if even.step * self.per_unit < DENSER {
            let span = even.step * (values.len() / width) as f64 * self.per_unit;
            let ratio = Ratio::near((even.step * self.per_unit).recip(), DRIFT / span)?;
            (self.per_unit.recip(), resample(&values, width, ratio)?)
        } else {
            (even.step, values)
        };
        let count = values.len() / width;
        let at = |index: usize| even.first + index as f64 * step;
        let own = Series {
            at: (0..count).map(at).collect(),
            values,
            width,
        };
        let (first, last) = own.extent();
        let points = [first, last].map(|end| (end - origin) * self.per_unit);
        let point = |number: f64| origin + number / self.per_unit;
        // A point this close to an end is there.
        let numbers = (points[0] - THERE).ceil() as i64..=(points[1] + THERE).floor() as i64;
        let at: Vec<f64> = numbers.map(|number| point(number as f64)).collect();
        let waveform = Waveform::band_limited(own, even.first, step.recip());
        let mut values = vec![0.0; at.len() * width];
        for (&at, values) in at.iter().zip(values.chunks_exact_mut(width)) {
            waveform.read(at, &mut 0, values);
        }
        Some(Series { at, values, width })
    }

    /// One of its points; `first` is where the recording begins.
    pub fn origin(self, first: f64) -> f64 {
        if self.through_zero { 0.0 } else { first }
    }

    /// Whether each of the rows is where a point is, and none is left out between them.
    fn holds(self, at: &[f64]) -> bool {
        let origin = self.origin(at[0]);
        let first = ((at[0] - origin) * self.per_unit).round();
        at.iter().enumerate().all(|(index, here)| {
            ((here - origin) * self.per_unit - first - index as f64).abs() <= THERE
        })
    }
}

/// Unevenly spaced rows, on straight lines between them, twice as dense.
fn stretched(rows: &Series) -> (Even, Vec<f64>) {
    let (first, last) = rows.extent();
    let points = 2 * (rows.at.len() - 1);
    let step = (last - first) / points as f64;
    let mut values = Vec::with_capacity((points + 1) * rows.width);
    let mut row = 0;
    for point in 0..=points {
        let at = first + point as f64 * step;
        row = rows.row(at, row);
        values.extend((0..rows.width).map(|column| rows.value(row, column, at)));
    }
    (Even { first, step }, values)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const ADC: Raster = Raster {
        per_unit: 4_000.0,
        through_zero: true,
    };

    /// A tone of 100 Hz whose phase is that of time 0, at these times.
    fn tone(at: Vec<f64>) -> Series {
        Series {
            values: at.iter().map(|t_s| (TAU * 100.0 * t_s).sin()).collect(),
            at,
            width: 1,
        }
    }

    /// The largest difference from that tone at the ADC's instants from 0.5 to 1.5 s.
    fn off(series: &Series) -> f64 {
        (2_000..6_000)
            .map(|scan| {
                let t_s = f64::from(scan) / 4_000.0;
                let value = series.value(series.row(t_s, 0), 0, t_s);
                (value - (TAU * 100.0 * t_s).sin()).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn rows_on_the_raster_stay_as_they_are() {
        let rows = tone((-1..8_000).map(|scan| f64::from(scan) * 250e-6).collect());
        assert_eq!(ADC.lay(rows.clone()), Some(rows));
    }

    #[test]
    fn rows_beside_the_raster_keep_their_time() {
        // A shift by 1 µs would be 6e-4.
        for shift_s in [0.0, 100e-6, -33e-6, 0.000_125] {
            for rate_hz in [1_000.0, 2_500.0, 4_000.0, 1_234.567] {
                let at = (0..(2.0 * rate_hz) as u32)
                    .map(|row| f64::from(row) / rate_hz + shift_s)
                    .collect();
                let laid = ADC.lay(tone(at)).unwrap();
                let off = off(&laid);
                assert!(off < 4e-4, "{rate_hz} Hz, {shift_s} s: {off}");
            }
        }
    }

    #[test]
    fn rounded_times_are_even_and_uneven_rows_lie_on_straight_lines() {
        // 2.2 kHz written to 0.1 ms: up to 50 µs off, and none of it in the tone.
        let truth: Vec<f64> = (0..4_400).map(|row| f64::from(row) / 2_200.0).collect();
        let mut rows = tone(truth.clone());
        rows.at = truth.iter().map(|t_s| (t_s * 1e4).round() / 1e4).collect();
        assert!(Even::of(&rows.at).is_some());
        assert!(off(&ADC.lay(rows).unwrap()) < 4e-4);
        // Of three rows 0.2 and 0.8 ms apart: the line is (2π · 100 · 0.8e-3)²/8 = 0.032 off at most.
        let at: Vec<f64> = (0..4_000)
            .map(|row| f64::from(row / 2) * 1e-3 + f64::from(row % 2) * 0.2e-3)
            .collect();
        assert_eq!(Even::of(&at), None);
        assert!(off(&ADC.lay(tone(at)).unwrap()) < 0.035);
    }

    #[test]
    fn a_raster_of_places_begins_with_the_first_row() {
        let raster = Raster {
            per_unit: 50.0,
            through_zero: false,
        };
        let at: Vec<f64> = (0..10_000)
            .map(|row| -3.123 + f64::from(row) * 0.001)
            .collect();
        let values = at.iter().map(|x_mm| (TAU * x_mm).sin()).collect();
        let laid = raster
            .lay(Series {
                at,
                values,
                width: 1,
            })
            .unwrap();
        assert_eq!(laid.at.len(), 500);
        for (x_mm, height) in laid.at.iter().zip(&laid.values).take(450).skip(50) {
            assert!((height - (TAU * x_mm).sin()).abs() < 1e-3, "{x_mm}");
        }
        assert!((laid.at[50] - (-3.123 + 1.0)).abs() < 1e-9);
    }
}
