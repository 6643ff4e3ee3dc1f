//! Measured columns from a CSV file.

use std::path::Path;
use std::sync::Arc;

use super::csv_rows::CsvRows;
use super::table::Table;
use crate::scene::{SceneError, Series};

/// What to say of a row whose first column does not increase.
pub(super) fn unsorted(before: f64) -> String {
    format!("does not increase, after {before}: sort the rows, without doubles")
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
        let rows = CsvRows::open(path, bytes)?;
        let header = rows.first().join(",");
        if !headers.contains(&header.as_str()) {
            let message = format!(
                "the first line is {header:?}: it must be {}",
                headers.join(" or ")
            );
            return Err(rows.refuse(Some(1), message));
        }
        let columns: Vec<usize> = (0..rows.first().len()).collect();
        let mut series = Self::empty(columns.len() - 1);
        let mut before: Option<Vec<f64>> = None;
        rows.each(&columns, false, |row| {
            if let Some(before) = before.as_ref().filter(|before| row[0] <= before[0]) {
                return Err((0, unsorted(before[0])));
            }
            check(before.as_deref(), row)?;
            series.at.push(row[0]);
            series.values.extend_from_slice(&row[1..]);
            before = Some(row.to_vec());
            Ok(())
        })?;
        if series.at.len() < 2 {
            let message = format!("{} row(s) of numbers: give two or more", series.at.len());
            return Err(SceneError {
                file: path.display().to_string(),
                line: None,
                key: String::new(),
                message,
            });
        }
        Ok(series)
    }
}

/// The CSV file that `table` names.
pub(super) fn series(
    table: &mut Table<'_>,
    headers: &[&str],
    check: impl Fn(Option<&[f64]>, &[f64]) -> Result<(), (usize, String)>,
) -> Result<Arc<Series>, SceneError> {
    let Some(name) = table.text("file")? else {
        return Err(table.refuse(
            "file",
            format!(
                "is missing: give a CSV file with the columns {}",
                headers[0]
            ),
        ));
    };
    let path = table.source().beside(name);
    match std::fs::read(&path) {
        Ok(bytes) => Ok(Arc::new(Series::read(&path, &bytes, headers, check)?)),
        Err(error) => {
            let path = path.display();
            Err(table.refuse(
                "file",
                format!(
                    "{path} cannot be read: {error}: names are relative to the scene's own folder"
                ),
            ))
        }
    }
}
