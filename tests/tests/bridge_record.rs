//! `host-bridge record`: everything that the boards say is in the file, and what was said to be safe stays
//! so, whatever happens to the program, the disk and the boards.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::recording::Entry;
use host_bridge::recording::reader::Reader;
use host_bridge::recording::row::{LinkEvent, LinkRow, Lost, Row};
use host_bridge::replay::{Pace, play};
use protocol::{
    Configuration, ConfigurationReport, DisplayConfiguration, GAUGE_BLOCK, Hello, Message, Ping,
    Refusal, Role, SensorConfiguration, Setting,
};
use std::sync::atomic::AtomicBool;
use tests::bridge::{self, Ended, Running};
use tests::fake_board::{FakeBoard, wait_until};
use tests::utterance::Speaker;

/// Far more than anything here takes.
const LIMIT: Duration = Duration::from_secs(30);

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bridge_record")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

/// Two boards that lose nothing, and what they have heard.
struct Pair {
    sensor: FakeBoard,
    display: FakeBoard,
    pings: u64,
}

impl Pair {
    fn new() -> Self {
        let board = |role| {
            let board = FakeBoard::new(role);
            board.lose_nothing();
            board
        };
        Self {
            sensor: board(Role::Sensor),
            display: board(Role::Display),
            pings: 0,
        }
    }

    fn board(&self, role: Role) -> &FakeBoard {
        match role {
            Role::Display => &self.display,
            Role::Sensor | Role::Host => &self.sensor,
        }
    }

    /// Starts the program on these boards; `words` are the rest of its command line.
    fn record(&self, command: &mut Command, words: &[&str]) -> Running {
        command.arg("record").args(words);
        command.arg("--sensor").arg(self.sensor.path());
        command.arg("--display").arg(self.display.path());
        Running::start(command)
    }

    /// Waits until both boards have been asked for their configuration: they are known.
    fn wait_for_questions(&self) {
        for role in [Role::Sensor, Role::Display] {
            let board = self.board(role);
            let asked = || {
                let heard = board.take_heard();
                heard
                    .iter()
                    .any(|message| matches!(message, Message::Configure(_)))
            };
            assert!(wait_until(LIMIT, asked), "the {} is not asked", role.name());
        }
    }

    /// Waits until the program has heard everything that was said: it answers in order.
    fn wait_until_heard(&mut self) {
        for role in [Role::Sensor, Role::Display] {
            self.pings += 1;
            let sent_us = self.pings;
            let board = self.board(role);
            board.say(Message::Ping(Ping { sent_us }));
            let answered = || {
                board.take_heard().iter().any(
                    |message| matches!(message, Message::Pong(pong) if pong.sent_us == sent_us),
                )
            };
            assert!(
                wait_until(LIMIT, answered),
                "the {} is not answered",
                role.name()
            );
        }
    }
}

fn signal(running: &Running, name: &str) {
    let sent = Command::new("kill")
        .args([name, &running.child.id().to_string()])
        .status();
    assert!(
        sent.is_ok_and(|status| status.success()),
        "{name} can be sent"
    );
}

/// Everything in a file, and whether it was cut off.
fn entries(path: &Path) -> (Vec<Entry>, bool) {
    let mut reader = Reader::open(path).unwrap_or_else(|error| panic!("{error}"));
    let mut entries = Vec::new();
    while let Some(entry) = reader
        .next_entry()
        .unwrap_or_else(|error| panic!("{error}"))
    {
        entries.push(entry);
    }
    (entries, reader.is_cut())
}

/// The messages in a file, without the answers to the program's own pings.
fn messages(path: &Path) -> Vec<(Role, Message)> {
    let mut messages = Vec::new();
    let recording = Reader::open(path).unwrap_or_else(|error| panic!("{error}"));
    let pace = Pace {
        speed: 100.0,
        ..Pace::default()
    };
    play(recording, &pace, &AtomicBool::new(false), |role, event| {
        if let host_bridge::link::Event::Heard { message, .. } = event {
            messages.push((role, message));
        }
    })
    .unwrap_or_else(|error| panic!("{error}"));
    messages.retain(|(_, message)| !matches!(message, Message::Pong(_)));
    messages
}

fn of(role: Role, messages: &[(Role, Message)]) -> Vec<&Message> {
    let of = messages.iter().filter(|(said, _)| *said == role);
    of.map(|(_, message)| message).collect()
}

/// The number in front of a word of the last line that has it.
fn number_before(text: &str, word: &str) -> u64 {
    let line = text
        .lines()
        .rev()
        .find(|line| line.contains(word))
        .unwrap_or_else(|| panic!("no {word:?} in {text:?}"));
    let before = line.split(word).next().unwrap_or_default().trim_end();
    let digits = before.rsplit([' ', ',', ';']).next().unwrap_or_default();
    digits
        .parse()
        .unwrap_or_else(|_| panic!("no number before {word:?} in {line:?}"))
}

fn succeeded(ended: &Ended) {
    assert_eq!(
        ended.status.code(),
        Some(0),
        "{}{}",
        ended.stdout,
        ended.stderr
    );
}

/// Says the same to both, for `turns`, without what the program answers by itself.
fn talk(pair: &Pair, turns: u32) -> Vec<(Role, Message)> {
    let mut said = Vec::new();
    let mut speakers = [
        (Role::Sensor, Speaker::new(1)),
        (Role::Display, Speaker::new(2)),
    ];
    for turn in 0..turns {
        for (role, speaker) in &mut speakers {
            let message = match (turn % 5, *role) {
                (0, Role::Sensor) => speaker.gauges(turn / 5 * GAUGE_BLOCK as u32),
                (3, _) if turn % 50 == 3 => speaker.oddity(),
                (_, role) => speaker.message(role),
            };
            if !matches!(message, Message::Pong(_)) {
                pair.board(*role).say(message.clone());
                said.push((*role, message));
            }
        }
    }
    said
}

#[test]
fn everything_that_is_said_is_in_the_file_once_and_in_order() {
    let folder = folder("everything");
    let path = folder.join("everything.mcap");
    let csv = folder.join("tables");
    let mut pair = Pair::new();
    let words = [
        path.to_str().expect("UTF-8"),
        "--csv",
        csv.to_str().expect("UTF-8"),
        "--no-gauges",
        "--json",
    ];
    let running = pair.record(&mut bridge::command(), &words);
    pair.wait_for_questions();
    let said = talk(&pair, 5_000);
    pair.wait_until_heard();
    signal(&running, "-INT");
    let ended = running.wait(LIMIT);
    succeeded(&ended);

    let (_, is_cut) = entries(&path);
    assert!(!is_cut);
    let read = messages(&path);
    for role in [Role::Sensor, Role::Display] {
        let (read, said) = (of(role, &read), of(role, &said));
        for (at, (read, said)) in read.iter().zip(&said).enumerate() {
            assert_eq!(read, said, "the {}'s {at}", role.name());
        }
        assert_eq!(read.len(), said.len(), "the {}'s", role.name());
    }
    let summary: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!(summary["samples"], 8_000, "{summary}");
    assert_eq!(summary["unwritten"], 0, "{summary}");
    let lines = |name: &str| {
        let text = fs::read_to_string(csv.join(name)).expect("the table can be read");
        text.lines().count() - 1
    };
    assert_eq!(lines("sensor-gauges.csv"), 8_000);
    let motions = said
        .iter()
        .filter(|(_, message)| matches!(message, Message::Motion(_)));
    assert_eq!(lines("display-motion.csv"), motions.count());
}

/// Answers as a board does that has this configuration; returns the one that is then in force.
fn configure(
    board: &FakeBoard,
    role: Role,
    in_force: Configuration,
    asked: &Configuration,
) -> Configuration {
    let own = matches!(
        (role, asked),
        (Role::Sensor, Configuration::Sensor(_)) | (Role::Display, Configuration::Display(_))
    );
    let refused = (!own).then_some(Refusal {
        setting: Setting::Role,
        index: 0,
        low: 0,
        high: 0,
    });
    let configuration = if own { *asked } else { in_force };
    board.say(Message::Configuration(ConfigurationReport {
        refused,
        hash: configuration.hash(),
        configuration,
    }));
    configuration
}

#[test]
fn gauges_are_streamed_while_they_are_recorded_and_nothing_else_is_changed() {
    let path = folder("gauges").join("gauges.mcap");
    let pair = Pair::new();
    let running = pair.record(&mut bridge::command(), &[path.to_str().expect("UTF-8")]);
    let before = SensorConfiguration {
        window_ms: 123,
        bank_travel_percent: 77,
        ..SensorConfiguration::DEFAULT
    };
    let streaming = SensorConfiguration {
        stream_gauges: true,
        ..before
    };
    let mut in_force = Configuration::Sensor(before);
    let mut display = Configuration::Display(DisplayConfiguration::DEFAULT);
    let mut asked = Vec::new();
    let mut hear = |wanted: SensorConfiguration| {
        wait_until(LIMIT, || {
            for (role, own) in [(Role::Sensor, &mut in_force), (Role::Display, &mut display)] {
                for message in pair.board(role).take_heard() {
                    if let Message::Configure(configuration) = message {
                        *own = configure(pair.board(role), role, *own, &configuration);
                        asked.push((role, configuration));
                    }
                }
            }
            in_force == Configuration::Sensor(wanted)
        })
    };
    assert!(hear(streaming), "the gauges are not asked for");
    signal(&running, "-TERM");
    assert!(hear(before), "the board is not as it was");
    succeeded(&running.wait(LIMIT));
    assert_eq!(
        display,
        Configuration::Display(DisplayConfiguration::DEFAULT)
    );
    // Each board was asked with what is for the other; the sensor was set twice.
    let set = asked
        .iter()
        .filter(|asked| matches!(asked, (Role::Sensor, Configuration::Sensor(_))));
    assert_eq!(set.count(), 2, "{asked:?}");
    let (entries, _) = entries(&path);
    let reported = |wanted: SensorConfiguration| {
        entries.iter().any(
            |entry| matches!(&entry.row, Row::SensorConfiguration(row) if row.in_force == wanted),
        )
    };
    assert!(reported(before) && reported(streaming));
    assert!(
        entries
            .iter()
            .any(|entry| matches!(entry.row, Row::DisplayConfiguration(_)))
    );
}

#[test]
fn a_program_that_is_killed_leaves_what_it_said_is_safe() {
    let path = folder("killed").join("killed.mcap");
    let pair = Pair::new();
    let running = pair.record(
        &mut bridge::command(),
        &[path.to_str().expect("UTF-8"), "--no-gauges"],
    );
    pair.wait_for_questions();
    // Until some seconds of it are safe: the file grows with each.
    let end = Instant::now() + LIMIT;
    let (mut sizes, mut last) = (0, 0);
    let mut speaker = Speaker::new(8);
    let mut said = Vec::new();
    while sizes < 3 {
        assert!(Instant::now() < end, "the file does not grow");
        let motion = speaker.motion();
        pair.display.say(motion.clone());
        said.push(motion);
        thread::park_timeout(Duration::from_millis(1));
        let size = fs::metadata(&path).map_or(0, |facts| facts.len());
        sizes += u32::from(size > last && last > 0);
        last = size;
    }
    signal(&running, "-KILL");
    let ended = running.wait(LIMIT);
    assert_eq!(ended.status.code(), None);
    let safe = number_before(&ended.stderr, "messages");
    let (read, is_cut) = entries(&path);
    assert!(is_cut);
    let motions: Vec<Message> = read
        .iter()
        .filter_map(|entry| match entry.row {
            Row::Motion(motion) => Some(Message::Motion(motion)),
            _ => None,
        })
        .collect();
    // Answers to its own pings are counted, too.
    let pongs = read
        .iter()
        .filter(|entry| matches!(entry.row, Row::Clock(_)))
        .count();
    assert!(
        (motions.len() + pongs) as u64 >= safe,
        "{} of {safe}",
        motions.len()
    );
    assert!(motions.len() > 100 && said.starts_with(&motions));
}

#[test]
fn a_disk_that_is_full_is_named_and_what_was_safe_stays_readable() {
    let path = folder("full").join("full.mcap");
    let pair = Pair::new();
    // The shell's blocks are of 512 or 1024 bytes. A limit does what a full disk does, without one.
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "trap '' XFSZ; ulimit -f 2000; exec \"$0\" \"$@\""])
        .arg(bridge::path())
        .env_remove("RIDGELINK_BENCH")
        .env_remove("HOME")
        .env_remove("XDG_CONFIG_HOME")
        .stdin(std::process::Stdio::null())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped());
    let mut running = pair.record(
        &mut limited,
        &[path.to_str().expect("UTF-8"), "--no-gauges"],
    );
    pair.wait_for_questions();
    let mut speaker = Speaker::new(11);
    let mut first = 0;
    let ended = wait_until(LIMIT, || {
        // Some 700 kB a second.
        pair.sensor.say(speaker.gauges(first));
        first += GAUGE_BLOCK as u32;
        running
            .child
            .try_wait()
            .expect("a child can be waited for")
            .is_some()
    });
    assert!(ended, "it goes on");
    let ended = running.wait(LIMIT);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    let want = format!(
        "{}: can't be written any further: File too large",
        path.display()
    );
    assert!(ended.stderr.contains(&want), "{}", ended.stderr);
    let (read, is_cut) = entries(&path);
    assert!(is_cut);
    let samples: Vec<u32> = read
        .iter()
        .filter_map(|entry| match entry.row {
            Row::Gauges(row) => Some(row.sample),
            _ => None,
        })
        .collect();
    assert!(samples.iter().copied().eq(0..samples.len() as u32));
    let safe = number_before(&ended.stderr, "samples,");
    assert!(
        samples.len() as u64 >= safe && safe > 0,
        "{} of {safe}",
        samples.len()
    );
    // What is safe is all that is there: the file ends with a whole chunk.
    let bytes = number_before(&ended.stderr, "bytes of it are safe");
    assert_eq!(fs::metadata(&path).expect("it is there").len(), bytes);
}

#[test]
fn places_that_take_no_file_are_named_with_the_reason() {
    let folder = folder("places");
    let file = folder.join("file");
    fs::write(&file, "").expect("the file can be written");
    let within = file.join("x.mcap");
    let absent = folder.join("absent").join("x.mcap");
    let boards = ["--sensor", "/dev/null/s", "--display", "/dev/null/d"];
    for (words, want) in [
        (vec!["/proc/x.mcap"], "/proc/x.mcap: can't be made: "),
        (vec!["/sys/x.mcap"], "/sys/x.mcap: can't be made: "),
        (
            vec![within.to_str().expect("UTF-8")],
            "x.mcap: can't be made: Not a directory",
        ),
        (
            vec![absent.to_str().expect("UTF-8")],
            "x.mcap: can't be made: No such file or directory",
        ),
        (
            vec![file.to_str().expect("UTF-8")],
            "file: is there already: give another name, or --force",
        ),
        (vec!["--csv", "/proc/x"], "/proc/x: can't be made: "),
        (
            vec!["/dev/full", "--force"],
            "/dev/full: can't be written any further: No space left",
        ),
    ] {
        let ended = bridge::run(
            ["record"]
                .into_iter()
                .chain(words.iter().copied())
                .chain(boards),
            LIMIT,
        );
        assert_eq!(ended.status.code(), Some(2), "{words:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(want), "{words:?}: {}", ended.stderr);
    }
    assert_eq!(fs::read(&file).expect("still there"), b"");
}

#[test]
fn a_file_that_is_removed_ends_the_recording() {
    let folder = folder("removed").join("gone");
    fs::create_dir(&folder).expect("a folder can be made");
    let path = folder.join("gone.mcap");
    let pair = Pair::new();
    let running = pair.record(
        &mut bridge::command(),
        &[path.to_str().expect("UTF-8"), "--no-gauges"],
    );
    pair.wait_for_questions();
    fs::remove_dir_all(&folder).expect("it can be removed");
    let ended = running.wait(LIMIT);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    let want = format!("{}: was removed while it was being written", path.display());
    assert!(ended.stderr.contains(&want), "{}", ended.stderr);
}

#[test]
fn a_board_that_goes_and_returns_is_recorded_on_and_the_gap_is_written_down() {
    let folder = folder("returns");
    let path = folder.join("returns.mcap");
    let name = folder.join("ttySensor");
    let sensor = || {
        let board = FakeBoard::new(Role::Sensor);
        board.lose_nothing();
        symlink(board.path(), &name).expect("a link can be made");
        board
    };
    let asked = |board: &FakeBoard| {
        wait_until(LIMIT, || {
            let heard = board.take_heard();
            heard
                .iter()
                .any(|message| matches!(message, Message::Configure(_)))
        })
    };
    let board = sensor();
    let running = Running::start(
        bridge::command()
            .args(["record", "--no-gauges"])
            .arg(&path)
            .args(["--display", "/dev/null/d", "--sensor"])
            .arg(&name),
    );
    assert!(asked(&board));
    let mut speaker = Speaker::new(12);
    board.say(speaker.gauges(0));
    board.say(speaker.gauges(8));
    let mut pair = Pair {
        sensor: board,
        ..Pair::new()
    };
    let answered = |board: &FakeBoard, sent_us| {
        board.say(Message::Ping(Ping { sent_us }));
        wait_until(LIMIT, || {
            board
                .take_heard()
                .iter()
                .any(|message| matches!(message, Message::Pong(pong) if pong.sent_us == sent_us))
        })
    };
    assert!(answered(&pair.sensor, 1));
    fs::remove_file(&name).expect("the link can be removed");
    pair.sensor = FakeBoard::saying(Hello::new(Role::Sensor, "unplugged", [0, 0, 0]));
    let board = sensor();
    assert!(asked(&board));
    board.say(speaker.gauges(1_016));
    assert!(answered(&board, 2));
    signal(&running, "-INT");
    succeeded(&running.wait(LIMIT));
    let (entries, _) = entries(&path);
    let links: Vec<&LinkRow> = entries
        .iter()
        .filter(|entry| entry.role == Role::Sensor)
        .filter_map(|entry| match &entry.row {
            Row::Link(link) => Some(link),
            _ => None,
        })
        .collect();
    let words: Vec<&str> = links
        .iter()
        .filter_map(|link| link.state.as_ref())
        .map(|word| word.0.as_str())
        .filter(|word| matches!(*word, "known" | "absent"))
        .collect();
    assert!(words.ends_with(&["known", "absent", "known"]), "{words:?}");
    let gap = links.iter().find(|link| link.event == LinkEvent::Gap);
    let gap = gap.expect("the gap is written down");
    assert_eq!((gap.lost, gap.missing), (Some(Lost::Samples), Some(1_000)));
}

#[test]
fn a_recording_ends_by_itself_when_it_is_told_to() {
    let path = folder("for").join("for.mcap");
    let started = Instant::now();
    let ended = bridge::run(
        [
            "record",
            path.to_str().expect("UTF-8"),
            "--for",
            "0.3",
            "--sensor",
            "/dev/null/s",
            "--display",
            "/dev/null/d",
        ],
        LIMIT,
    );
    succeeded(&ended);
    assert!(started.elapsed() >= Duration::from_millis(300));
    let (entries, is_cut) = entries(&path);
    // Both are absent, and nothing was said.
    assert_eq!((entries.len(), is_cut), (2, false));
}
