//! Recorded voltages at any instant, also between their rows.

use super::series::Series;
use super::windowed_sinc::{REACH, taps};

/// Instants this close to a row, in rows, are on it: a quarter of a ns of the ADC's.
const ON_ROW: f64 = 1e-6;
/// Values between rows are rounded to so many per unit, in volts to a nanovolt: processors add up in different
/// orders, and their last bits must not decide a code.
const PER_UNIT: f64 = 1e9;

/// Numbers over time: rows, and what lies between them. Outside of the rows the first or last one holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Waveform {
    rows: Series,
    between: Between,
}

/// What lies between two rows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Between {
    /// A straight line.
    Line,
    /// Samples of something band-limited, evenly spaced: the first one's time, and how many a unit of time.
    Sinc { first: f64, per_unit: f64 },
}

impl Waveform {
    /// Rows with straight lines between them.
    pub fn on_lines(rows: Series) -> Self {
        Self {
            rows,
            between: Between::Line,
        }
    }

    /// Samples of something band-limited, the first at `first` and then `per_unit` in a unit of time (s for
    /// gauges), whatever times are written beside them: those may be rounded.
    pub fn band_limited(rows: Series, first: f64, per_unit: f64) -> Self {
        Self {
            rows,
            between: Between::Sinc { first, per_unit },
        }
    }

    /// Columns, time left out.
    pub fn width(&self) -> usize {
        self.rows.width
    }

    /// The rows.
    pub fn rows(&self) -> &Series {
        &self.rows
    }

    /// The first columns at `at`, as many as `values` holds, [`Waveform::width`] at most. `row` is where the last
    /// look was, and only saves time.
    pub fn read(&self, at: f64, row: &mut usize, values: &mut [f64]) {
        match self.between {
            Between::Line => {
                *row = self.rows.row(at, *row);
                for (column, value) in values.iter_mut().enumerate() {
                    *value = self.rows.value(*row, column, at);
                }
            }
            Between::Sinc { first, per_unit } => {
                self.between_samples((at - first) * per_unit, values)
            }
        }
    }

    /// The same at `place`, in rows from the first one.
    fn between_samples(&self, place: f64, values: &mut [f64]) {
        let width = self.rows.width;
        let last = self.rows.at.len() - 1;
        let place = place.clamp(0.0, last as f64);
        let nearest = place.round();
        if (place - nearest).abs() <= ON_ROW {
            values.copy_from_slice(&self.rows.values[nearest as usize * width..][..values.len()]);
            return;
        }
        let before = place.floor();
        let taps = taps(place - before);
        let before = before as usize;
        values.fill(0.0);
        for (index, tap) in taps.iter().enumerate() {
            let row = (before + 1 + index).saturating_sub(REACH).min(last);
            for (value, sample) in values.iter_mut().zip(&self.rows.values[row * width..]) {
                *value += tap * sample;
            }
        }
        for value in values {
            *value = (*value * PER_UNIT).round() / PER_UNIT;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns of 20 s at 4 kHz, of which no two rows are alike.
    fn rows() -> Series {
        let at: Vec<f64> = (-3..80_000).map(|row| f64::from(row) / 4_000.0).collect();
        let value = |row: usize| (row * row * 37 + row * 101) % 4_093;
        let values = (0..2 * at.len()).map(|index| value(index) as f64 / 4_093.0);
        Series {
            values: values.collect(),
            at,
            width: 2,
        }
    }

    #[test]
    fn a_row_is_itself_at_its_own_instant() {
        let rows = rows();
        let waveform = Waveform::band_limited(rows.clone(), -3.0 / 4_000.0, 4_000.0);
        let mut found = [0.0; 2];
        for (at, row) in rows.at.iter().zip(rows.values.chunks(2)) {
            // By the board's clock of whole nanoseconds, too.
            for at in [*at, (at * 1e9).round() * 1e-9] {
                waveform.read(at, &mut 0, &mut found);
                assert_eq!(found, row, "at {at}");
            }
        }
        waveform.read(-1.0, &mut 0, &mut found);
        assert_eq!(found, rows.values[..2]);
        waveform.read(99.0, &mut 0, &mut found[..1]);
        assert_eq!(found[0], rows.values[rows.values.len() - 2]);
    }

    #[test]
    fn between_rows_lies_what_was_asked_for() {
        let rows = Series {
            at: vec![0.0, 1.0, 2.0, 3.0],
            values: vec![0.0, 0.0, 1.0, 1.0],
            width: 1,
        };
        let mut found = [0.0];
        Waveform::on_lines(rows.clone()).read(1.5, &mut 0, &mut found);
        assert_eq!(found, [0.5]);
        // Half of a step that is symmetric about it. Close by it is steeper than the line.
        let waveform = Waveform::band_limited(rows, 0.0, 1.0);
        waveform.read(1.5, &mut 0, &mut found);
        assert!((found[0] - 0.5).abs() < 1e-5, "{found:?}");
        waveform.read(1.75, &mut 0, &mut found);
        assert!(found[0] > 0.77, "{found:?}");
    }
}
