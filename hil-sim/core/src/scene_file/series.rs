//! Measured columns from a CSV file.

use std::path::Path;

use super::csv_rows::CsvRows;
use super::recorded::EVERYWHERE;
use super::recorded::tape::{Check, Conversion, Tape, plain, too_few};
use crate::scene::{SceneError, Series};

impl Series {
    /// Reads CSV from `bytes`, to be called `path`, whose first line must be one of `headers`. `check` sees
    /// each row after the one before it, and may refuse it: column index and what to do.
    pub(super) fn read(
        path: &Path,
        bytes: &[u8],
        headers: &[&str],
        check: Check<'_>,
    ) -> Result<Self, SceneError> {
        let tape = |width| Tape::new(width, EVERYWHERE, Conversion::NONE);
        let series = plain(CsvRows::open(path, bytes)?, headers, "", &tape, check)?.into_rows();
        if series.at.len() < 2 {
            return Err(too_few(&path.display().to_string(), &series));
        }
        Ok(series)
    }
}
