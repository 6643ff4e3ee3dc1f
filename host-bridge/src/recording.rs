//! Recordings: everything that both boards say, and what their links do, in MCAP and CSV.
//!
//! ```text
//! link ─> queue ─> row builder: times, gaps ─> files: MCAP files, CSV folder ─> safe on disk, once a second
//! MCAP ─> reader: rows ─> replay
//! ```
//!
//! MCAP holds messages of ROS 2 with their definitions, which Foxglove, PlotJuggler and ROS 2's own tools read
//! as they come. There is a channel for each board and kind of message: [`row::CHANNELS`].

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use files::RecordingFiles;
pub use files::part_path;
use protocol::{PortCounters, Role};
use queue::{Input, Loss, Output, PATIENCE, Taken, queue};
pub use ros2::{CdrEncoder, ChannelSchema, SayError, SchemaError};
pub use row_builder::{Entry, Note, RowBuilder, Tally};

use crate::clock::now_us;
use crate::link::Event;
use crate::lock::locked;
use crate::output_file::advice;

mod csv_folder;
mod descriptions;
mod files;
pub(crate) mod gauge_stream;
mod mcap_file;
mod queue;
pub mod reader;
mod ros2;
pub mod row;
mod row_builder;
mod sink;
/// How often what has been heard is made safe: with the time that the disk takes, once a second.
pub const SYNC: Duration = Duration::from_millis(900);
/// How long an MCAP file gets before another one follows: its index takes some 10 MB of memory until then.
pub const PART: Duration = Duration::from_secs(4 * 3_600);

/// Where a recording goes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// The MCAP file, if any.
    pub mcap: Option<PathBuf>,
    /// The folder of CSV files, if any.
    pub csv: Option<PathBuf>,
    /// Whether to write over what is there already.
    pub force: bool,
    /// How long an MCAP file gets before another one follows; none: however long.
    pub part: Option<Duration>,
}

/// How a recording stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// What has been written, and is safe on the disk.
    pub tally: Tally,
    /// Bytes that are safe on the disk.
    pub safe_bytes: u64,
    /// Whether it has come to an end before its time: [`Recorder::stop`] says why.
    pub failed: bool,
}

/// A note, whose board it is of and when it was made; boxed, so that an empty queue takes little memory.
type Taking = (Role, u64, Box<Note>);
type Writer = JoinHandle<Result<Progress, RecordingError>>;

/// A recording. By default it has no files yet, and keeps what it is told until [`Recorder::open`] makes them, or its queue is
/// full. Dropping it ends it without a word; [`Recorder::stop`] says how it went.
pub struct Recorder {
    notes: Input<Taking>,
    /// The other end of the queue, until there are files.
    waiting: Mutex<Option<Output<Taking>>>,
    progress: Arc<Mutex<Progress>>,
    writer: Mutex<Option<Writer>>,
}

impl Default for Recorder {
    fn default() -> Self {
        let (notes, waiting) = queue(PATIENCE);
        Self {
            notes,
            waiting: Mutex::new(Some(waiting)),
            progress: Arc::default(),
            writer: Mutex::default(),
        }
    }
}

impl Recorder {
    /// Makes the files and begins to record. Fails if there are such files already, or they can't be made.
    pub fn start(settings: Settings) -> Result<Self, RecordingError> {
        let recorder = Self::default();
        recorder.open(settings)?;
        Ok(recorder)
    }

    /// Makes the files and begins to write, first of all what was told before; does nothing if that was done already. Fails as
    /// [`Recorder::start`] does.
    pub fn open(&self, settings: Settings) -> Result<(), RecordingError> {
        if locked(&self.waiting).is_none() {
            return Ok(());
        }
        // Not under the lock: a disk may hang.
        let files = RecordingFiles::open(settings)?;
        if let Some(waiting) = locked(&self.waiting).take() {
            let writer_thread = WriterThread {
                waiting,
                progress: Arc::clone(&self.progress),
                files,
                row_builder: RowBuilder::default(),
            };
            *locked(&self.writer) = Some(thread::spawn(|| writer_thread.run()));
        }
        Ok(())
    }

    /// Takes what the link to the board of `role` tells: to be called from the link's thread, which it does
    /// not hold up for longer than 100 ms, and then only once while the disk stands still.
    pub fn on_event(&self, role: Role, event: &Event) {
        let at_us = match event {
            Event::Heard { at_us, .. } => *at_us,
            Event::Restarted | Event::StateChanged(_) => now_us(),
        };
        self.put(role, at_us, Note::Event(event.clone()));
    }

    /// Takes what this end of the line to the board of `role` has counted.
    pub fn on_counters(&self, role: Role, counters: PortCounters) {
        self.put(role, now_us(), Note::Counters(counters));
    }

    /// Takes a line of the log of the board of `role`, which was read just now; `level` is defmt's.
    pub fn on_log(&self, role: Role, level: Option<&'static str>, text: String) {
        self.put(role, now_us(), Note::Log(level, text));
    }

    fn put(&self, role: Role, at_us: u64, note: Note) {
        self.notes.put(role, at_us, (role, at_us, Box::new(note)));
    }

    /// How it stands.
    pub fn progress(&self) -> Progress {
        let mut progress = *locked(&self.progress);
        // It ends by itself only where it can't go on, and by a panic without another word.
        let writer = locked(&self.writer);
        progress.failed |= writer.as_ref().is_some_and(Writer::is_finished);
        progress
    }

    /// Writes what still waits, ends the files as they should end, and says what is in them. The second call says
    /// nothing. Fails if they could not be written to the end. What was safe before is.
    pub fn stop(&self) -> Result<Progress, RecordingError> {
        let writer = locked(&self.writer).take();
        self.notes.close();
        match writer {
            None => Ok(self.progress()),
            Some(writer) => writer.join().map_err(|_| RecordingError::Died)?,
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let _ = self.stop();
    }
}

/// Where the writing is done, on a thread of its own.
struct WriterThread {
    waiting: Output<Taking>,
    progress: Arc<Mutex<Progress>>,
    files: RecordingFiles,
    row_builder: RowBuilder,
}

impl WriterThread {
    fn run(mut self) -> Result<Progress, RecordingError> {
        match self.write_all() {
            Ok(()) => {
                let safe_bytes = self
                    .files
                    .finish()
                    .inspect_err(|_| locked(&self.progress).failed = true)?;
                let mut progress = locked(&self.progress);
                *progress = all_safe(self.row_builder.tally(), safe_bytes);
                Ok(*progress)
            }
            Err(error) => {
                self.files.abandon();
                locked(&self.progress).failed = true;
                Err(error)
            }
        }
    }

    /// Writes until the queue is closed and empty.
    fn write_all(&mut self) -> Result<(), RecordingError> {
        let mut due = Instant::now() + SYNC;
        loop {
            let (role, at_us, note) = match self.waiting.take(due) {
                Taken::Item(taking) => taking,
                Taken::Refused(Loss { role, count, at_us }) => {
                    (role, at_us, Box::new(Note::Unwritten(count)))
                }
                Taken::Nothing => {
                    due = self.sync()?;
                    continue;
                }
                Taken::Closed => return Ok(()),
            };
            for entry in self.row_builder.enter(role, at_us, &note) {
                self.files.write(&entry)?;
            }
            if Instant::now() >= due {
                due = self.sync()?;
            }
        }
    }

    /// Makes safe what was written; when that is due again.
    fn sync(&mut self) -> Result<Instant, RecordingError> {
        self.files.sync()?;
        let safe_bytes = self.files.safe_bytes();
        *locked(&self.progress) = all_safe(self.row_builder.tally(), safe_bytes);
        Ok(Instant::now() + SYNC)
    }
}

fn all_safe(tally: Tally, safe_bytes: u64) -> Progress {
    Progress {
        tally,
        safe_bytes,
        failed: false,
    }
}

/// What went wrong with a recording that is being written.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum RecordingError {
    #[error("{0}: is there already: give another name, or --force to write over it")]
    Exists(PathBuf),
    #[error(
        "{0}: would be in the way of this recording's parts, and is none of an earlier one: give another name"
    )]
    NoPart(PathBuf),
    #[error("{0}: can't be made: {1}{advice}", advice = advice(.1))]
    NotMade(PathBuf, #[source] io::Error),
    #[error(
        "{path}: can't be written any further: {source}{advice}; {safe_bytes} bytes of it are safe",
        advice = advice(source)
    )]
    NotWritten {
        path: PathBuf,
        safe_bytes: u64,
        source: io::Error,
    },
    #[error("{0}: was removed while it was being written")]
    Removed(PathBuf),
    #[error("there is nowhere to record to: give a file, FILE.mcap, or --csv FOLDER")]
    Nowhere,
    #[error("the recording stopped by an error of this program")]
    Died,
}

impl RecordingError {
    pub(super) fn not_made(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        if source.kind() == io::ErrorKind::AlreadyExists {
            Self::Exists(path)
        } else {
            Self::NotMade(path, source)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use protocol::{Message, Ping};

    use super::*;

    /// Far more than anything here takes.
    const LIMIT: Duration = Duration::from_secs(30);

    fn heard(at_us: u64) -> Event {
        Event::Heard {
            at_us,
            message: Message::Ping(Ping { sent_us: at_us }),
        }
    }

    #[test]
    fn a_disk_that_is_full_ends_the_recording_and_holds_nobody_up() {
        let settings = Settings {
            mcap: Some("/dev/full".into()),
            force: true,
            ..Settings::default()
        };
        // What is made first may be refused already, or what is synced first.
        let error = match Recorder::start(settings) {
            Err(error) => error,
            Ok(recorder) => {
                let end = Instant::now() + LIMIT;
                while !recorder.progress().failed && Instant::now() < end {
                    recorder.on_event(Role::Sensor, &heard(1));
                    thread::park_timeout(Duration::from_millis(1));
                }
                // Far more than the queue takes: it is thrown away at once.
                let began = Instant::now();
                (0..100_000).for_each(|at_us| recorder.on_event(Role::Sensor, &heard(at_us)));
                assert!(began.elapsed() < LIMIT, "{:?}", began.elapsed());
                recorder.stop().expect_err("nothing can be written")
            }
        };
        let RecordingError::NotWritten { path, source, .. } = &error else {
            panic!("{error}");
        };
        assert_eq!(path, Path::new("/dev/full"));
        assert_eq!(source.kind(), io::ErrorKind::StorageFull, "{error}");
    }

    #[test]
    fn a_writer_that_panicked_has_failed() {
        let recorder = Recorder::default();
        *locked(&recorder.writer) = Some(thread::spawn(|| panic!("as a test wants it")));
        let end = Instant::now() + LIMIT;
        while !recorder.progress().failed && Instant::now() < end {
            thread::park_timeout(Duration::from_millis(1));
        }
        assert!(recorder.progress().failed);
        assert!(matches!(recorder.stop(), Err(RecordingError::Died)));
    }

    /// A folder of a test's own, which is not there.
    fn folder(name: &str) -> PathBuf {
        let name = format!("ridgelink-{}-{name}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&folder);
        folder
    }

    #[test]
    fn what_was_heard_before_there_were_files_is_written_and_they_are_made_once() {
        let folder = folder("before");
        let settings = |name: &str| Settings {
            csv: Some(folder.join(name)),
            ..Settings::default()
        };
        std::fs::create_dir_all(&folder).expect("it can be made");
        let recorder = Recorder::default();
        (0..10).for_each(|at_us| recorder.on_event(Role::Display, &heard(at_us)));
        for name in ["first", "second"] {
            let opened = recorder.open(settings(name));
            opened.unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        recorder.on_event(Role::Display, &heard(10));
        let ended = recorder.stop().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((ended.tally.messages, ended.tally.unwritten), (11, 0));
        assert!(folder.join("first").is_dir() && !folder.join("second").exists());
        std::fs::remove_dir_all(&folder).expect("the folder is there");
    }

    #[test]
    fn what_was_heard_is_safe_within_a_second_and_so_counted() {
        let folder = folder("counted");
        let recorder = Recorder::start(Settings {
            csv: Some(folder.clone()),
            ..Settings::default()
        })
        .unwrap_or_else(|error| panic!("{error}"));
        (0..10).for_each(|at_us| recorder.on_event(Role::Display, &heard(at_us)));
        let end = Instant::now() + LIMIT;
        while recorder.progress().tally.messages < 10 && Instant::now() < end {
            thread::park_timeout(Duration::from_millis(1));
        }
        let progress = recorder.progress();
        let bytes: u64 = std::fs::read_dir(&folder)
            .expect("the folder was made")
            .map(|file| file.and_then(|file| file.metadata()).expect("a file").len())
            .sum();
        assert_eq!((progress.tally.messages, progress.safe_bytes), (10, bytes));
        let ended = recorder.stop().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(ended.tally.messages, 10);
        std::fs::remove_dir_all(&folder).expect("the folder is there");
    }
}
