//! Measured columns, over time or place.

/// Rows of numbers, in the order of their first column, which strictly increases. At least two rows;
/// every number is finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The first column: t in s or x in mm.
    pub at: Vec<f64>,
    /// The other columns, row after row.
    pub values: Vec<f64>,
    /// How many other columns there are.
    pub width: usize,
}

impl Series {
    /// A series with so many columns and no row yet, which is not to be asked for anything.
    pub(crate) fn empty(width: usize) -> Self {
        Self {
            at: Vec::new(),
            values: Vec::new(),
            width,
        }
    }

    /// The first column's first and last number.
    pub fn extent(&self) -> (f64, f64) {
        (self.at[0], self.at[self.at.len() - 1])
    }

    /// The index of the row at or before `at`, such that another follows it: the ends are extended.
    /// `guess` is where to look first.
    pub fn row(&self, at: f64, guess: usize) -> usize {
        let last = self.at.len() - 2;
        let guess = guess.min(last);
        if self.at[guess] <= at && at < self.at[guess + 1] {
            return guess;
        }
        let next = (guess + 1).min(last);
        if self.at[next] <= at && at < self.at[next + 1] {
            return next;
        }
        self.at
            .partition_point(|&start| start <= at)
            .saturating_sub(1)
            .min(last)
    }

    /// The straight line through `row` and the next one, at `at`, in `column` (the first after `at` is 0).
    /// Outside of the file its first or last number.
    pub fn value(&self, row: usize, column: usize, at: f64) -> f64 {
        let (start, end) = (self.at[row], self.at[row + 1]);
        let (from, to) = (
            self.values[row * self.width + column],
            self.values[(row + 1) * self.width + column],
        );
        from + (to - from) * ((at - start) / (end - start)).clamp(0.0, 1.0)
    }

    /// The slope of that line; 0 outside of the file.
    pub fn slope(&self, row: usize, column: usize, at: f64) -> f64 {
        let (start, end) = (self.at[row], self.at[row + 1]);
        if at < start || at > end {
            return 0.0;
        }
        (self.values[(row + 1) * self.width + column] - self.values[row * self.width + column])
            / (end - start)
    }
}
