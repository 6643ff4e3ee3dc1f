//! A map's CSV file: rows are added as runs finish, in any order, and sorted when the last has come.
//!
//! A row is written by one call, so a killed process leaves at most one line cut off; that line is
//! dropped when the file is next opened, and its run is made again.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::Map;
use super::error::{MapError, NOT_WRITTEN};
use super::fingerprint::Fingerprints;
use super::row::{Row, header, rank};
use crate::output::replace;

/// Rows by method and cell.
pub type Rows = BTreeMap<(String, usize), Row>;

/// An open CSV file that no other process writes.
pub struct Journal<'a> {
    map: &'a Map,
    path: PathBuf,
    file: File,
    /// Held until the journal is dropped.
    _lock: Lock,
}

impl<'a> Journal<'a> {
    /// Opens the file or makes it, and reads what is in it. With `renew`, rows of another grid or version
    /// are thrown away instead of refused.
    pub fn open(
        map: &'a Map,
        path: &Path,
        keys: &mut Fingerprints,
        renew: bool,
    ) -> Result<(Self, Rows), MapError> {
        let lock = lock(path)?;
        let (rows, is_sound) = if path.exists() {
            read(map, path, keys, renew)?
        } else {
            (Rows::new(), false)
        };
        if !is_sound {
            rewrite(map, path, keys, &rows)?;
        }
        let file = OpenOptions::new().append(true).open(path);
        let journal = Self {
            map,
            path: path.to_owned(),
            file: file.map_err(MapError::file(path, NOT_WRITTEN))?,
            _lock: lock,
        };
        Ok((journal, rows))
    }

    pub fn append(&mut self, row: &Row, keys: &mut Fingerprints) -> Result<(), MapError> {
        let line = line(self.map, row, keys)?;
        self.file.write_all(line.as_bytes()).map_err(MapError::file(
            &self.path,
            "cannot be written: make room and run again, nothing that is in it is lost",
        ))
    }

    /// Writes all rows anew, sorted. The file is replaced at once, not piece by piece.
    pub fn sort(&mut self, rows: &Rows, keys: &mut Fingerprints) -> Result<(), MapError> {
        rewrite(self.map, &self.path, keys, rows)
    }
}

/// The right to write a CSV file. Dropping it gives it up.
pub struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing it alone leaves it to a program that is just being started, and so has all files of this one.
        let _ = self.0.unlock();
    }
}

/// Takes the right to write a CSV file: a lock on a file beside it, since the CSV itself is replaced.
/// The right ends with the process, however it ends.
pub fn lock(path: &Path) -> Result<Lock, MapError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let lock_path = path.with_file_name(format!(".{name}.lock"));
    let mut options = OpenOptions::new();
    let file = options
        .create(true)
        .truncate(false)
        .write(true)
        .open(&lock_path);
    let file = file.map_err(MapError::file(&lock_path, NOT_WRITTEN))?;
    let no_locks = "cannot be locked: give an --out on a file system with locks";
    match file.try_lock() {
        Ok(()) => Ok(Lock(file)),
        Err(TryLockError::WouldBlock) => Err(MapError::Busy(path.to_owned())),
        Err(TryLockError::Error(source)) => Err(MapError::File(lock_path, no_locks, source)),
    }
}

/// Reads a CSV file: its rows (of two for the same run, the first), and whether there is nothing else in it. A last line
/// without an end is passed over; with `renew`, so is whatever is not of this grid and version.
pub fn read(
    map: &Map,
    path: &Path,
    keys: &mut Fingerprints,
    renew: bool,
) -> Result<(Rows, bool), MapError> {
    let bytes = fs::read(path).map_err(MapError::file(path, "cannot be read"))?;
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    let whole = end.map_or(0, |end| end + 1);
    let text = String::from_utf8_lossy(&bytes[..whole]);
    let foreign = |line: usize, what| MapError::Foreign(path.to_owned(), line, what);
    let mut rows = Rows::new();
    let mut is_sound = whole == bytes.len() && whole > 0;
    let mut lines = text.lines().enumerate();
    if lines
        .next()
        .is_some_and(|(_, line)| line != header(map).trim_end())
    {
        if renew {
            return Ok((rows, false));
        }
        let what = format!("the header is not that of {}", map.name);
        return Err(foreign(1, what));
    }
    for (index, line) in lines {
        let row = Row::parse(map, line).and_then(|(row, key)| match keys.of(&row.method) {
            Ok(own) if own == key => Ok(row),
            Ok(own) => Err(format!(
                "measured on another grid or by another version (key {key:016x}, here {own:016x})"
            )),
            Err(_) => Err(format!("method {:?} is unknown here", row.method)),
        });
        match row {
            Ok(row) => {
                rows.entry((row.method.clone(), row.cell)).or_insert(row);
            }
            Err(_) if renew => is_sound = false,
            Err(what) => return Err(foreign(index + 1, what)),
        }
    }
    Ok((rows, is_sound))
}

/// Replaces a CSV file by one with these rows, sorted by method and cell.
fn rewrite(map: &Map, path: &Path, keys: &mut Fingerprints, rows: &Rows) -> Result<(), MapError> {
    let mut sorted: Vec<&Row> = rows.values().collect();
    sorted.sort_by_key(|row| (rank(&row.method), row.cell));
    let mut text = header(map);
    for row in sorted {
        text += &line(map, row, keys)?;
    }
    replace(path, &text).map_err(MapError::file(path, NOT_WRITTEN))
}

fn line(map: &Map, row: &Row, keys: &mut Fingerprints) -> Result<String, MapError> {
    let key = keys.of(&row.method);
    let key = key.map_err(|source| MapError::Scene(map.name, source))?;
    Ok(row.line(map, key))
}
