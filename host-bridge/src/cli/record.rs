//! `host-bridge record`.

use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crate::clock::now_us;
use crate::link::{Event, Link};
use crate::lock::locked;
use crate::monitor::firmware_log::Logs;
use crate::monitor::log_entry::LogEvent;
use crate::recording::gauge_stream::GaugeStream;
use crate::recording::{PART, Progress, Recorder, Settings};
use crate::state::{Advised, State};
use clap::ValueHint;
use protocol::{Message, Role};
use serde_json::json;

use super::output;
use super::signals::{self, Again, Orders};
use super::stop::Outcome;

/// What the command does.
pub const ABOUT: &str = "\
Writes everything that both boards say, and what their links do, to MCAP, to CSV or to both.

Once a second what has been heard is made safe on the disk: that much is kept whatever happens, and only that \
is counted as safe. The MCAP file reads as it is in Foxglove, PlotJuggler, ROS 2 and whatever else knows ROS 2's \
messages: a channel for each board and kind of message, and one for each firmware's log where the bench names an \
ELF and its rtt. The sensor board is asked for its gauges meanwhile, \
which changes nothing else of it. A board that is not there is named, \
and recorded from the moment it comes; one that goes and returns is recorded on. A bench that names one board \
only has only that one.";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge record rubbing.mcap                    until Ctrl-C
  host-bridge record rubbing.mcap --for 60 --json
  host-bridge record --csv rubbing --no-gauges       a folder of CSV files
  host-bridge record arm.mcap --sensor /dev/ttyACM0  the sensor board alone

Exit status: 0 recorded, to the end that was asked for; 1 the same with --for, but a board of the bench was never \
there, or not there at the end; 2 nothing could be recorded, or not to the end: what was said to be safe is.";

/// How often is looked whether there is something to do.
const LOOK: Duration = Duration::from_millis(50);
/// How often the progress is told.
const TOLD: Duration = Duration::from_secs(1);
/// Lines that wait for a terminal that stands still.
const WAITING_LINES: usize = 64;
/// How long the last ones may take.
const LINGER: Duration = Duration::from_secs(1);
const BOARDS: [Role; 2] = [Role::Sensor, Role::Display];

/// What `record` is asked for.
#[derive(Debug, clap::Args)]
pub struct Record {
    /// The MCAP file
    #[arg(value_name = "FILE.mcap", value_hint = ValueHint::FilePath, required_unless_present = "csv")]
    file: Option<PathBuf>,
    /// A folder for CSV files, one for each board and kind of message
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    csv: Option<PathBuf>,
    /// Asks for no samples: none are recorded, unless somebody else asks for them
    #[arg(long)]
    no_gauges: bool,
    /// Ends after so many seconds
    #[arg(long = "for", value_name = "SECONDS", value_parser = super::seconds, allow_negative_numbers = true)]
    until: Option<Duration>,
    /// Begins another MCAP file, FILE-2.mcap and so on, after so many minutes; 0 for never: the file's
    /// index takes 2.5 MB of memory for each hour of it
    #[arg(long, value_name = "MINUTES", default_value_t = PART.as_secs() as f64 / 60.0, allow_negative_numbers = true)]
    split: f64,
    /// Writes over files that are there already
    #[arg(long)]
    force: bool,
    /// Tells no progress
    #[arg(long)]
    quiet: bool,
    /// Prints one JSON object for scripts at the end
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    boards: super::Where,
}

impl Record {
    /// Records.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let orders = Orders::to_stop()?;
        let bench = self.boards.find()?;
        let part = Duration::try_from_secs_f64(self.split * 60.0);
        let part = part.map_err(|_| anyhow::anyhow!("--split: give minutes, 0 or more"))?;
        let ended = signals::flag_set_by(&signals::USUAL, Again::IsIgnored)?;
        let roles = bench.roles();
        let (logs, lines) = Logs::new();
        // Before there is a file: an old one is not to go for a log that can't be read.
        super::follow_logs(&bench, &roles, &logs)?;
        let (events, told) = channel();
        let recorder = Arc::new(Recorder::default());
        let recording = Arc::clone(&recorder);
        let presence = Arc::new(Mutex::new(Presence::default()));
        let theirs = Arc::clone(&presence);
        let links = super::links(&bench, move |role, event| {
            // Before anybody else is told: a board that is asked something counts as there.
            locked(&theirs).on_event(role, &event);
            recording.on_event(role, &event);
            if concerns(&event) {
                // Nobody listens any more when the recording ends.
                let _ = events.send((role, event));
            }
        });
        let (said, stops) = channel();
        orders.stop_boards(&links, move || {
            // Nobody listens any more when the recording ends.
            let _ = said.send(());
        });
        // A disk that hangs holds up the recording, and no Stop.
        recorder.open(Settings {
            mcap: self.file.clone(),
            csv: self.csv.clone(),
            force: self.force,
            part: Some(part).filter(|part| !part.is_zero()),
        })?;
        let started = Instant::now();
        let started_us = now_us();
        Session {
            recorder: &recorder,
            links: &links,
            told,
            stops,
            outcome: Outcome::new(roles.clone()),
            lines,
            stream: GaugeStream::new(!self.no_gauges),
            screen: Screen::new(self.quiet),
            started,
        }
        .run(&ended, self.until);
        let seconds = started.elapsed().as_secs_f64();
        // Which boards are there at the end, before this program itself closes the ways to them.
        let presence = *locked(&presence);
        // Closed links tell the recorder nothing more.
        drop(links);
        let progress = recorder.stop()?;
        let absent = presence.absent();
        let missing: Vec<(Role, f64)> = presence
            .missing()
            .map(|(role, heard_us)| (role, heard_us.saturating_sub(started_us) as f64 / 1e6))
            .collect();
        self.report(seconds, &progress, &absent, &missing)?;
        // With --for nobody watches: the status tells of a board that is not there at the end, whether it ever was or not.
        let is_missed = self.until.is_some() && presence.lacks(&roles);
        Ok(ExitCode::from(u8::from(is_missed)))
    }

    /// Tells what was recorded; `missing` are the boards that were not there at the end, and when each was heard last,
    /// in s since the start.
    fn report(
        &self,
        seconds: f64,
        progress: &Progress,
        absent: &[Role],
        missing: &[(Role, f64)],
    ) -> anyhow::Result<()> {
        let absent: Vec<&str> = absent.iter().map(|role| role.name()).collect();
        let tally = progress.tally;
        if self.json {
            let summary = json!({
                "seconds": seconds,
                "messages": tally.messages,
                "samples": tally.samples,
                "bytes": progress.safe_bytes,
                "lost": tally.lost,
                "gaps": tally.gaps,
                "unwritten": tally.unwritten,
                // The boards that were never there.
                "absent": absent,
                // Those that were there, and were not at the end.
                "missing_at_end": missing
                    .iter()
                    .map(|(role, heard_s)| json!({ "board": role.name(), "last_heard_s": heard_s }))
                    .collect::<Vec<_>>(),
            });
            return output::print(&summary.to_string());
        }
        let absent = match absent.as_slice() {
            [] => String::new(),
            names => format!("; never there: {}", names.join(", ")),
        };
        let gone: String = missing
            .iter()
            .map(|(role, heard_s)| {
                let name = role.name();
                format!("; not there at the end: {name}, last heard at {heard_s:.1} s")
            })
            .collect();
        output::print(&format!(
            "{seconds:.1} s: {} messages, {} samples of each gauge, {}{}{absent}{gone}",
            tally.messages,
            tally.samples,
            bytes(progress.safe_bytes),
            unheard(progress),
        ))
    }
}

/// Whether an event changes what is to be said, to a board or of it.
fn concerns(event: &Event) -> bool {
    !matches!(
        event,
        Event::Heard { message, .. }
            if !matches!(message, Message::Configuration(_) | Message::Stopped(_))
    )
}

/// A number of bytes in words.
fn bytes(count: u64) -> String {
    match count {
        0..1_000 => format!("{count} B"),
        1_000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", count as f64 / 1e6),
        _ => format!("{:.2} GB", count as f64 / 1e9),
    }
}

/// What was not heard or not written, in words; empty if all was.
fn unheard(progress: &Progress) -> String {
    let tally = progress.tally;
    let mut text = String::new();
    if tally.gaps > 0 {
        text += &format!("; {} not heard, in {} gaps", tally.lost, tally.gaps);
    }
    if tally.unwritten > 0 {
        text += &format!(
            "; {} heard but not written: the disk is too slow",
            tally.unwritten
        );
    }
    text
}

/// Which boards are there, as their links tell.
#[derive(Clone, Copy, Default)]
struct Presence {
    sensor: Sight,
    display: Sight,
}

/// What has been seen of one board.
#[derive(Clone, Copy, Default)]
struct Sight {
    is_there: bool,
    /// None before it is there for the first time; in µs of [`now_us`].
    heard_us: Option<u64>,
}

impl Presence {
    fn on_event(&mut self, role: Role, event: &Event) {
        let sight = match role {
            Role::Sensor => &mut self.sensor,
            Role::Display | Role::Host => &mut self.display,
        };
        match event {
            Event::StateChanged(state) => {
                sight.is_there = state.is_known();
                if sight.is_there {
                    sight.heard_us = Some(now_us());
                }
            }
            Event::Heard { at_us, .. } if sight.is_there => sight.heard_us = Some(*at_us),
            Event::Heard { .. } | Event::Restarted => {}
        }
    }

    fn sights(&self) -> [(Role, Sight); 2] {
        [(Role::Sensor, self.sensor), (Role::Display, self.display)]
    }

    /// Whether one of `roles` is not there, be it that it never came or that it went.
    fn lacks(&self, roles: &[Role]) -> bool {
        let mut sights = self.sights().into_iter();
        sights.any(|(role, sight)| !sight.is_there && roles.contains(&role))
    }

    /// The boards that have not been there yet.
    fn absent(&self) -> Vec<Role> {
        let sights = self.sights().into_iter();
        let absent = sights.filter(|(_, sight)| sight.heard_us.is_none());
        absent.map(|(role, _)| role).collect()
    }

    /// The boards that were there and are not any more, and when each was heard last, in µs of [`now_us`].
    fn missing(&self) -> impl Iterator<Item = (Role, u64)> {
        let gone = self.sights().into_iter();
        let gone = gone.filter(|(_, sight)| !sight.is_there);
        gone.filter_map(|(role, sight)| Some((role, sight.heard_us?)))
    }
}

/// A recording while it goes on.
struct Session<'a> {
    recorder: &'a Recorder,
    links: &'a [(Role, Link)],
    told: Receiver<(Role, Event)>,
    /// That a Stop is being said.
    stops: Receiver<()>,
    outcome: Outcome,
    /// The boards' logs.
    lines: Receiver<(Role, LogEvent)>,
    stream: GaugeStream,
    screen: Screen,
    started: Instant,
}

impl Session<'_> {
    /// Records until it is asked to end, or can't go on.
    fn run(mut self, ended: &AtomicBool, until: Option<Duration>) {
        for role in BOARDS {
            if self.link(role).is_none() {
                let name = role.name();
                self.screen.tell(&format!(
                    "{name}: absent: only the other board is named; name it with --{name} or in the bench file"
                ));
            }
        }
        self.record(ended, until);
    }

    fn record(&mut self, ended: &AtomicBool, until: Option<Duration>) {
        let mut due = self.started + TOLD;
        loop {
            let past = until.is_some_and(|until| self.started.elapsed() >= until);
            if self.recorder.progress().failed {
                // What is safe: there will be no summary.
                return self.count();
            }
            self.note_stops();
            // What becomes of a Stop is told first.
            if (ended.load(Ordering::Relaxed) || past) && self.outcome.until().is_none() {
                return;
            }
            let left = until.map_or(LOOK, |until| until.saturating_sub(self.started.elapsed()));
            self.listen(if past { LOOK } else { LOOK.min(left) });
            if Instant::now() >= due {
                due += TOLD;
                self.count();
            }
        }
    }

    /// Hears what the links tell for as long as `wait`, and says what is due.
    fn listen(&mut self, wait: Duration) {
        let heard = self.told.recv_timeout(wait);
        // Before the answers to it.
        self.note_stops();
        match heard {
            Ok((role, event)) => {
                self.stream.on_event(role, &event);
                if let Event::StateChanged(state) = &event {
                    self.on_state(role, state);
                }
                if let Some(words) = self.outcome.hear(role, &event) {
                    self.screen.tell(&words);
                }
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
        }
        for (role, what) in self.lines.try_iter() {
            if let Some((level, text)) = what.line() {
                self.recorder.on_log(role, level, text);
            }
            if !matches!(what, LogEvent::Log { .. }) {
                self.screen.tell(&format!("{}: {what}", role.name()));
            }
        }
        if let Some(words) = self.outcome.overdue() {
            self.screen.tell(&words);
        }
        while let Some((role, message)) = self.stream.due(now_us()) {
            // Asked again if it is not answered.
            self.post(role, &message);
        }
    }

    /// Gives boards that have been told to stop their time to answer.
    fn note_stops(&mut self) {
        if self.stops.try_iter().count() > 0 {
            self.outcome.begin();
        }
    }

    /// Tells how the way to a board stands now.
    fn on_state(&mut self, role: Role, state: &State) {
        if !matches!(state, State::Opened { .. }) {
            self.screen
                .tell(&format!("{}: {}", role.name(), Advised(state)));
        }
    }

    fn link(&self, role: Role) -> Option<&Link> {
        let mut links = self.links.iter();
        links.find(|(of, _)| *of == role).map(|(_, link)| link)
    }

    /// Says something to a board; whether it is on its way.
    fn post(&self, role: Role, message: &Message) -> bool {
        self.link(role)
            .is_some_and(|link| link.post(message).is_ok())
    }

    /// Records the links' counters and tells the progress.
    fn count(&mut self) {
        let mut lost = 0_u32;
        for (role, link) in self.links {
            let counters = link.counters();
            self.recorder.on_counters(*role, counters);
            lost = lost.wrapping_add(counters.lost);
        }
        let progress = self.recorder.progress();
        let frames = match lost {
            0 => String::new(),
            lost => format!("; {lost} frames lost on the lines"),
        };
        self.screen.progress(&format!(
            "{:.0} s: {} messages, {} samples, {} safe{frames}{}",
            self.started.elapsed().as_secs_f64(),
            progress.tally.messages,
            progress.tally.samples,
            bytes(progress.safe_bytes),
            unheard(&progress),
        ));
    }
}

/// Standard error: a progress line that is written over in a terminal, and lines of their own. A thread of its own
/// writes them: who stops the terminal stops no recording, and misses what does not fit.
struct Screen {
    quiet: bool,
    terminal: bool,
    /// Whether a progress line stands there.
    dirty: bool,
    /// None once it is to end.
    lines: Option<SyncSender<String>>,
    /// Closed when all has been written.
    written: Receiver<()>,
}

impl Screen {
    fn new(quiet: bool) -> Self {
        let (lines, due) = sync_channel::<String>(WAITING_LINES);
        let (writing, written) = channel::<()>();
        thread::spawn(move || {
            let _writing = writing;
            for text in due {
                let mut out = io::stderr();
                // Nobody may be there to read it.
                let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
            }
        });
        Self {
            quiet,
            terminal: io::stderr().is_terminal(),
            dirty: false,
            lines: Some(lines),
            written,
        }
    }

    fn write(&self, text: String) {
        if let Some(lines) = &self.lines {
            let _ = lines.try_send(text);
        }
    }

    /// A line of its own.
    fn tell(&mut self, line: &str) {
        let clear = if self.dirty { "\r\x1b[K" } else { "" };
        self.dirty = false;
        self.write(format!("{clear}{line}\n"));
    }

    /// How far it has come.
    fn progress(&mut self, line: &str) {
        if self.quiet {
            return;
        }
        self.dirty = self.terminal;
        self.write(if self.terminal {
            format!("\r\x1b[K{line}")
        } else {
            format!("{line}\n")
        });
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        if self.dirty {
            self.write("\n".to_owned());
        }
        self.lines = None;
        let _ = self.written.recv_timeout(LINGER);
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use protocol::{Hello, Ping};

    use super::*;

    #[test]
    fn a_board_that_went_is_missing_until_it_returns_and_one_that_never_came_is_absent() {
        let port = PathBuf::from("/dev/null/s");
        let known = State::Known(port.clone(), Hello::new(Role::Sensor, "chip", [0, 1, 0]));
        let mut presence = Presence::default();
        let mut turn = |state: &State| {
            presence.on_event(Role::Sensor, &Event::StateChanged(state.clone()));
            presence.on_event(
                Role::Sensor,
                &Event::Heard {
                    at_us: 7,
                    message: Message::Ping(Ping { sent_us: 0 }),
                },
            );
            (presence.absent(), presence.missing().collect::<Vec<_>>())
        };
        let [neither, display] = [BOARDS.to_vec(), vec![Role::Display]];
        assert_eq!(turn(&State::Opened(port.clone())), (neither, vec![]));
        assert_eq!(turn(&known), (display.clone(), vec![]));
        let gone = vec![(Role::Sensor, 7)];
        assert_eq!(turn(&State::Silent(port)), (display.clone(), gone));
        assert_eq!(turn(&known), (display, vec![]));
    }

    #[test]
    fn a_bench_lacks_the_boards_it_names_that_never_came_or_went() {
        let port = PathBuf::from("/dev/null/s");
        let known = State::Known(port.clone(), Hello::new(Role::Sensor, "chip", [0, 1, 0]));
        let mut presence = Presence::default();
        // Of a bench of the sensor alone, and of one of both boards.
        let mut lacks = |state: State| {
            presence.on_event(Role::Sensor, &Event::StateChanged(state));
            [presence.lacks(&[Role::Sensor]), presence.lacks(&BOARDS)]
        };
        assert_eq!(lacks(State::Opened(port.clone())), [true, true]);
        assert_eq!(lacks(known.clone()), [false, true]);
        assert_eq!(lacks(State::Silent(port)), [true, true]);
        assert_eq!(lacks(known), [false, true]);
        let there = State::Known(
            "/dev/null/d".into(),
            Hello::new(Role::Display, "chip", [0, 1, 0]),
        );
        presence.on_event(Role::Display, &Event::StateChanged(there));
        assert!(!presence.lacks(&BOARDS));
    }
}
