//! A dashboard that is watched: where events come from, and where orders go to.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, TryRecvError};
use protocol::Role;

use super::dashboard::Dashboard;
use super::log_entry::LogEvent;
use crate::clock::is_due;
use crate::clock::now_us;
use crate::link::{Event, Link, LinkSender};
use crate::lock::locked;
use crate::recording::gauge_stream::{GaugeStream, Lease};
use crate::recording::{PART, Progress, Recorder, RecordingError, Settings, part_path};
use crate::state::State;

/// How often the links' own counters are looked at, in µs.
const LINES_US: u64 = 200_000;
/// How often is looked whether a recording has something to ask for.
const LOOK: Duration = Duration::from_millis(50);

/// Where a monitor hears from.
pub struct Source {
    /// What the boards say, as it comes. When its senders are gone the monitor has seen all.
    pub events: Receiver<(Role, Event)>,
    /// That a Stop is being said to all of them, each time before it is.
    pub stops: Receiver<()>,
    /// The ways to the boards; none where a recording is watched.
    pub links: Vec<(Role, Link)>,
    /// The boards' logs, if they are read.
    pub logs: Option<mpsc::Receiver<(Role, LogEvent)>>,
    /// What whoever puts in the events feeds first.
    pub feed: RecordingFeed,
}

/// Feeds the recording that a key has begun, if one goes on, from whoever hears the boards: who draws may have to wait
/// for the terminal.
#[derive(Clone, Default)]
pub struct RecordingFeed(Arc<Mutex<Fed>>);

#[derive(Default)]
struct Fed {
    /// How the ways to the boards stand.
    states: Vec<(Role, State)>,
    recorder: Option<Arc<Recorder>>,
    /// Has the gauges stream for as long as a recording lasts.
    stream: GaugeStream,
}

impl RecordingFeed {
    /// Takes what the link to the board of `role` tells.
    pub fn on_event(&self, role: Role, event: &Event) {
        let mut fed = locked(&self.0);
        if let Event::StateChanged(state) = event {
            fed.states.retain(|(of, _)| *of != role);
            fed.states.push((role, state.clone()));
        }
        fed.stream.on_event(role, event);
        let recorder = fed.recorder.clone();
        // A disk that stands still holds up one link only.
        drop(fed);
        if let Some(recorder) = recorder {
            recorder.on_event(role, event);
        }
    }

    /// Takes what logs say, and passes it on.
    pub fn pass_on(
        &self,
        lines: mpsc::Receiver<(Role, LogEvent)>,
    ) -> mpsc::Receiver<(Role, LogEvent)> {
        let (passing, passed) = mpsc::channel();
        let feed = self.clone();
        thread::spawn(move || {
            for (role, what) in lines {
                feed.on_log(role, &what);
                if passing.send((role, what)).is_err() {
                    return;
                }
            }
        });
        passed
    }

    fn on_log(&self, role: Role, what: &LogEvent) {
        let recorder = locked(&self.0).recorder.clone();
        if let (Some(recorder), Some((level, text))) = (recorder, what.line()) {
            recorder.on_log(role, level, text);
        }
    }

    /// Feeds `recorder` from now on.
    fn begin(&self, recorder: &Arc<Recorder>) {
        let mut fed = locked(&self.0);
        fed.stream = GaugeStream::new(true);
        // What came before it began is a part of it, so that it can be played back to a monitor.
        for (role, state) in fed.states.clone() {
            let event = Event::StateChanged(state);
            recorder.on_event(role, &event);
            fed.stream.on_event(role, &event);
        }
        fed.recorder = Some(Arc::clone(recorder));
    }

    fn end(&self) {
        locked(&self.0).recorder = None;
    }

    /// Asks for what a recording needs, and records what the lines have counted, until `ended` is closed. What is not
    /// answered is asked again.
    fn ask(&self, recorder: &Recorder, boards: &[(Role, LinkSender)], ended: &mpsc::Receiver<()>) {
        let mut lines_us = None;
        loop {
            let now_us = now_us();
            loop {
                // It is not held while something is said.
                let due = locked(&self.0).stream.due(now_us);
                let Some((role, message)) = due else { break };
                if let Some((_, board)) = boards.iter().find(|(of, _)| *of == role) {
                    let _ = board.post(&message);
                }
            }
            if is_due(lines_us, LINES_US, now_us) {
                lines_us = Some(now_us);
                for (role, board) in boards {
                    recorder.on_counters(*role, board.counters());
                }
            }
            if ended.recv_timeout(LOOK) == Err(mpsc::RecvTimeoutError::Disconnected) {
                return;
            }
        }
    }
}

pub struct Session {
    pub dashboard: Dashboard,
    source: Source,
    folder: PathBuf,
    recording: Option<LiveRecording>,
    /// A recording that is being ended, by a thread of its own: a disk may take its time.
    ending: Option<(String, JoinHandle<Result<Progress, RecordingError>>)>,
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
        self.note_stops();
        let now_us = now_us();
        self.dashboard.elapse(now_us);
        if let Some(logs) = &self.source.logs {
            for (role, what) in logs.try_iter() {
                came = true;
                self.dashboard.log(role, what);
            }
        }
        if is_due(self.lines_us, LINES_US, now_us) {
            self.lines_us = Some(now_us);
            for (role, link) in &self.source.links {
                let counters = link.counters();
                self.dashboard.on_line(*role, counters, link.clocks());
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

    /// Asks for what who watches needs. What is not answered is asked again.
    fn ask(&mut self) {
        let wanted = self.dashboard.streams && self.dashboard.sensor.is_known();
        if let Some(message) = wanted.then(|| self.watch.due(now_us())).flatten()
            && let Some(link) = self.link(Role::Sensor)
        {
            let _ = link.post(&message);
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
        let links = self.source.links.iter();
        let boards = links.map(|(role, link)| (*role, link.sender())).collect();
        let feed = self.source.feed.clone();
        match LiveRecording::begin(&self.folder, self.dashboard.now_us, feed, boards) {
            Ok(recording) => {
                self.recording = Some(recording);
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
        self.source.feed.end();
        // One at a time: the one before has had all its time.
        let _ = self.finish_recording();
        self.ending = Some((path, thread::spawn(move || recording.end())));
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

    /// Shows what becomes of a Stop that was said elsewhere.
    fn note_stops(&mut self) {
        if self.source.stops.try_iter().count() > 0 {
            self.dashboard.stop();
        }
    }

    fn on(&mut self, role: Role, event: Event) {
        // Before the answers to it.
        self.note_stops();
        self.has_met |= matches!(&event, Event::StateChanged(state) if state.is_known());
        self.dashboard.on(now_us(), role, event);
    }
}

pub struct LiveRecording {
    pub path: PathBuf,
    /// Since when, in µs of [`crate::clock::now_us`].
    pub since_us: u64,
    pub recorder: Arc<Recorder>,
    /// Closed when it is to end.
    going: mpsc::Sender<()>,
    asking: JoinHandle<()>,
}

impl LiveRecording {
    /// Begins one in `folder`, under the first name of `monitor-1.mcap`, `monitor-2.mcap` and so on that is free, of
    /// what comes through `feed`; `boards` are asked for what it needs. Fails if it can't be written there.
    fn begin(
        folder: &Path,
        since_us: u64,
        feed: RecordingFeed,
        boards: Vec<(Role, LinkSender)>,
    ) -> Result<Self, RecordingError> {
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
        let recorder = Arc::new(recorder);
        feed.begin(&recorder);
        let (going, ended) = mpsc::channel();
        let asked = Arc::clone(&recorder);
        let asking = thread::spawn(move || feed.ask(&asked, &boards, &ended));
        Ok(Self {
            path,
            since_us,
            recorder,
            going,
            asking,
        })
    }

    /// Ends it when all that came is written. Fails if it can't be.
    fn end(self) -> Result<Progress, RecordingError> {
        drop(self.going);
        // A thread that panicked has said so on standard error.
        let _ = self.asking.join();
        self.recorder.stop()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::reader::Reader;
    use crate::recording::row::Row;

    #[test]
    fn lines_of_a_log_are_recorded_while_nobody_draws() {
        let folder = std::env::temp_dir().join(format!("session-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let (_events, happens) = crossbeam_channel::unbounded();
        let (lines, read) = mpsc::channel();
        let feed = RecordingFeed::default();
        let source = Source {
            events: happens,
            stops: crossbeam_channel::never(),
            links: Vec::new(),
            logs: Some(feed.pass_on(read)),
            feed,
        };
        let mut session = Session::new(source, folder.clone());
        session.toggle_recording();
        let log = |text: &str| LogEvent::Log {
            level: None,
            text: text.to_owned(),
        };
        lines.send((Role::Sensor, log("a line"))).unwrap();
        // It is passed on when it has been fed.
        let passed = session.source.logs.as_ref().unwrap().recv();
        assert_eq!(passed, Ok((Role::Sensor, log("a line"))));
        session.close().unwrap();
        let mut reader = Reader::open(&folder.join("monitor-1.mcap")).unwrap();
        let mut texts = Vec::new();
        while let Some(entry) = reader.next_entry().unwrap() {
            if let Row::Log(row) = entry.row {
                texts.push(row.msg.0);
            }
        }
        assert_eq!(texts, ["a line"]);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
