//! Measured columns from a CSV file.

use std::path::Path;

use super::csv_rows::CsvRows;
use super::read_bytes;
use super::recorded::EVERYWHERE;
use super::recorded::tape::{Check, Conversion, Tape, plain, too_few};
use super::table::Table;
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

/// The CSV file that `table` names.
pub(super) fn series(
    table: &mut Table<'_>,
    headers: &[&str],
    check: Check<'_>,
) -> Result<Series, SceneError> {
    let give = format!("give a CSV file with the columns {}", headers[0]);
    let path = table.file(&give)?;
    let bytes = read_bytes(&path).map_err(|error| table.unreadable(&path, &error))?;
    Series::read(&path, &bytes, headers, check)
}
