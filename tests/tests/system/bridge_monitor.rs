//! `host-bridge monitor`: lines that are right, states that are named, and a terminal that is left as it
//! was found.

mod recorded;

use std::fs::{self, DirBuilder, File};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, symlink};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use protocol::{DisplayState, Hello, Hold, Message, Role, Stop, StopReason};
use rustix::fs::{CWD, FileType, Mode, major, minor, mknodat};
use rustix::process::{Pid, WaitOptions, waitpid};
use tests::bridge;
use tests::fake_bench::{FakeBench, Running};
use tests::fake_board::{FakeBoard, wait_until};
use tests::relay::free_port;
use tests::terminal::Terminal;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

fn bench() -> Running {
    Running::new(FakeBench::new())
}

/// `host-bridge monitor` at the ports of a bench.
fn monitor(running: &Running) -> Command {
    let bench = running.bench();
    monitor_at(bench.sensor.path(), bench.display.path())
}

fn monitor_at(sensor: &Path, display: &Path) -> Command {
    let mut command = bridge::command();
    command
        .arg("monitor")
        .arg("--sensor")
        .arg(sensor)
        .arg("--display")
        .arg(display);
    command
}

/// Lines of a fifth of a second in which both boards have long answered.
const SOON_KNOWN: usize = 1_500;

/// A program that is read line by line.
struct Lines {
    child: Child,
    lines: Receiver<String>,
}

impl Lines {
    fn of(command: &mut Command) -> Self {
        let mut child = command.spawn().expect("the program can be started");
        let stdout = child.stdout.take().expect("it is piped");
        let (sender, lines) = channel();
        thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Self { child, lines }
    }

    /// The next line with these words.
    fn with(&self, words: &str) -> String {
        let [line] = self.with_each([words]);
        line
    }

    /// For each of these words the first line from now on that has them, in whatever order.
    fn with_each<const COUNT: usize>(&self, words: [&str; COUNT]) -> [String; COUNT] {
        let mut found: [Option<String>; COUNT] = std::array::from_fn(|_| None);
        let mut seen = String::new();
        let end = Instant::now() + LIMIT;
        while found.iter().any(Option::is_none) {
            let left = end.saturating_duration_since(Instant::now());
            let Ok(line) = self.lines.recv_timeout(left) else {
                panic!("no line with each of {words:?} after\n{seen}");
            };
            for (found, words) in found.iter_mut().zip(words) {
                if found.is_none() && line.contains(words) {
                    *found = Some(line.clone());
                }
            }
            seen += &format!("{line}\n");
        }
        found.map(Option::unwrap_or_default)
    }

    fn signal(&self, name: &str) {
        signal(&self.child, name);
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill")
        .arg(format!("-{name}"))
        .arg(child.id().to_string())
        .status()
        .expect("kill can be run");
    assert!(status.success());
    if name == "STOP" {
        // On a busy computer a program goes on for a while after it was sent.
        let stopped = waitpid(Some(Pid::from_child(child)), WaitOptions::UNTRACED);
        assert!(stopped.is_ok_and(|of| of.is_some_and(|(_, status)| status.stopped())));
    }
}

/// A name in a folder of its own, free to be linked to a board's port.
fn name_of_a_port(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bridge_monitor")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder.join("ttyBoard")
}

#[test]
fn a_line_a_second_tells_what_both_boards_say_in_columns() {
    let running = bench();
    let lines = Lines::of(monitor(&running).arg("--plain").args(["--every", "0.2"]));
    let heading = lines.with("lambda_mm");
    let names: Vec<&str> = heading.trim_start_matches('#').split_whitespace().collect();
    lines.with("display safety: driving");
    let column = |name: &str| {
        let column = names.iter().position(|each| *each == name);
        column.unwrap_or_else(|| panic!("no column {name}"))
    };
    let trips = ["rtt_s_ms", "rtt_d_ms"].map(column);
    // The surface is told of while the hand is fast enough, a round trip once a ping has been answered.
    let line = std::iter::repeat_with(|| lines.with(" valid "))
        .take(SOON_KNOWN)
        .find(|line| {
            let cells: Vec<&str> = line.split_whitespace().collect();
            trips.iter().all(|&trip| cells[trip] != "-")
        })
        .expect("each board answers a ping");
    let cells: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(names.len(), cells.len(), "{heading}\n{line}");
    let cell = |name: &str| cells[column(name)];
    let number = |name: &str| -> f64 { cell(name).parse().expect("a number") };
    assert_eq!((cell("sensor"), cell("display")), ("known", "known"));
    assert!((number("lambda_mm") - 2.0).abs() < 0.01, "{line}");
    assert_eq!(cell("conf"), "0.97");
    assert_eq!((cell("range"), cell("contact")), ("T1", "slip"));
    let hand_mm_s = number("hand_mm_s").abs();
    assert!(hand_mm_s < 70.1, "{line}");
    assert_eq!((cell("lost"), cell("bad")), ("0", "0"));
    assert!(
        number("rtt_s_ms") >= 0.0 && number("rtt_d_ms") >= 0.0,
        "{line}"
    );
    assert_eq!(cell("supervisor"), "driving");
}

#[test]
fn json_lines_hold_the_same_with_every_ports_counters() {
    let running = bench();
    let lines = Lines::of(monitor(&running).arg("--json").args(["--every", "0.2"]));
    let safety = lines.with("\"kind\":\"safety\"");
    assert!(safety.contains("\"state\":\"driving\""), "{safety}");
    let line = lines.with("\"kind\":\"second\"");
    for words in [
        "\"state\":\"known\"",
        "\"wavelength_mm\":",
        "\"round_trip_ms\":",
        "\"port\":\"sensor peer\"",
        "\"sent\":4711",
        "\"gauges\":[\"good\",\"good\",\"good\",\"good\",\"hum\"]",
    ] {
        assert!(line.contains(words), "{words} is not in {line}");
    }
}

#[test]
fn a_change_of_the_supervisor_is_a_line_at_once() {
    let running = bench();
    // No other line within the test's time.
    let lines = Lines::of(monitor(&running).arg("--plain").args(["--every", "600"]));
    lines.with("display safety: driving");
    running.bench().turn(DisplayState::Fading(Hold::Stale));
    lines.with("display safety: fading: no fresh estimate");
    running.bench().turn(DisplayState::Ready);
    lines.with("display safety: ready");
}

#[test]
fn what_is_wrong_with_a_port_is_named_with_advice() {
    let absent = name_of_a_port("named");
    let foreign = FakeBoard::saying(Hello {
        protocol: [99, 0],
        ..Hello::new(Role::Display, "stm32f429zi", [9, 9, 9])
    });
    let lines = Lines::of(monitor_at(&absent, foreign.path()).arg("--plain"));
    let [line, other] = lines.with_each(["display foreign: ", "sensor absent: "]);
    assert!(other.contains("not there: plug the board in"), "{other}");
    assert!(
        line.contains("of protocol 99") && line.contains("host-bridge flash"),
        "{line}"
    );
    drop(lines);
    let noise = FakeBoard::new(Role::Sensor);
    noise.mute(true);
    let lines = Lines::of(monitor_at(noise.path(), &absent).arg("--plain"));
    let is_named = wait_until(LIMIT, || {
        noise.send_bytes(&[0x81, 0xfe, 0x93, 0xd0, 0xe5, 0xc7, 0x88, 0x9a]);
        lines
            .lines
            .try_iter()
            .any(|line| line.contains("sensor garbage: "))
    });
    assert!(is_named);
}

#[test]
fn a_second_monitor_sees_the_same_and_goes_on_when_the_first_one_ends() {
    let running = bench();
    let first = Lines::of(monitor(&running).arg("--plain"));
    first.with("display safety: driving");
    let second = Lines::of(monitor(&running).arg("--plain"));
    second.with(" known      known ");
    // The first one is not disturbed.
    first.with(" known      known ");
    drop(first);
    for _ in 0..3 {
        second.with(" known      known ");
    }
}

/// One that is not merely halted, as under a debugger: it has the port's lock, and shares nothing.
#[test]
fn a_program_that_has_a_port_and_does_not_answer_is_named_with_what_to_do() {
    let board = FakeBoard::new(Role::Sensor);
    let absent = name_of_a_port("stands-still");
    let run = name_of_a_port("stands-still-run");
    let folder = run.join("ridgelink");
    let mut ours = DirBuilder::new();
    ours.recursive(true).mode(0o700);
    ours.create(&folder).expect("a folder can be made");
    let number = fs::metadata(board.path()).expect("a terminal").rdev();
    let lock = format!("port-{}-{}.lock", major(number), minor(number));
    let mut owner = File::create(folder.join(lock)).expect("a file can be made");
    owner.lock().expect("nobody else has it");
    let words = "host-bridge monitor (process 1)";
    owner.write_all(words.as_bytes()).expect("there is room");
    // Sooner than it is known who has it.
    let mut command = bridge::command();
    command.env("XDG_RUNTIME_DIR", &run);
    command.args(["stop", "--within", "1", "--sensor"]);
    let stop = bridge::Running::start(command.arg(board.path())).wait(LIMIT);
    assert_eq!(stop.status.code(), Some(1), "{}", stop.stderr);
    let what = "NOT STOPPED as far as is known: sensor: its port is not open yet";
    assert!(stop.stderr.contains(what), "{}", stop.stderr);
    let mut monitor = monitor_at(board.path(), &absent);
    monitor.env("XDG_RUNTIME_DIR", &run);
    let guest = Lines::of(monitor.arg("--plain"));
    let line = guest.with("sensor busy: ");
    let what = format!("{words} has it and does not answer: let that process go on");
    assert!(line.contains(&what), "{line}");
    drop(owner);
    guest.with("sensor known: ");
}

#[test]
fn a_cable_that_is_put_back_is_seen() {
    let name = name_of_a_port("cable");
    let absent = name.with_extension("absent");
    let board = FakeBoard::new(Role::Display);
    symlink(board.path(), &name).expect("a link can be made");
    let lines = Lines::of(
        monitor_at(&absent, &name)
            .arg("--plain")
            .args(["--every", "600"]),
    );
    lines.with("display known: ");
    let _ = fs::remove_file(&name);
    drop(board);
    lines.with("display absent: ");
    let board = FakeBoard::new(Role::Display);
    symlink(board.path(), &name).expect("a link can be made");
    lines.with("display known: ");
}

#[test]
fn signals_and_its_own_end_are_a_success_without_a_word() {
    let running = bench();
    for name in ["INT", "TERM", "HUP", "QUIT"] {
        let mut lines = Lines::of(monitor(&running).arg("--plain"));
        lines.with("display safety: driving");
        lines.signal(name);
        let status = ended(&mut lines.child);
        assert_eq!((status.code(), status.signal()), (Some(0), None), "{name}");
    }
    let ended =
        bridge::Running::start(monitor(&running).args(["--plain", "--for", "0.3"])).wait(LIMIT);
    assert!(
        ended.status.success() && ended.stderr.is_empty(),
        "{ended:?}"
    );
}

fn ended(child: &mut Child) -> std::process::ExitStatus {
    let mut status = None;
    let has_ended = wait_until(LIMIT, || {
        status = child.try_wait().expect("a child can be waited for");
        status.is_some()
    });
    assert!(has_ended, "it goes on");
    status.expect("it has ended")
}

#[test]
fn nobody_who_reads_any_more_is_no_error() {
    let running = bench();
    let mut child = monitor(&running)
        .arg("--plain")
        .args(["--every", "0.05"])
        .spawn()
        .expect("the program can be started");
    let mut first = String::new();
    BufReader::new(child.stdout.take().expect("it is piped"))
        .read_line(&mut first)
        .expect("it says something");
    // The pipe is closed here.
    assert!(ended(&mut child).success());
    let mut words = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().expect("it is piped"), &mut words)
        .expect("text");
    assert_eq!(words, "");
}

/// Runs a dashboard, lets `end` end it, and checks status and terminal.
fn assert_restores(end: impl FnOnce(&Terminal, &Child)) {
    let running = bench();
    let terminal = Terminal::new();
    let before = terminal.settings();
    let mut command = monitor(&running);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    assert!(
        terminal.shows(LIMIT, "DRIVING"),
        "{}",
        terminal.last_shown()
    );
    assert_ne!(terminal.settings(), before);
    end(&terminal, &child);
    let status = ended(&mut child);
    assert_eq!((status.code(), status.signal()), (Some(0), None));
    assert_eq!(terminal.settings(), before);
    // The usual screen and its cursor are back.
    let leaves = |shown: String| {
        let last = |words: &str| shown.rfind(words);
        last("\x1b[?1049l") > last("\x1b[?1049h") && last("\x1b[?25h") > last("\x1b[?25l")
    };
    assert!(wait_until(LIMIT, || leaves(terminal.shown())));
}

#[test]
fn the_terminal_is_restored_after_q() {
    assert_restores(|terminal, _| terminal.type_keys("q"));
}

#[test]
fn the_terminal_is_restored_after_control_c() {
    assert_restores(|terminal, _| terminal.type_keys("\x03"));
}

#[test]
fn the_terminal_is_restored_after_any_signal() {
    for name in ["TERM", "HUP", "INT", "QUIT"] {
        assert_restores(|_, child| signal(child, name));
    }
}

#[test]
fn a_terminal_that_goes_away_takes_the_monitor_with_it() {
    let running = bench();
    let terminal = Terminal::new();
    let mut command = monitor(&running);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    // The test's own hold on the terminal.
    drop(command);
    assert!(
        terminal.shows(LIMIT, "DRIVING"),
        "{}",
        terminal.last_shown()
    );
    terminal.hang_up();
    assert!(ended(&mut child).success());
}

#[test]
fn a_key_stops_the_display_and_its_answer_is_shown() {
    let running = bench();
    let terminal = Terminal::new();
    let mut command = monitor(&running);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    assert!(terminal.shows(LIMIT, "DRIVING"));
    terminal.type_keys(" ");
    assert!(
        terminal.shows(LIMIT, "STOPPED: BY THE OPERATOR"),
        "{}",
        terminal.last_shown()
    );
    let stop = Stop {
        reason: StopReason::Operator,
    };
    assert_eq!(running.bench().stopped, Some(stop));
    assert!(terminal.shows(LIMIT, "confirmed by the sensor and the display"));
    terminal.type_keys("q");
    assert!(ended(&mut child).success());
}

#[test]
fn a_signal_stops_the_boards_although_nobody_reads_what_the_monitor_writes() {
    let running = bench();
    let mut child = monitor(&running)
        .args(["--json", "--every", "0.001"])
        .spawn()
        .expect("the program can be started");
    // A pipe that nobody reads is full soon: the one that writes waits for ever.
    let stuck = format!("/proc/{}/task/{}/wchan", child.id(), child.id());
    assert!(wait_until(LIMIT, || {
        fs::read_to_string(&stuck).is_ok_and(|place| place.contains("pipe"))
    }));
    signal(&child, "USR1");
    assert!(wait_until(LIMIT, || running.bench().stopped.is_some()));
    let _ = child.kill();
    let _ = child.wait();
}

#[test]
fn a_signal_stops_the_boards_and_the_dashboard_shows_their_answers() {
    let running = bench();
    let terminal = Terminal::new();
    let mut command = monitor(&running);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    assert!(terminal.shows(LIMIT, "DRIVING"));
    signal(&child, "USR1");
    let words = "confirmed by the sensor and the display";
    assert!(terminal.shows(LIMIT, words), "{}", terminal.last_shown());
    terminal.type_keys("q");
    assert!(ended(&mut child).success());
}

/// Without a terminal, and for others to watch.
const WITHOUT_A_SCREEN: [&[&str]; 2] = [&["monitor", "--plain"], &["live", "--port", "0"]];

/// Two boards of which the display takes no notice of a Stop, a program that knows both, and what it says beside its
/// results.
fn beside_a_display_that_disobeys(words: &[&str]) -> ([FakeBoard; 2], bridge::Running, PathBuf) {
    let told = name_of_a_port(&format!("stop-{}", words[0])).with_file_name("told");
    let boards = [Role::Sensor, Role::Display].map(FakeBoard::new);
    let [sensor, display] = &boards;
    display.disobey(true);
    let mut command = bridge::command();
    command.args(words);
    command.arg("--sensor").arg(sensor.path());
    command.arg("--display").arg(display.path());
    command.stderr(File::create(&told).expect("a file can be made"));
    let running = bridge::Running::start(&mut command);
    for board in &boards {
        let is_asked = |message: &Message| matches!(message, Message::Question(_));
        let heard = || board.take_heard().iter().any(is_asked);
        assert!(wait_until(LIMIT, heard), "{words:?}");
    }
    (boards, running, told)
}

#[test]
fn what_became_of_a_stop_by_a_signal_is_told_without_a_screen() {
    for words in WITHOUT_A_SCREEN {
        let ([_sensor, display], running, told) = beside_a_display_that_disobeys(words);
        running.signal("USR1");
        let text = || fs::read_to_string(&told).unwrap_or_default();
        let is_told = |line: &str| wait_until(LIMIT, || text().contains(line));
        let unanswered = "display: no answer, told again: ";
        assert!(is_told(unanswered), "{words:?}: {}", text());
        assert!(is_told("press the emergency stop\n"), "{}", text());
        assert!(text().contains("NOT STOPPED: "), "{}", text());
        let stopped = |board: &str| format!("{board} has stopped: by the operator\n");
        assert!(is_told(&stopped("sensor")), "{words:?}: {}", text());
        assert!(!text().contains(&stopped("display")), "{}", text());
        // It is told again until it answers.
        display.disobey(false);
        assert!(is_told(&stopped("display")), "{words:?}: {}", text());
        running.signal("INT");
        assert_eq!(running.wait(LIMIT).status.code(), Some(0));
    }
}

#[test]
fn a_signal_that_comes_while_a_program_still_starts_stops_the_boards() {
    let at = format!("tcp/127.0.0.1:{}", free_port());
    let relay: &[&str] = &["relay", "sensor", "--listen", &at];
    for words in [
        &WITHOUT_A_SCREEN[..],
        &[&["record", "/dev/null", "--force"], relay],
    ]
    .concat()
    {
        let board = FakeBoard::new(Role::Sensor);
        let port = board.path().to_str().expect("UTF-8");
        let file = name_of_a_port(&format!("start-{}", words[0])).with_file_name("bench.toml");
        // Nobody writes to it yet: the program waits for its bench.
        mknodat(CWD, &file, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)
            .expect("a pipe can be made");
        let mut command = bridge::command();
        let running = bridge::Running::start(command.args(words).arg("--bench").arg(&file));
        let mut bench = File::options().write(true).open(&file).expect("it is read");
        running.signal("USR1");
        write!(bench, "[sensor]\nport = {port:?}\n").expect("it is read");
        drop(bench);
        let is_stop = |message: &Message| matches!(message, Message::Stop(_));
        let heard = || board.take_heard().iter().any(is_stop);
        assert!(wait_until(LIMIT, heard), "{words:?}");
        running.signal("INT");
        assert_eq!(running.wait(LIMIT).status.code(), Some(0), "{words:?}");
    }
}

#[test]
fn a_program_that_ends_before_a_board_has_answered_a_stop_says_so() {
    for words in WITHOUT_A_SCREEN {
        let ([_sensor, display], running, told) = beside_a_display_that_disobeys(words);
        running.signal("USR1");
        let is_stop = |message: &Message| matches!(message, Message::Stop(_));
        let heard = || display.take_heard().iter().any(is_stop);
        assert!(wait_until(LIMIT, heard), "{words:?}");
        running.signal("INT");
        assert_eq!(running.wait(LIMIT).status.code(), Some(0));
        let text = fs::read_to_string(&told).expect("text");
        let (_, after) = text.split_once("NOT STOPPED: ").expect("it is told");
        assert!(after.contains("display: no answer"), "{text}");
        assert!(after.ends_with("press the emergency stop\n"), "{text}");
    }
}

#[test]
fn stop_stops_both_boards_beside_a_monitor_that_has_their_ports() {
    let running = bench();
    let first = Lines::of(monitor(&running).arg("--plain"));
    first.with(" known      known ");
    let stop = |sensor: &Path, display: &Path, more: &[&str]| {
        let mut command = bridge::command();
        command.arg("stop").args(more);
        command
            .arg("--sensor")
            .arg(sensor)
            .arg("--display")
            .arg(display);
        bridge::Running::start(&mut command).wait(LIMIT)
    };
    let [sensor, display] = {
        let bench = running.bench();
        [&bench.sensor, &bench.display].map(|board| board.path().clone())
    };
    // Beside other work the system may be late with the bytes of a pseudo-terminal, by seconds.
    let done = stop(&sensor, &display, &["--within", "60"]);
    assert_eq!(done.status.code(), Some(0), "{}", done.stderr);
    for board in ["sensor", "display"] {
        let words = format!("{board} has stopped: by the operator");
        assert!(done.stderr.contains(&words), "{}", done.stderr);
    }
    assert!(running.bench().stopped.is_some());
    first.with("display safety: stopped");
    // A board that is not there is not stopped.
    let absent = name_of_a_port("unstopped");
    let done = stop(&absent, &display, &["--within", "1"]);
    assert_eq!(done.status.code(), Some(1), "{}", done.stderr);
    assert!(
        done.stderr
            .contains("NOT STOPPED as far as is known: sensor"),
        "{}",
        done.stderr
    );
}

#[test]
fn stop_says_so_where_both_names_lead_to_one_board() {
    let running = bench();
    let port = running.bench().display.path().clone();
    let folder = std::env::temp_dir().join(format!("stop-twice-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    let link = folder.join("sensor");
    symlink(&port, &link).expect("a link");
    for sensor in [&link, &port] {
        let mut command = bridge::command();
        command.args(["stop", "--within", "60"]);
        command.arg("--sensor").arg(sensor);
        command.arg("--display").arg(&port);
        let done = bridge::Running::start(&mut command).wait(LIMIT);
        assert_eq!(done.status.code(), Some(1), "{}", done.stderr);
        for words in [
            "display has stopped: by the operator".to_owned(),
            format!(
                "{} is the display, which has stopped; the sensor was not told",
                sensor.display()
            ),
        ] {
            assert!(done.stderr.contains(&words), "{}", done.stderr);
        }
        assert!(running.bench().stopped.take().is_some());
    }
    fs::remove_dir_all(&folder).expect("the folder");
}

#[test]
fn stop_finds_both_boards_where_their_names_are_exchanged() {
    let running = bench();
    let [sensor, display] = {
        let bench = running.bench();
        [&bench.sensor, &bench.display].map(|board| board.path().clone())
    };
    let mut command = bridge::command();
    command.args(["stop", "--within", "60"]);
    command.arg("--sensor").arg(&display);
    command.arg("--display").arg(&sensor);
    let done = bridge::Running::start(&mut command).wait(LIMIT);
    for board in ["sensor", "display"] {
        let words = format!("{board} has stopped: by the operator");
        assert!(done.stderr.contains(&words), "{}", done.stderr);
    }
    assert_eq!(done.status.code(), Some(0), "{}", done.stderr);
}

#[test]
fn a_key_streams_the_gauges_and_changes_no_setting() {
    let mut bench = FakeBench::new();
    bench.sensing.window_ms = 123;
    let before = bench.sensing;
    let running = Running::new(bench);
    let terminal = Terminal::new();
    let mut command = monitor(&running);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    assert!(terminal.shows(LIMIT, "g streams them"));
    terminal.type_keys("g");
    assert!(
        terminal.shows(LIMIT, "the gauges are streamed from now on"),
        "{}",
        terminal.last_shown()
    );
    assert!(terminal.shows(LIMIT, "LSB high"));
    assert_eq!(running.bench().sensing, before);
    terminal.type_keys("q");
    assert!(ended(&mut child).success());
}

#[test]
fn the_form_changes_a_setting_and_shows_a_refusal() {
    let running = bench();
    let terminal = Terminal::new();
    let mut command = monitor(&running);
    terminal.hold(&mut command);
    let mut child = command.spawn().expect("the program can be started");
    assert!(terminal.shows(LIMIT, "DRIVING"));
    terminal.type_keys("c");
    assert!(terminal.shows(LIMIT, "uniform"));
    // Down to max_age_ms.
    terminal.type_keys("jjj");
    terminal.types_until(LIMIT, "77\r", "max_age_ms is 77 ms now");
    assert_eq!(running.bench().displaying.max_age_ms, 77);
    terminal.types_until(LIMIT, "7\r", "max_age_ms is out of range: give 20 to 5000");
    assert_eq!(running.bench().displaying.max_age_ms, 77);
    terminal.type_keys("qq");
    assert!(ended(&mut child).success());
}

#[test]
fn a_log_without_its_firmware_or_from_none_is_refused() {
    let folder = name_of_a_port("log").with_file_name("bench.toml");
    fs::write(
        &folder,
        "[sensor]\nport = \"/dev/none\"\nrtt = \"tcp:localhost:1\"\n",
    )
    .expect("written");
    let mut command = bridge::command();
    command
        .arg("monitor")
        .arg("--plain")
        .arg("--bench")
        .arg(&folder);
    let ended = bridge::Running::start(&mut command).wait(LIMIT);
    assert_eq!(ended.status.code(), Some(2));
    assert!(
        ended.stderr.contains("give --sensor-elf"),
        "{}",
        ended.stderr
    );
    command.arg("--sensor-elf").arg(&folder);
    let ended = bridge::Running::start(&mut command).wait(LIMIT);
    assert_eq!(ended.status.code(), Some(2));
    assert!(
        ended.stderr.contains("holds no defmt log"),
        "{}",
        ended.stderr
    );
}

#[test]
fn two_logs_are_not_read_by_one_probe() {
    let folder = name_of_a_port("probes").with_file_name("bench.toml");
    let two = "[sensor]\nelf = \"/bin/true\"\nUSB[display]\nelf = \"/bin/true\"\n";
    for usb in ["", "usb = \"066C\"\n"] {
        fs::write(&folder, two.replace("USB", usb)).expect("written");
        let mut command = bridge::command();
        command.args(["monitor", "--plain", "--probe-log", "--bench"]);
        let ended = bridge::Running::start(command.arg(&folder)).wait(LIMIT);
        assert_eq!(ended.status.code(), Some(2));
        let words = "each board's log needs a probe of its own";
        assert!(ended.stderr.contains(words), "{}", ended.stderr);
    }
}
