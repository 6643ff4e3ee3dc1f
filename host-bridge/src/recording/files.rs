//! Everything that a recording is written to: MCAP files, one after the other, and a folder of CSV.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use protocol::{PROTOCOL_VERSION, SCHEMA_HASH};

use super::Settings;
use super::csv_folder::CsvFolder;
use super::mcap_file::{CONFIGURATION, FORMAT, McapFile};
use super::reader::Reader;
use super::row::{HelloRow, LinkEvent, Row};
use super::row_builder::Entry;
use crate::clock::{now_us, unix_ns};
use crate::recording::RecordingError;

pub struct RecordingFiles {
    settings: Settings,
    mcap: Option<McapFile>,
    csv: Option<CsvFolder>,
    part: u32,
    begun: Instant,
    /// Bytes of the parts that have ended.
    ended_bytes: u64,
    boards: BTreeMap<&'static str, Facts>,
}

/// What every part of a recording tells of a board, for it may be all that is read.
#[derive(Clone, Debug, Default, PartialEq)]
struct Facts {
    hello: Option<HelloRow>,
    configuration: Option<String>,
}

/// The name of a part: that of the recording for the first, with a number behind it for the others.
pub fn part_path(path: &Path, part: u32) -> PathBuf {
    if part <= 1 {
        return path.to_owned();
    }
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{part}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

/// Files of the names that later parts of this recording would have, and their numbers.
fn named_as_parts(path: &Path) -> Vec<(PathBuf, u32)> {
    let folder = path.parent().filter(|folder| folder.as_os_str() != "");
    let stem = path.file_stem().unwrap_or_default().as_encoded_bytes();
    let number = |found: &Path| {
        let number = found.file_stem()?.as_encoded_bytes();
        let number = number.strip_prefix(stem)?.strip_prefix(b"-")?;
        let number = str::from_utf8(number).ok()?.parse().ok()?;
        // Not 1, and no number that is written otherwise.
        (number > 1 && part_path(path, number).file_name() == found.file_name()).then_some(number)
    };
    fs::read_dir(folder.unwrap_or(Path::new(".")))
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter_map(|found| number(&found).map(|number| (found, number)))
        .collect()
}

/// The later parts of an earlier recording of this name, which would be taken for this one's. Fails if there is a file
/// that would be in a part's way hours from now.
fn later_parts(settings: &Settings) -> Result<Vec<PathBuf>, RecordingError> {
    let mut parts = Vec::new();
    for (path, number) in settings
        .mcap
        .as_deref()
        .map_or_else(Vec::new, named_as_parts)
    {
        let is_in_the_way = settings.part.is_some();
        if !settings.force {
            if is_in_the_way {
                return Err(RecordingError::Exists(path));
            }
        } else if Reader::open(&path).is_ok_and(|file| file.part() == number) {
            parts.push(path);
        } else if is_in_the_way {
            return Err(RecordingError::NoPart(path));
        }
    }
    Ok(parts)
}

fn about(part: u32) -> BTreeMap<String, String> {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    [
        ("format", FORMAT.to_owned()),
        ("program", env!("CARGO_PKG_VERSION").to_owned()),
        ("protocol", PROTOCOL_VERSION.to_string()),
        ("schema", format!("{SCHEMA_HASH:016x}")),
        ("host", host.trim().to_owned()),
        ("started_unix_ns", unix_ns(now_us()).to_string()),
        ("part", part.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into()
}

impl Facts {
    fn map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::new();
        if let Some(hello) = &self.hello {
            let facts = [
                ("role", hello.role.0.clone()),
                ("chip", hello.chip.0.clone()),
                (
                    "version",
                    hello.version.map(|number| number.to_string()).join("."),
                ),
                ("protocol", hello.protocol.to_string()),
                ("schema", hello.schema.0.clone()),
            ];
            map.extend(facts.map(|(key, value)| (key.to_owned(), value)));
        }
        if let Some(configuration) = &self.configuration {
            map.insert(CONFIGURATION.to_owned(), configuration.clone());
        }
        map
    }
}

impl RecordingFiles {
    /// Makes the files. Fails if there are such files already, or they can't be made.
    pub fn open(settings: Settings) -> Result<Self, RecordingError> {
        if settings.mcap.is_none() && settings.csv.is_none() {
            return Err(RecordingError::Nowhere);
        }
        let old_parts = later_parts(&settings)?;
        let force = settings.force;
        let mcap = settings
            .mcap
            .as_deref()
            .map(|path| McapFile::create(path, force, about(1)));
        let csv = settings
            .csv
            .as_deref()
            .map(|folder| CsvFolder::create(folder, force));
        let mut files = Self {
            mcap: mcap.transpose()?,
            csv: csv.transpose()?,
            settings,
            part: 1,
            begun: Instant::now(),
            ended_bytes: 0,
            boards: BTreeMap::new(),
        };
        // Nothing old goes before everything new is there.
        if let Some(csv) = &mut files.csv {
            csv.keep()?;
        }
        if let Some(mcap) = &mut files.mcap {
            mcap.keep()?;
        }
        for path in old_parts {
            fs::remove_file(&path).map_err(|source| RecordingError::NotMade(path, source))?;
        }
        Ok(files)
    }

    /// Writes an entry. It is safe after the next [`RecordingFiles::sync`]. Fails if a file does not take it.
    pub fn write(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        self.note(entry)?;
        if let Some(mcap) = &mut self.mcap {
            mcap.write(entry)?;
        }
        if let Some(csv) = &mut self.csv {
            csv.write(entry)?;
        }
        Ok(())
    }

    /// Keeps what every part has to tell of a board.
    fn note(&mut self, entry: &Entry) -> Result<(), RecordingError> {
        let name = entry.role.name();
        match &entry.row {
            Row::Link(link) if link.event == LinkEvent::Turned && link.hello.is_some() => {
                let facts = self.boards.entry(name).or_default();
                if facts.hello != link.hello {
                    facts.hello.clone_from(&link.hello);
                    let map = facts.map();
                    if let Some(mcap) = &mut self.mcap {
                        mcap.tell(name, map)?;
                    }
                }
            }
            Row::SensorConfiguration(_) | Row::DisplayConfiguration(_) => {
                let configuration = entry.row.value().ok().map(|value| value.to_string());
                self.boards.entry(name).or_default().configuration = configuration;
            }
            _ => {}
        }
        Ok(())
    }

    /// Makes everything written so far safe, and goes on in another file if it is time to. Fails if a file does not
    /// take it, was removed, or can't be made.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        if let Some(mcap) = &mut self.mcap {
            mcap.sync()?;
        }
        if let Some(csv) = &mut self.csv {
            csv.sync()?;
        }
        let part = self.settings.part;
        if part.is_some_and(|length| self.begun.elapsed() >= length) {
            self.turn_over()?;
        }
        Ok(())
    }

    fn turn_over(&mut self) -> Result<(), RecordingError> {
        let (Some(path), Some(mcap)) = (self.settings.mcap.as_deref(), self.mcap.take()) else {
            return Ok(());
        };
        self.ended_bytes += mcap.finish()?;
        self.part += 1;
        self.begun = Instant::now();
        let path = part_path(path, self.part);
        let mut mcap = McapFile::create(&path, self.settings.force, about(self.part))?;
        mcap.keep()?;
        for (name, facts) in &self.boards {
            mcap.tell(name, facts.map())?;
        }
        self.mcap = Some(mcap);
        Ok(())
    }

    /// Bytes that are safe, in all files.
    pub fn safe_bytes(&self) -> u64 {
        self.ended_bytes
            + self.mcap.as_ref().map_or(0, McapFile::safe_bytes)
            + self.csv.as_ref().map_or(0, CsvFolder::safe_bytes)
    }

    /// Ends all files as they should end. Returns the bytes of all. Fails if one does not take it. What was safe
    /// before is.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        if let Some(csv) = &mut self.csv {
            csv.sync()?;
        }
        if let Some(mcap) = self.mcap.take() {
            self.ended_bytes += mcap.finish()?;
        }
        Ok(self.safe_bytes())
    }

    /// Takes away what is not safe.
    pub fn abandon(self) {
        if let Some(mcap) = self.mcap {
            mcap.abandon();
        }
        if let Some(mut csv) = self.csv {
            csv.abandon();
        }
    }
}
