//! A dashboard that is watched: where events come from, and where orders go to.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, TryRecvError};
use protocol::Role;

use super::dashboard::Dashboard;
use super::log_entry::LogEvent;
use crate::clock::is_due;
use crate::clock::now_us;
use crate::link::{Event, Link, LinkSender};
use crate::recording::gauge_stream::{GaugeStream, Lease};
use crate::recording::{PART, Progress, Recorder, RecordingError, Settings, part_path};

/// How often the links' own counters are looked at, in µs.
const LINES_US: u64 = 200_000;

/// Where a monitor hears from.
pub struct Source {
    /// What the boards say, as it comes. When its senders are gone the monitor has seen all.
    pub events: Receiver<(Role, Event)>,
    /// The ways to the boards; none where a recording is watched.
    pub links: Vec<(Role, Link)>,
    /// The boards' logs, if they are read.
    pub logs: Option<mpsc::Receiver<(Role, LogEvent)>>,
}

pub struct Session {
    pub dashboard: Dashboard,
    source: Source,
    folder: PathBuf,
    recording: Option<LiveRecording>,
    /// A recording that is being ended, by a thread of its own: a disk may take its time.
    ending: Option<(String, JoinHandle<Result<Progress, RecordingError>>)>,
    /// Has the gauges stream for as long as a recording lasts.
    stream: GaugeStream,
    watch: Lease,
    lines_us: Option<u64>,
    is_over: bool,
    /// Whether a board was ever there and understood.
    has_met: bool,
}

impl Session {
    /// Nothing has come yet. Recordings will go to `folder`.
    pub fn new(source: Source, folder: PathBuf) -> Self {
        let linked = source.links.iter().map(|(role, _)| *role).collect();
        let mut dashboard = Dashboard::default();
        dashboard.linked = linked;
        Self {
            dashboard,
            source,
            folder,
            recording: None,
            ending: None,
            stream: GaugeStream::default(),
            watch: Lease::default(),
            lines_us: None,
            is_over: false,
            has_met: false,
        }
    }

    /// Takes all that has come, and says what is due. Whether anything has come.
    pub fn take(&mut self) -> bool {
        let mut came = false;
        loop {
            match self.source.events.try_recv() {
                Ok((role, event)) => {
                    came = true;
                    self.on(role, event);
                }
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    self.is_over = true;
                    break;
                }
            }
        }
        let now_us = now_us();
        self.dashboard.elapse(now_us);
        if let Some(logs) = &self.source.logs {
            for (role, what) in logs.try_iter() {
                came = true;
                if let (Some(recording), LogEvent::Log { level, text }) = (&self.recording, &what) {
                    recording.recorder.on_log(role, *level, text.clone());
                }
                self.dashboard.log(role, what);
            }
        }
        if is_due(self.lines_us, LINES_US, now_us) {
            self.lines_us = Some(now_us);
            for (role, link) in &self.source.links {
                let counters = link.counters();
                self.dashboard.on_line(*role, counters, link.clocks());
                if let Some(recording) = &self.recording {
                    recording.recorder.on_counters(*role, counters);
                }
            }
            let recording = self.recording.as_ref();
            if recording.is_some_and(|recording| recording.recorder.progress().failed) {
                self.end_recording();
            }
        }
        let ending = self.ending.as_ref();
        if ending.is_some_and(|(_, ending)| ending.is_finished()) {
            came = true;
            // Told on the dashboard.
            let _ = self.finish_recording();
        }
        self.ask();
        self.say();
        came
    }

    /// The ways on which Stop is said.
    pub fn senders(&self) -> Vec<LinkSender> {
        let links = self.source.links.iter();
        links.map(|(_, link)| link.sender()).collect()
    }

    /// Asks for what a recording needs, and who watches. What is not answered is asked again.
    fn ask(&mut self) {
        let wanted = self.dashboard.streams && self.dashboard.sensor.is_known();
        if let Some(message) = wanted.then(|| self.watch.due(now_us())).flatten()
            && let Some(link) = self.link(Role::Sensor)
        {
            let _ = link.post(&message);
        }
        if self.recording.is_none() {
            return;
        }
        while let Some((role, message)) = self.stream.due(now_us()) {
            if let Some(link) = self.link(role) {
                let _ = link.post(&message);
            }
        }
    }

    fn link(&self, role: Role) -> Option<&Link> {
        let mut links = self.source.links.iter();
        links.find(|(of, _)| *of == role).map(|(_, link)| link)
    }

    /// Says what the dashboard has to say, at once.
    pub fn say(&mut self) {
        for role in [Role::Sensor, Role::Display] {
            for message in self.dashboard.take_outbox(role) {
                if let Some(link) = self.link(role)
                    && let Err(why) = link.post(&message)
                {
                    self.dashboard.on_not_sent(role, why);
                }
            }
        }
    }

    /// Waits for something to come, for `limit` at most, and takes it.
    pub fn wait(&mut self, limit: Duration) {
        match self.source.events.recv_timeout(limit) {
            Ok((role, event)) => self.on(role, event),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => self.is_over = true,
        }
    }

    /// Whether nothing more will come.
    pub const fn is_over(&self) -> bool {
        self.is_over
    }

    /// Begins a recording, or ends it; what has come of it is said on the dashboard.
    pub fn toggle_recording(&mut self) {
        if self.recording.is_some() {
            self.end_recording();
            return;
        }
        match LiveRecording::begin(&self.folder, self.dashboard.now_us) {
            Ok(recording) => {
                // What came before it began is a part of it, so that it can be played back to a monitor.
                self.stream = GaugeStream::new(true);
                for role in [Role::Sensor, Role::Display] {
                    if let Some(state) = &self.dashboard.board(role).state {
                        let event = Event::StateChanged(state.clone());
                        recording.recorder.on_event(role, &event);
                        self.stream.on_event(role, &event);
                    }
                }
                self.recording = Some(recording);
                self.ask();
                let gauges = if self.dashboard.sensor.is_known() {
                    "the sensor board is told to stream its gauges for as long as is recorded"
                } else {
                    "no gauges are recorded before the sensor board is there"
                };
                self.dashboard.notify(false, gauges.to_owned());
            }
            Err(error) => self
                .dashboard
                .notify(true, format!("NOT RECORDED: {error}")),
        }
    }

    /// The recording that is being made.
    pub const fn recording(&self) -> Option<&LiveRecording> {
        self.recording.as_ref()
    }

    /// Ends what is under way. Fails if the last of a recording can't be written.
    pub fn close(mut self) -> Result<(), RecordingError> {
        if self.recording.is_some() {
            self.end_recording();
        }
        self.finish_recording()
    }

    fn end_recording(&mut self) {
        let Some(recording) = self.recording.take() else {
            return;
        };
        let path = recording.path.display().to_string();
        // One at a time: the one before has had all its time.
        let _ = self.finish_recording();
        self.ending = Some((path, thread::spawn(move || recording.recorder.stop())));
    }

    /// Waits for the end of a recording, and tells what has come of it.
    fn finish_recording(&mut self) -> Result<(), RecordingError> {
        let Some((path, ending)) = self.ending.take() else {
            return Ok(());
        };
        // A thread that panicked has said so on standard error.
        let Ok(ended) = ending.join() else {
            return Ok(());
        };
        match &ended {
            Ok(progress) => self.dashboard.notify(
                false,
                format!(
                    "recorded: {path}: {} messages, {} samples",
                    progress.tally.messages, progress.tally.samples
                ),
            ),
            Err(error) => self
                .dashboard
                .notify(true, format!("RECORDING ENDED: {error}")),
        }
        ended.map(|_| ())
    }

    /// Whether a board was ever there and understood.
    pub const fn has_met(&self) -> bool {
        self.has_met
    }

    fn on(&mut self, role: Role, event: Event) {
        self.has_met |= matches!(&event, Event::StateChanged(state) if state.is_known());
        if let Some(recording) = &self.recording {
            recording.recorder.on_event(role, &event);
            self.stream.on_event(role, &event);
        }
        self.dashboard.on(now_us(), role, event);
    }
}

pub struct LiveRecording {
    pub path: PathBuf,
    /// Since when, in µs of [`crate::clock::now_us`].
    pub since_us: u64,
    pub recorder: Recorder,
}

impl LiveRecording {
    /// Begins one in `folder`, under the first name of `monitor-1.mcap`, `monitor-2.mcap` and so on that is free.
    /// Fails if it can't be written there.
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
}
