//! What was said to be safe is, whatever happens to the program, the disk and the file.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use host_bridge::recording::row::Row;
use protocol::{GAUGE_BLOCK, Message, Role};
use rustix::fs::{CWD, FileType, Mode, OFlags, mknodat, open};
use rustix::io::ioctl_fionread;
use tests::bridge::{self, Running};
use tests::elves;
use tests::fake_board::wait_until;
use tests::pty::Near;
use tests::utterance::Speaker;

use super::{LIMIT, Pair, entries, folder, signal};

/// Its number on Linux.
const SIGUSR1: u32 = 10;

/// Samples that fill no disk of these tests.
const SOME: u32 = 800;

#[test]
fn a_program_that_is_killed_leaves_what_it_said_is_safe() {
    let folder = folder("killed");
    let (path, told) = (folder.join("killed.mcap"), folder.join("told"));
    let pair = Pair::new();
    let running = pair.record(
        bridge::command().stderr(File::create(&told).expect("a file can be made")),
        &[path.to_str().expect("UTF-8"), "--no-gauges"],
    );
    pair.wait_for_questions();
    // Until some seconds of it are safe, the file grows with each, and it has said so.
    let end = Instant::now() + LIMIT;
    let (mut sizes, mut last) = (0, 0);
    let mut speaker = Speaker::new(8);
    let mut said = Vec::new();
    let text = || fs::read_to_string(&told).unwrap_or_default();
    while sizes < 3 || !text().contains("messages") {
        assert!(Instant::now() < end, "the file does not grow: {}", text());
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
    let safe = number_before(&text(), "messages");
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
    assert!(!motions.is_empty() && said.starts_with(&motions));
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
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut running = pair.record(
        &mut limited,
        &[path.to_str().expect("UTF-8"), "--no-gauges"],
    );
    pair.wait_for_questions();
    let mut speaker = Speaker::new(11);
    let mut first = 0;
    let len = || fs::metadata(&path).map_or(0, |facts| facts.len());
    let empty = len();
    let ended = wait_until(LIMIT, || {
        // Some 700 kB a second, but not before a first chunk is in the file: it is safe before the disk is full.
        if first < SOME || len() > empty {
            pair.sensor.say(speaker.gauges(first));
            first += GAUGE_BLOCK as u32;
        }
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
            Row::Gauges(row) => Some(row.first_sample),
            _ => None,
        })
        .flat_map(|first| first..first + GAUGE_BLOCK as u32)
        .collect();
    assert!(samples.iter().copied().eq(0..samples.len() as u32));
    // What is safe is all that is there, and is said at the end: the file ends with a whole chunk.
    let safe = number_before(&ended.stderr, "samples,");
    assert_eq!(samples.len() as u64, safe);
    assert!(safe > 0);
    let bytes = number_before(&ended.stderr, "bytes of it are safe");
    assert_eq!(fs::metadata(&path).expect("it is there").len(), bytes);
}

#[test]
fn a_disk_that_stands_still_holds_up_no_stop() {
    let path = folder("hung").join("hung.mcap");
    mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("it can be made");
    // Somebody has it open who reads nothing: as soon as it is full, a write waits for ever.
    let reader = open(&path, OFlags::RDONLY | OFlags::NONBLOCK, Mode::empty());
    let reader = reader.expect("it can be opened");
    let pair = Pair::new();
    let words = [path.to_str().expect("UTF-8"), "--force", "--no-gauges"];
    let mut running = pair.record(&mut bridge::command(), &words);
    pair.wait_for_questions();
    let mut speaker = Speaker::new(5);
    let mut first = 0;
    let (mut held, mut unchanged) = (0, 0);
    let is_hung = wait_until(LIMIT, || {
        pair.sensor.say(speaker.gauges(first));
        first += GAUGE_BLOCK as u32;
        let now = ioctl_fionread(&reader).expect("a pipe says what it holds");
        unchanged = if now == held && now > 0 {
            unchanged + 1
        } else {
            0
        };
        held = now;
        // Chunks are written once a second at least, of some 700 kB each.
        let is_over = running.child.try_wait().expect("it can be asked").is_some();
        assert!(!is_over, "it ends by itself");
        unchanged > 1_500
    });
    assert!(is_hung, "the pipe holds {held} bytes");
    signal(&running, "-USR1");
    for role in [Role::Sensor, Role::Display] {
        let board = pair.board(role);
        let is_stop = |message: &Message| matches!(message, Message::Stop(_));
        let is_told = wait_until(LIMIT, || board.take_heard().iter().any(is_stop));
        assert!(is_told, "the {}", role.name());
    }
    signal(&running, "-KILL");
    running.wait(LIMIT);
}

/// Whether a process has a handler for SIGUSR1: before that it would end it.
fn catches_usr1(process: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (SIGUSR1 - 1) & 1 == 1)
}

/// Nor where it stands still before there is a recording: the pipe is full, and nobody reads it.
#[test]
fn a_disk_that_stands_still_from_the_start_holds_up_no_stop() {
    let path = folder("hung-at-once").join("hung.mcap");
    mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("it can be made");
    let open =
        |flags| open(&path, flags | OFlags::NONBLOCK, Mode::empty()).expect("it can be opened");
    let _reader = open(OFlags::RDONLY);
    let mut writer = File::from(open(OFlags::WRONLY));
    while writer.write(&[0; 4096]).is_ok() {}
    let pair = Pair::new();
    let words = [path.to_str().expect("UTF-8"), "--force", "--no-gauges"];
    let running = pair.record(&mut bridge::command(), &words);
    let is_caught = wait_until(LIMIT, || catches_usr1(running.child.id()));
    assert!(is_caught, "it hears signals");
    signal(&running, "-USR1");
    for role in [Role::Sensor, Role::Display] {
        let board = pair.board(role);
        let is_stop = |message: &Message| matches!(message, Message::Stop(_));
        let is_told = wait_until(LIMIT, || board.take_heard().iter().any(is_stop));
        assert!(is_told, "the {}", role.name());
    }
    signal(&running, "-KILL");
    running.wait(LIMIT);
}

#[test]
fn a_disk_that_takes_nothing_at_all_gets_no_empty_file_and_keeps_the_old_one() {
    let folder = folder("nothing");
    let old = folder.join("old.mcap");
    fs::write(&old, "kept").expect("the file can be written");
    for (name, words) in [("new.mcap", vec![]), ("old.mcap", vec!["--force"])] {
        let mut limited = Command::new("sh");
        limited
            .args(["-c", "trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\""])
            .arg(bridge::path())
            .env_remove("RIDGELINK_BENCH")
            .env_remove("HOME")
            .env_remove("XDG_CONFIG_HOME")
            .arg("record")
            .arg(folder.join(name))
            .args(words)
            .args(["--sensor", "/dev/null/s", "--display", "/dev/null/d"]);
        let ended = limited.output().expect("a shell");
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(2), "{said}");
        assert!(said.contains("can't be written any further"), "{said}");
    }
    assert_eq!(fs::read(&old).expect("still there"), b"kept");
    let left = fs::read_dir(&folder).expect("a folder").count();
    assert_eq!(left, 1, "only the old one");
}

#[test]
fn places_that_take_no_file_are_named_with_the_reason() {
    let folder = folder("places");
    let file = folder.join("file");
    fs::write(&file, "").expect("the file can be written");
    let within = file.join("x.mcap");
    let absent = folder.join("absent").join("x.mcap");
    // Nobody reads it.
    let pipe = folder.join("pipe");
    mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe can be made");
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
            vec![pipe.to_str().expect("UTF-8"), "--force"],
            "pipe: can't be made: No such device or address",
        ),
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
fn a_log_that_cannot_be_read_costs_no_old_recording() {
    let folder = folder("log");
    let (old, new, bench) = ("old.mcap", "new.mcap", "bench.toml");
    fs::write(folder.join(old), "kept").expect("the file can be written");
    let seat = "[display]\nport = \"/dev/null/d\"\nrtt = \"tcp:nonsense\"\nelf = \"/bin/true\"\n";
    fs::write(folder.join(bench), seat).expect("the file can be written");
    for words in [vec![old, "--force"], vec![new]] {
        let mut command = bridge::command();
        command.current_dir(&folder).arg("record").args(&words);
        let running = Running::start(command.args(["--bench", bench, "--for", "0.1"]));
        let ended = running.wait(LIMIT);
        assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains("/bin/true"), "{}", ended.stderr);
    }
    assert_eq!(fs::read(folder.join(old)).expect("still there"), b"kept");
    assert!(!folder.join(new).exists());
}

#[test]
fn a_log_becomes_no_controlling_terminal_and_a_pipe_without_a_writer_is_waited_for() {
    let folder = folder("terminal");
    let (_near, _kept, terminal) = Near::pair(Duration::from_millis(10)).expect("a terminal");
    let pipe = folder.join("pipe");
    mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("it can be made");
    let seat = |role: Role, rtt: &Path| {
        let (name, elf) = (role.name(), elves::path(role));
        format!("[{name}]\nport = \"/dev/null/{name}\"\nelf = {elf:?}\nrtt = {rtt:?}\n")
    };
    let seats = seat(Role::Sensor, &terminal) + &seat(Role::Display, &pipe);
    let bench = folder.join("bench.toml");
    fs::write(&bench, seats).expect("the file can be written");
    let program = bridge::command();
    // The leader of a session has no terminal yet: whatever it opens may become it.
    let mut command = Command::new("setsid");
    command.arg(program.get_program()).arg("record");
    command
        .arg(folder.join("log.mcap"))
        .arg("--bench")
        .arg(&bench);
    command.env_remove("RIDGELINK_BENCH");
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let running = Running::start(&mut command);
    let process = PathBuf::from(format!("/proc/{}", running.child.id()));
    let has_open = |path: &Path| {
        let files = fs::read_dir(process.join("fd")).into_iter().flatten();
        let mut targets = files
            .flatten()
            .filter_map(|file| fs::read_link(file.path()).ok());
        targets.any(|target| target == path)
    };
    assert!(wait_until(LIMIT, || has_open(&terminal)));
    let facts = fs::read_to_string(process.join("stat")).expect("it runs");
    // Behind the name in brackets: state, parent, group, session, and the controlling terminal's number.
    let (_, behind) = facts.rsplit_once(')').expect("a name");
    assert_eq!(behind.split_whitespace().nth(4), Some("0"), "{facts}");
    assert!(wait_until(LIMIT, || has_open(&pipe)));
    signal(&running, "-INT");
    let ended = running.wait(LIMIT);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
}

#[test]
fn later_parts_that_are_in_the_way_are_named_wherever_the_recording_lies() {
    let folder = folder("parts");
    let boards = ["--sensor", "/dev/null/s", "--display", "/dev/null/d"];
    let record = |words: &[&str]| {
        let mut command = bridge::command();
        command.current_dir(&folder).arg("record").args(words);
        Running::start(command.args(boards).args(["--for", "0.1"])).wait(LIMIT)
    };
    for path in ["y.mcap", "./y.mcap", "../parts/y.mcap"] {
        fs::write(folder.join("y-2.mcap"), "old").expect("the file can be written");
        let ended = record(&[path]);
        assert_eq!(ended.status.code(), Some(2), "{path}: {}", ended.stderr);
        let is_told = ended.stderr.contains("y-2.mcap: is there already");
        assert!(is_told, "{path}: {}", ended.stderr);
        let ended = record(&[path, "--force"]);
        assert_eq!(ended.status.code(), Some(2), "{path}: {}", ended.stderr);
        let is_told = ended.stderr.contains("y-2.mcap: would be in the way");
        assert!(is_told, "{path}: {}", ended.stderr);
        assert!(!folder.join("y.mcap").exists(), "{path}");
    }
}

#[test]
fn a_terminal_that_stands_still_holds_up_no_recording() {
    let path = folder("terminal").join("a.mcap");
    let pair = Pair::new();
    let (reader, mut writer) = std::io::pipe().expect("a pipe");
    // As much as it takes while nobody reads.
    writer.write_all(&[b' '; 1 << 16]).expect("it fits");
    let mut command = bridge::command();
    command.arg("record").arg(&path);
    command.arg("--sensor").arg(pair.sensor.path());
    command.arg("--display").arg(pair.display.path());
    let mut child = command.stderr(writer).spawn().expect("the program starts");
    // A lease of gauges lasts 1.5 s: it is asked for again, and again.
    let mut asked = 0;
    let is_asked = || {
        let heard = pair.sensor.take_heard();
        let asks = |message: &&Message| matches!(message, Message::StreamGauges(_));
        asked += heard.iter().filter(asks).count();
        asked >= 6
    };
    assert!(wait_until(LIMIT, is_asked), "{asked} times");
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(sent.is_ok_and(|status| status.success()));
    let mut status = None;
    let has_ended = || {
        status = child.try_wait().expect("it can be asked");
        status.is_some()
    };
    assert!(wait_until(LIMIT, has_ended), "it does not end");
    assert_eq!(status.and_then(|status| status.code()), Some(0));
    drop(reader);
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
