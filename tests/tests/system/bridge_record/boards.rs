//! Boards that are not there, that come later, and that go and return.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use host_bridge::clock::{Clock, SystemClock};
use host_bridge::recording::Entry;
use host_bridge::recording::row::{LinkEvent, LinkRow, Lost, Row};
use protocol::{Hello, Message, Ping, Role};
use tests::bridge::{self, Running};
use tests::fake_board::{FakeBoard, wait_until};
use tests::utterance::Speaker;

use super::{LIMIT, Pair, entries, folder, messages, signal, succeeded};

/// Waits until a board has been asked for its configuration: it is known.
fn asked(board: &FakeBoard) -> bool {
    wait_until(LIMIT, || {
        let heard = board.take_heard();
        heard
            .iter()
            .any(|message| matches!(message, Message::Question(_)))
    })
}

#[test]
fn a_board_that_goes_and_returns_is_recorded_on_and_the_gap_is_written_down() {
    let folder = folder("returns");
    let path = folder.join("returns.mcap");
    let name = folder.join("ttySensor");
    // One board, whose clock goes on while its cable is out.
    let began_us = SystemClock.now_us();
    let sensor = || {
        let board = FakeBoard::new(Role::Sensor);
        board.lose_nothing();
        board.be_up_since(began_us);
        symlink(board.path(), &name).expect("a link can be made");
        board
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
fn one_board_that_is_named_alone_is_recorded_alone() {
    for (role, other) in [(Role::Sensor, Role::Display), (Role::Display, Role::Sensor)] {
        let path = folder(&format!("alone-{}", role.name())).join("alone.mcap");
        let board = FakeBoard::new(role);
        let running = Running::start(
            bridge::command()
                .args(["record", "--no-gauges", "--json"])
                .arg(&path)
                .arg(format!("--{}", role.name()))
                .arg(board.path()),
        );
        assert!(asked(&board));
        signal(&running, "-INT");
        let ended = running.wait(LIMIT);
        succeeded(&ended);
        let other = other.name();
        let said =
            format!("{other}: absent: only the other board is named; name it with --{other}");
        assert!(ended.stderr.contains(&said), "{}", ended.stderr);
        let summary: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
        assert_eq!(summary["absent"], serde_json::json!([other]), "{summary}");
        let (entries, is_cut) = entries(&path);
        assert!(!is_cut && !entries.is_empty());
        // Nobody has looked for the other one among this machine's ports.
        assert!(entries.iter().all(|entry| entry.role == role));
    }
}

#[test]
fn a_board_that_comes_later_is_recorded_from_then_on() {
    let folder = folder("later");
    let path = folder.join("later.mcap");
    let name = folder.join("ttyDisplay");
    let sensor = FakeBoard::new(Role::Sensor);
    let record = |name: &Path| {
        Running::start(
            bridge::command()
                .args(["record", "--no-gauges", "--force"])
                .arg(&path)
                .arg("--sensor")
                .arg(sensor.path())
                .arg("--display")
                .arg(name),
        )
    };
    let running = record(&name);
    assert!(asked(&sensor));
    signal(&running, "-INT");
    let ended = running.wait(LIMIT);
    succeeded(&ended);
    let absent = format!("display: {}: not there: plug the board in", name.display());
    assert!(ended.stderr.contains(&absent), "{}", ended.stderr);
    assert!(
        ended.stdout.trim_end().ends_with("; never there: display"),
        "{}",
        ended.stdout
    );

    let running = record(&name);
    assert!(asked(&sensor));
    let display = FakeBoard::new(Role::Display);
    symlink(display.path(), &name).expect("a link can be made");
    assert!(asked(&display));
    display.say(Speaker::new(3).motion());
    display.say(Message::Ping(Ping { sent_us: 9 }));
    let is_answered = wait_until(LIMIT, || {
        let heard = display.take_heard();
        heard
            .iter()
            .any(|message| matches!(message, Message::Pong(pong) if pong.sent_us == 9))
    });
    assert!(is_answered);
    signal(&running, "-INT");
    let ended = running.wait(LIMIT);
    succeeded(&ended);
    assert!(ended.stderr.contains(&absent), "{}", ended.stderr);
    let came = format!("display: {}: display 0.1.0 on stm32f429zi", name.display());
    assert!(ended.stderr.contains(&came), "{}", ended.stderr);
    assert!(!ended.stdout.contains("never there"), "{}", ended.stdout);
    let (entries, _) = entries(&path);
    let of = |role: Role| entries.iter().filter(move |entry| entry.role == role);
    let is_motion = |entry: &Entry| matches!(entry.row, Row::Motion(_));
    assert_eq!(
        of(Role::Display).filter(|entry| is_motion(entry)).count(),
        1
    );
    let words: Vec<&str> = of(Role::Display)
        .filter_map(|entry| match &entry.row {
            Row::Link(link) => Some(link.state.as_ref()?.0.as_str()),
            _ => None,
        })
        .filter(|word| matches!(*word, "known" | "absent"))
        .collect();
    assert_eq!(words, ["absent", "known"]);
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
    // Recorded as long as was asked for, but nobody was there.
    assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
    assert!(started.elapsed() >= Duration::from_millis(300));
    let (entries, is_cut) = entries(&path);
    // Both are absent, and nothing was said.
    assert_eq!((entries.len(), is_cut), (2, false));
}

#[test]
fn a_board_that_went_and_did_not_return_is_named_in_the_summary() {
    for (number, (words, status)) in [
        (&["--json"][..], 0),
        (&[], 0),
        // With --for the exit status tells of it as well, also if a signal ends it before.
        (&["--for", "600"], 1),
        (&["--for", "600", "--json"], 1),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = folder(&format!("went-{number}"));
        // By a name of its own: the number of a port that has gone is another's soon.
        let name = folder.join("ttySensor");
        let told = folder.join("told");
        let mut pair = Pair::new();
        symlink(pair.sensor.path(), &name).expect("a link can be made");
        let mut command = bridge::command();
        command.args(["record", "--no-gauges"]).args(words);
        command.arg(folder.join("went.mcap"));
        command.arg("--sensor").arg(&name);
        command.arg("--display").arg(pair.display.path());
        command.stderr(File::create(&told).expect("a file can be made"));
        let running = Running::start(&mut command);
        pair.wait_for_questions();
        fs::remove_file(&name).expect("the link can be taken away");
        // Its port goes with it.
        pair.sensor = FakeBoard::saying(Hello::new(Role::Sensor, "unplugged", [0, 0, 0]));
        let text = || fs::read_to_string(&told).unwrap_or_default();
        let gone = format!("sensor: {}: not there", name.display());
        assert!(wait_until(LIMIT, || text().contains(&gone)), "{}", text());
        signal(&running, "-INT");
        let ended = running.wait(LIMIT);
        assert_eq!(
            ended.status.code(),
            Some(status),
            "{words:?}: {}{}",
            ended.stdout,
            text()
        );
        if words.contains(&"--json") {
            let summary: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
            assert_eq!(summary["absent"], serde_json::json!([]), "{summary}");
            let missing = summary["missing_at_end"].as_array().expect("a list");
            assert_eq!(missing.len(), 1, "{summary}");
            assert_eq!(missing[0]["board"], "sensor", "{summary}");
            let heard_s = missing[0]["last_heard_s"].as_f64().expect("a number");
            let seconds = summary["seconds"].as_f64().expect("a number");
            assert!((0.0..seconds).contains(&heard_s), "{summary}");
        } else {
            let named = "; not there at the end: sensor, last heard at ";
            assert!(ended.stdout.contains(named), "{}", ended.stdout);
        }
    }
}

#[test]
fn a_recording_goes_on_when_the_program_that_owns_its_ports_is_killed() {
    let folder = folder("owner");
    let path = folder.join("owner.mcap");
    let mut pair = Pair::new();
    let [sensor, display] = [&pair.sensor, &pair.display].map(FakeBoard::path);
    let mut monitor = bridge::command();
    monitor.args(["monitor", "--plain", "--every", "600"]);
    monitor.arg("--sensor").arg(sensor);
    monitor.arg("--display").arg(display);
    let owner = Running::start(&mut monitor);
    // It answers both boards: it has their ports.
    pair.wait_until_heard();
    let words = [path.to_str().expect("UTF-8"), "--json"];
    let running = pair.record(&mut bridge::command(), &words);
    pair.wait_until_both_hear();
    let mut speakers = [
        (Role::Sensor, Speaker::new(1)),
        (Role::Display, Speaker::new(2)),
    ];
    let mut before = Vec::new();
    for (role, speaker) in &mut speakers {
        let message = speaker.message(*role);
        pair.board(*role).say(message.clone());
        before.push((*role, message));
        // Both programs answer when both have heard it.
        let board = pair.board(*role);
        board.say(Message::Ping(Ping { sent_us: u64::MAX }));
        let mut answers = 0;
        assert!(wait_until(LIMIT, || {
            let heard = board.take_heard();
            let is_answer = |message: &&Message| matches!(message, Message::Pong(pong) if pong.sent_us == u64::MAX);
            answers += heard.iter().filter(is_answer).count();
            answers == 2
        }));
    }
    signal(&owner, "-KILL");
    drop(owner);
    // Whoever is asked and answers has the port now.
    pair.wait_until_heard();
    let mut after = Vec::new();
    for (role, speaker) in &mut speakers {
        let message = speaker.message(*role);
        pair.board(*role).say(message.clone());
        after.push((*role, message));
    }
    pair.wait_until_heard();
    signal(&running, "-INT");
    succeeded(&running.wait(LIMIT));
    let (_, is_cut) = entries(&path);
    assert!(!is_cut);
    let read = messages(&path);
    for said in before.iter().chain(&after) {
        assert!(read.contains(said), "{said:?}");
    }
}

/// How the system has a process: `S` asleep, `T` halted, and so on.
fn state(running: &Running) -> Option<char> {
    let facts = fs::read_to_string(format!("/proc/{}/stat", running.child.id())).ok()?;
    facts.rsplit_once(')')?.1.trim_start().chars().next()
}

#[test]
fn a_program_that_is_halted_holds_up_no_stop_and_goes_on() {
    let path = folder("halted").join("halted.mcap");
    let pair = Pair::new();
    let running = pair.record(
        &mut bridge::command(),
        &[path.to_str().expect("UTF-8"), "--no-gauges"],
    );
    pair.wait_for_questions();
    signal(&running, "-STOP");
    assert!(wait_until(LIMIT, || state(&running) == Some('T')));
    let mut stop = bridge::command();
    stop.args(["stop", "--within", "60", "--sensor"])
        .arg(pair.sensor.path());
    let ended = Running::start(stop.arg("--display").arg(pair.display.path())).wait(LIMIT);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert_ne!(state(&running), Some('T'));
    signal(&running, "-INT");
    succeeded(&running.wait(LIMIT));
}

#[test]
fn who_hears_a_board_through_a_program_that_is_halted_lets_it_go_on() {
    let folder = folder("halted-later");
    let [first, second] = ["first.mcap", "second.mcap"].map(|name| folder.join(name));
    let mut pair = Pair::new();
    let record = |path: &Path| {
        let words = [path.to_str().expect("UTF-8"), "--no-gauges"];
        pair.record(&mut bridge::command(), &words)
    };
    let owner = record(&first);
    pair.wait_for_questions();
    let guest = record(&second);
    pair.wait_until_both_hear();
    signal(&owner, "-STOP");
    assert!(wait_until(LIMIT, || state(&owner) == Some('T')));
    assert!(wait_until(LIMIT, || state(&owner) != Some('T')));
    pair.wait_until_both_hear();
    for running in [owner, guest] {
        signal(&running, "-INT");
        succeeded(&running.wait(LIMIT));
    }
}

#[test]
fn ctrl_z_halts_no_program_that_others_hear_a_board_through() {
    let path = folder("ctrl-z").join("a.mcap");
    let pair = Pair::new();
    let (reader, writer) = std::io::pipe().expect("a pipe");
    let mut command = bridge::command();
    command.arg("record").arg(&path);
    command.arg("--sensor").arg(pair.sensor.path());
    command.arg("--display").arg(pair.display.path());
    let mut child = command.stderr(writer).spawn().expect("the program starts");
    drop(command);
    pair.wait_for_questions();
    let send = |name: &str| {
        let sent = Command::new("kill")
            .args([name, &child.id().to_string()])
            .status();
        assert!(sent.is_ok_and(|status| status.success()), "{name}");
    };
    send("-TSTP");
    let mut lines = BufReader::new(reader).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.contains("Ctrl-Z does not halt it")));
    send("-INT");
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(0));
}
