//! What `r` in the monitor records.

use std::fs;
use std::path::Path;
use std::process::Child;

use host_bridge::recording::reader::Reader;
use host_bridge::recording::row::Row;
use protocol::SensorConfiguration;
use tests::bridge;
use tests::fake_bench::Running;
use tests::fake_board::wait_until;
use tests::terminal::Terminal;

use super::{LIMIT, bench, ended, monitor, name_of_a_port};

/// A monitor that was asked to record to `folder`, and has `shown` what came of it.
fn asked_to_record(folder: &Path, shown: &str) -> (Running, Terminal, Child) {
    let running = bench();
    let terminal = Terminal::new();
    let mut command = monitor(&running);
    command.arg("--record-to").arg(folder);
    terminal.hold(&mut command);
    let child = command.spawn().expect("the program can be started");
    assert!(terminal.shows(LIMIT, "DRIVING"));
    terminal.type_keys("r");
    assert!(terminal.shows(LIMIT, shown), "{}", terminal.last_shown());
    (running, terminal, child)
}

#[test]
fn a_key_records_what_can_be_watched_again() {
    let folder = name_of_a_port("recording").with_file_name("kept");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let (running, terminal, mut child) = asked_to_record(&folder, "recording");
    let file = folder.join("monitor-1.mcap");
    // Some ten seconds: beside other work, the first ones' times may be wrong by a stall of the pseudo-terminals.
    let is_long = || fs::metadata(&file).is_ok_and(|file| file.len() > 300_000);
    assert!(wait_until(LIMIT, is_long));
    // The gauges stream for as long, and nothing is changed.
    assert!(running.bench().streams());
    terminal.type_keys("r");
    assert!(
        terminal.shows(LIMIT, "recorded: "),
        "{}",
        terminal.last_shown()
    );
    assert_eq!(running.bench().sensing, SensorConfiguration::DEFAULT);
    // A second one is ended by the end of the program.
    terminal.type_keys("r");
    let second = folder.join("monitor-2.mcap");
    assert!(wait_until(LIMIT, || second.exists()));
    terminal.type_keys("q");
    assert!(ended(&mut child).success());
    assert_eq!(running.bench().sensing, SensorConfiguration::DEFAULT);
    drop(running);
    let mut reader = Reader::open(&file).unwrap_or_else(|error| panic!("{error}"));
    let mut has_gauges = false;
    while let Some(entry) = reader
        .next_entry()
        .unwrap_or_else(|error| panic!("{error}"))
    {
        has_gauges |= matches!(entry.row, Row::Gauges(_));
    }
    assert!(has_gauges);

    let mut command = bridge::command();
    command.args(["replay", "--to", "monitor"]).arg(&file);
    let ended = bridge::Running::start(&mut command).wait(LIMIT);
    assert!(ended.status.success(), "{ended:?}");
    for words in [
        "sensor known: ",
        "display known: ",
        "display safety: driving",
        " T1 ",
    ] {
        assert!(ended.stdout.contains(words), "{words} is not in {ended:?}");
    }
}

#[test]
fn a_recording_goes_on_though_the_terminal_takes_nothing() {
    let folder = name_of_a_port("stuck").with_file_name("kept");
    fs::create_dir_all(&folder).expect("a folder can be made");
    let (_running, terminal, mut child) = asked_to_record(&folder, "recording");
    let file = folder.join("monitor-1.mcap");
    let blocks = || {
        let mut blocks = 0;
        if let Ok(mut reader) = Reader::open(&file) {
            while let Ok(Some(entry)) = reader.next_entry() {
                blocks += usize::from(matches!(entry.row, Row::Gauges(_)));
            }
        }
        blocks
    };
    terminal.stand_still(true);
    // The one that draws waits for the terminal.
    let stuck = format!("/proc/{}/task/{}/wchan", child.id(), child.id());
    assert!(wait_until(LIMIT, || {
        fs::read_to_string(&stuck).is_ok_and(|place| place.contains("wait_woken"))
    }));
    // Gauges of twice the time for which they are asked for at once.
    let before = blocks();
    assert!(wait_until(LIMIT, || blocks() > before + 375));
    terminal.stand_still(false);
    terminal.type_keys("q");
    assert!(ended(&mut child).success());
}

#[test]
fn a_folder_that_takes_no_recording_is_named() {
    let folder = name_of_a_port("no-recording").with_file_name("not-there");
    let (_running, terminal, mut child) = asked_to_record(&folder, "NOT RECORDED: ");
    terminal.type_keys("q");
    assert!(ended(&mut child).success());
}
