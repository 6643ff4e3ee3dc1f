//! Measured columns from a CSV file, over time or place.

use std::path::Path;

use super::SceneError;

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
    /// Reads CSV from `bytes`, to be called `path`, whose first line must be one of `headers`. `check` sees
    /// each row after the one before it, and may refuse it: column index and what to do.
    pub(super) fn read(
        path: &Path,
        bytes: &[u8],
        headers: &[&str],
        check: impl Fn(Option<&[f64]>, &[f64]) -> Result<(), (usize, String)>,
    ) -> Result<Self, SceneError> {
        let refuse = |line: Option<usize>, key: String, message: String| SceneError {
            file: path.display().to_string(),
            line,
            key,
            message,
        };
        // The reader's own count stands before the empty lines that it passes over.
        let line_at = |position: Option<&csv::Position>| {
            let start = (position?.byte() as usize).min(bytes.len());
            let empty = bytes[start..]
                .iter()
                .take_while(|byte| b"\r\n".contains(byte))
                .count();
            Some(
                1 + bytes[..start + empty]
                    .iter()
                    .filter(|&&byte| byte == b'\n')
                    .count(),
            )
        };
        let broken = |error: csv::Error| {
            let message = match error.kind() {
                csv::ErrorKind::UnequalLengths {
                    expected_len, len, ..
                } => {
                    format!(
                        "{len} cells where the first line has {expected_len}: give one for each column"
                    )
                }
                csv::ErrorKind::Utf8 { .. } => "is not text: give CSV in UTF-8".to_owned(),
                _ => format!("cannot be read: {error}"),
            };
            refuse(line_at(error.position()), String::new(), message)
        };

        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(bytes);
        let header: Vec<String> = reader
            .headers()
            .map_err(broken)?
            .iter()
            .map(str::to_owned)
            .collect();
        if !headers.contains(&header.join(",").as_str()) {
            let message = format!(
                "the first line is {:?}: it must be {}",
                header.join(","),
                headers.join(" or ")
            );
            return Err(refuse(Some(1), String::new(), message));
        }

        let mut series = Self {
            at: Vec::new(),
            values: Vec::new(),
            width: header.len() - 1,
        };
        let mut record = csv::StringRecord::new();
        let mut before: Option<Vec<f64>> = None;
        while reader.read_record(&mut record).map_err(broken)? {
            let refuse_cell = |column: usize, message: String| {
                let key = format!("column {} ({})", column + 1, header[column]);
                refuse(
                    line_at(record.position()),
                    key,
                    format!("{:?} {message}", &record[column]),
                )
            };
            let mut row = Vec::with_capacity(header.len());
            for (column, cell) in record.iter().enumerate() {
                let number: f64 = cell.parse().map_err(|_| {
                    refuse_cell(column, "is no number: give one such as 12.5".to_owned())
                })?;
                if !number.is_finite() {
                    let message = "is not finite: give a number or take the row out".to_owned();
                    return Err(refuse_cell(column, message));
                }
                row.push(number);
            }
            if let Some(before) = before.as_ref().filter(|before| row[0] <= before[0]) {
                let message = format!(
                    "does not increase, after {}: sort the rows, without doubles",
                    before[0]
                );
                return Err(refuse_cell(0, message));
            }
            check(before.as_deref(), &row)
                .map_err(|(column, message)| refuse_cell(column, message))?;
            series.at.push(row[0]);
            series.values.extend_from_slice(&row[1..]);
            before = Some(row);
        }
        if series.at.len() < 2 {
            let message = format!("{} row(s) of numbers: give two or more", series.at.len());
            return Err(refuse(None, String::new(), message));
        }
        Ok(series)
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
