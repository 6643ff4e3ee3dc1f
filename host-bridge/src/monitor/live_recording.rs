//! A recording that is made while watching.

use std::path::{Path, PathBuf};

use protocol::{PortCounters, Role};

use crate::link::Event;
use crate::recording::{PART, Progress, Recorder, RecordingError, Settings, part_path};

/// A recording under way.
pub struct LiveRecording {
    /// Its file.
    pub path: PathBuf,
    /// Since when, in µs of [`crate::host_clock::now_us`].
    pub since_us: u64,
    recorder: Recorder,
}

impl LiveRecording {
    /// Begins one in `folder`, under the first name of `monitor-1.mcap`, `monitor-2.mcap` and so on that is
    /// free.
    ///
    /// # Errors
    /// If it can't be written there.
    pub fn begin(folder: &Path, since_us: u64) -> Result<Self, RecordingError> {
        let named = |number: u32| folder.join(format!("monitor-{number}.mcap"));
        let is_free = |path: &PathBuf| !path.exists() && !part_path(path, 2).exists();
        let path = (1..=u32::MAX)
            .map(named)
            .find(is_free)
            .unwrap_or_else(|| named(0));
        let recorder = Recorder::start(Settings {
            mcap: Some(path.clone()),
            csv: None,
            force: false,
            part: Some(PART),
        })?;
        Ok(Self {
            path,
            since_us,
            recorder,
        })
    }

    /// Keeps what a link tells.
    pub fn keep(&self, role: Role, event: &Event) {
        self.recorder.on_event(role, event);
    }

    /// Keeps what this end of a line has counted.
    pub fn keep_counters(&self, role: Role, counters: PortCounters) {
        self.recorder.on_counters(role, counters);
    }

    /// Keeps a line of a board's log; `level` is defmt's.
    pub fn keep_log(&self, role: Role, level: Option<&'static str>, text: String) {
        self.recorder.on_log(role, level, text);
    }

    /// How it stands.
    pub fn progress(&self) -> Progress {
        self.recorder.progress()
    }

    /// Whether it has come to an end before its time.
    pub fn has_failed(&self) -> bool {
        self.progress().failed
    }

    /// Ends it, and says what is in it.
    ///
    /// # Errors
    /// If it could not be written to the end. What was safe before is.
    pub fn end(self) -> Result<Progress, RecordingError> {
        self.recorder.stop()
    }
}
