//! Rows of numbers out of a CSV file, each with its place for error messages.

use std::path::Path;

use super::line::line_at;
use crate::scene::SceneError;

/// A CSV file in memory, its first line read.
pub(super) struct CsvRows<'f> {
    path: &'f Path,
    bytes: &'f [u8],
    reader: csv::Reader<&'f [u8]>,
    first: Vec<String>,
}

impl<'f> CsvRows<'f> {
    /// Reads the first line of `bytes`, to be called `path`. Cells are parted by commas, semicolons or tabs,
    /// whichever the first line has most of.
    pub fn open(path: &'f Path, bytes: &'f [u8]) -> Result<Self, SceneError> {
        let line = bytes.split(|&byte| byte == b'\n').next().unwrap_or(bytes);
        let count = |delimiter: u8| line.iter().filter(|&&byte| byte == delimiter).count();
        let mut delimiter = b',';
        for other in [b';', b'\t'] {
            if count(other) > count(delimiter) {
                delimiter = other;
            }
        }
        let reader = csv::ReaderBuilder::new()
            .delimiter(delimiter)
            .trim(csv::Trim::All)
            .has_headers(false)
            .from_reader(bytes);
        let mut rows = Self {
            path,
            bytes,
            reader,
            first: Vec::new(),
        };
        let first = match rows.reader.headers() {
            Ok(first) => first.iter().map(str::to_owned).collect(),
            Err(error) => return Err(rows.broken(&error)),
        };
        rows.first = first;
        Ok(rows)
    }

    /// The cells of the first line.
    pub fn first(&self) -> &[String] {
        &self.first
    }

    /// Whether the first line holds numbers, so that no column has a name.
    pub fn is_bare(&self) -> bool {
        !self.first.is_empty() && self.first.iter().all(|cell| cell.parse::<f64>().is_ok())
    }

    /// A refusal of the file, at a line or as a whole.
    pub fn refuse(&self, line: Option<usize>, message: String) -> SceneError {
        SceneError {
            file: self.path.display().to_string(),
            line,
            key: String::new(),
            message,
        }
    }

    /// Hands the numbers of `columns` in each row to `take`, which may refuse a row: index within `columns`
    /// and what to do. The first line is a row too if `bare`.
    pub fn each(
        mut self,
        columns: &[usize],
        bare: bool,
        mut take: impl FnMut(&[f64]) -> Result<(), (usize, String)>,
    ) -> Result<(), SceneError> {
        let mut record = csv::StringRecord::new();
        let mut row = vec![0.0; columns.len()];
        let mut skip = !bare;
        loop {
            let read = self.reader.read_record(&mut record);
            if !skip && is_row(&read) && self.is_blank(&record) {
                continue;
            }
            match read {
                Ok(true) if skip => skip = false,
                Ok(true) => {
                    for (number, &column) in row.iter_mut().zip(columns) {
                        *number = self.number(&record, column)?;
                    }
                    take(&row)
                        .map_err(|(index, message)| self.cell(&record, columns[index], &message))?;
                }
                Ok(false) => return Ok(()),
                Err(error) => return Err(self.broken(&error)),
            }
        }
    }

    fn number(&self, record: &csv::StringRecord, column: usize) -> Result<f64, SceneError> {
        let refuse = |message: &str| self.cell(record, column, message);
        let number: f64 = record[column]
            .parse()
            .map_err(|_| refuse("is no number: give one such as 12.5"))?;
        if number.is_finite() {
            Ok(number)
        } else {
            Err(refuse("is not finite: give a number or take the row out"))
        }
    }

    fn cell(&self, record: &csv::StringRecord, column: usize, message: &str) -> SceneError {
        let key = if self.is_bare() {
            format!("column {}", column + 1)
        } else {
            format!("column {} ({})", column + 1, shortened(&self.first[column]))
        };
        let line = self.line_at(record.position());
        SceneError {
            key,
            ..self.refuse(line, format!("{} {message}", quoted(&record[column])))
        }
    }

    /// Whether a row's line holds nothing but blanks.
    fn is_blank(&self, record: &csv::StringRecord) -> bool {
        let starts_blank = record
            .iter()
            .next()
            .is_none_or(|cell| cell.trim().is_empty());
        starts_blank && {
            let line = self.start(record.position()).map(|start| {
                let rest = &self.bytes[start..];
                rest.split(|&byte| byte == b'\n').next().unwrap_or(rest)
            });
            line.is_some_and(|line| line.trim_ascii().is_empty())
        }
    }

    /// The reader's own count stands before the empty lines that it passes over.
    fn start(&self, position: Option<&csv::Position>) -> Option<usize> {
        let start = (position?.byte() as usize).min(self.bytes.len());
        let empty = self.bytes[start..]
            .iter()
            .take_while(|byte| b"\r\n".contains(byte))
            .count();
        Some(start + empty)
    }

    fn line_at(&self, position: Option<&csv::Position>) -> Option<usize> {
        Some(line_at(self.bytes, self.start(position)?))
    }

    fn broken(&self, error: &csv::Error) -> SceneError {
        let message = match error.kind() {
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => format!(
                "{len} cells where the first line has {expected_len}: give one for each column"
            ),
            csv::ErrorKind::Utf8 { .. } => "is not text: give CSV in UTF-8".to_owned(),
            _ => format!("cannot be read: {error}"),
        };
        self.refuse(self.line_at(error.position()), message)
    }
}

/// As much of a cell, a line, a key or a value as a refusal repeats: a file that is no CSV may be a single one.
pub(super) fn shortened(text: &str) -> String {
    cut(text, 80)
}

/// As much of a path or a list of names.
pub(super) fn cut_list(text: &str) -> String {
    cut(text, 1000)
}

fn cut(text: &str, letters: usize) -> String {
    match text.char_indices().nth(letters) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// The shortened text in quotes.
pub(super) fn quoted(text: &str) -> String {
    format!("{:?}", shortened(text))
}

/// Whether a row was read, of however many cells.
fn is_row(read: &csv::Result<bool>) -> bool {
    match read {
        Ok(is_there) => *is_there,
        Err(error) => matches!(error.kind(), csv::ErrorKind::UnequalLengths { .. }),
    }
}
