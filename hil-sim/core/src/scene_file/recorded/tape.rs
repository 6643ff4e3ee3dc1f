//! Rows as they are read from a file: scaled, checked, and cut to what a scene needs.

use crate::scene::{SceneError, Series};
use crate::scene_file::csv_rows::{CsvRows, quoted};

/// What a reader says of a row that is refused: index of the column, 0 being the time or place, and what to
/// do.
pub type Refusal = (usize, String);

/// Sees the row before and a row, the time or place first, and may refuse it.
pub type Check<'c> = &'c dyn Fn(Option<&[f64]>, &[f64]) -> Result<(), Refusal>;

/// How a file's numbers become a scene's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    /// Added to each time or place.
    pub shift: f64,
    /// Each number is multiplied by it.
    pub scale: f64,
    /// And this is added.
    pub offset: f64,
}

impl Conversion {
    /// As they are.
    pub const NONE: Self = Self {
        shift: 0.0,
        scale: 1.0,
        offset: 0.0,
    };
}

/// What is kept of a file.
pub struct Tape {
    rows: Series,
    conversion: Conversion,
    /// From where on, and to where, rows are kept.
    window: (f64, f64),
    /// The last row and the one that is being taken, kept or not.
    before: Vec<f64>,
    row: Vec<f64>,
    first: Option<f64>,
}

impl Tape {
    /// For rows of `width` numbers beside their time or place, kept within `window`.
    pub fn new(width: usize, window: (f64, f64), conversion: Conversion) -> Self {
        Self {
            rows: Series::empty(width),
            conversion,
            window,
            before: Vec::new(),
            row: Vec::new(),
            first: None,
        }
    }

    /// Takes a row of the file.
    pub fn take(&mut self, at: f64, raw: &[f64], check: Check<'_>) -> Result<(), Refusal> {
        let Conversion {
            shift,
            scale,
            offset,
        } = self.conversion;
        std::mem::swap(&mut self.before, &mut self.row);
        self.row.clear();
        self.row.push(at + shift);
        self.row
            .extend(raw.iter().map(|number| number * scale + offset));
        let before = self.first.is_some().then_some(&self.before[..]);
        if let Some(before) = before.filter(|before| self.row[0] <= before[0]) {
            let before = before[0] - shift;
            let message =
                format!("does not increase, after {before}: sort the rows, without doubles");
            return Err((0, message));
        }
        check(before, &self.row)?;
        let (at, values) = (self.row[0], &self.row[1..]);
        self.first.get_or_insert(at);
        if (self.window.0..=self.window.1).contains(&at) {
            self.rows.at.push(at);
            self.rows.values.extend_from_slice(values);
        }
        Ok(())
    }

    /// First and last time or place of all rows, kept or not; none before the first.
    pub fn extent(&self) -> Option<(f64, f64)> {
        self.first.map(|first| (first, self.row[0]))
    }

    /// The rows that are kept.
    pub fn into_rows(self) -> Series {
        self.rows
    }
}

/// The rows of a CSV file whose first line must be one of `headers`; `otherwise` says what else can be done.
pub fn plain<H: AsRef<str>>(
    rows: CsvRows<'_>,
    headers: &[H],
    otherwise: &str,
    tape: &dyn Fn(usize) -> Tape,
    check: Check<'_>,
) -> Result<Tape, SceneError> {
    let header = rows.first().join(",");
    let headers: Vec<&str> = headers.iter().map(AsRef::as_ref).collect();
    if !headers.contains(&&*header) {
        let wanted = headers.join(" or ");
        let header = quoted(&header);
        let message = format!("the first line is {header}: it must be {wanted}{otherwise}");
        return Err(rows.refuse(Some(1), message));
    }
    let columns: Vec<usize> = (0..rows.first().len()).collect();
    let mut tape = tape(columns.len() - 1);
    rows.each(&columns, false, |row| tape.take(row[0], &row[1..], check))?;
    Ok(tape)
}

/// The refusal of a file with less than two rows.
pub fn too_few(file: &str, rows: &Series) -> SceneError {
    let message = format!("{} row(s) of numbers: give two or more", rows.at.len());
    SceneError::of(file, "", message)
}
