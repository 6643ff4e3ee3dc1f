//! Everything that is said is recorded, and nothing is changed.

use std::fs::{self, File};
use std::process::Stdio;

use host_bridge::recording::row::Row;
use protocol::{
    Configuration, ConfigurationReport, DisplayConfiguration, GAUGE_BLOCK, Message, Question, Role,
    SensorConfiguration,
};
use tests::bridge;
use tests::fake_board::wait_until;
use tests::utterance::Speaker;

use super::{LIMIT, Pair, entries, folder, messages, of, signal, succeeded};

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

#[test]
fn gauges_are_asked_for_again_and_again_while_they_are_recorded_and_nothing_is_changed() {
    let path = folder("gauges").join("gauges.mcap");
    let pair = Pair::new();
    let running = pair.record(&mut bridge::command(), &[path.to_str().expect("UTF-8")]);
    let in_force = SensorConfiguration {
        window_ms: 123,
        ..SensorConfiguration::DEFAULT
    };
    let configurations = [
        (Role::Sensor, Configuration::Sensor(in_force)),
        (
            Role::Display,
            Configuration::Display(DisplayConfiguration::DEFAULT),
        ),
    ];
    let (mut questions, mut leases) = (0, 0);
    let heard = wait_until(LIMIT, || {
        for (role, configuration) in configurations {
            for message in pair.board(role).take_heard() {
                match message {
                    Message::Question(Question::Configuration) => {
                        questions += 1;
                        let report = ConfigurationReport::of(configuration, None);
                        pair.board(role).say(Message::Configuration(report));
                    }
                    Message::StreamGauges(asked) => {
                        assert_eq!(role, Role::Sensor);
                        assert!(asked.for_ms > 0);
                        leases += 1;
                    }
                    Message::Configure(asked) => panic!("{asked:?}"),
                    _ => {}
                }
            }
        }
        questions >= 2 && leases >= 3
    });
    assert!(heard, "{questions} questions, {leases} requests");
    signal(&running, "-TERM");
    succeeded(&running.wait(LIMIT));
    let (entries, _) = entries(&path);
    assert!(entries.iter().any(
        |entry| matches!(&entry.row, Row::SensorConfiguration(row) if row.in_force == in_force)
    ));
    assert!(
        entries
            .iter()
            .any(|entry| matches!(entry.row, Row::DisplayConfiguration(_)))
    );
}

#[test]
fn what_became_of_a_stop_is_told() {
    let folder = folder("stop");
    let told = folder.join("told");
    let pair = Pair::new();
    pair.display.disobey(true);
    let path = folder.join("stop.mcap");
    let running = pair.record(
        bridge::command().stderr(File::create(&told).expect("a file can be made")),
        &[path.to_str().expect("UTF-8"), "--no-gauges", "--quiet"],
    );
    pair.wait_for_questions();
    signal(&running, "-USR1");
    let text = || fs::read_to_string(&told).unwrap_or_default();
    let is_told = |words: &str| assert!(wait_until(LIMIT, || text().contains(words)), "{}", text());
    is_told("press the emergency stop\n");
    let text_so_far = text();
    let (before, after) = text_so_far.split_once("NOT STOPPED: ").expect("who");
    // On a busy machine the sensor may not have answered by then either.
    let (names, advice) = match before.contains("sensor has stopped: by the operator\n") {
        true => ("display", ""),
        false => (
            "sensor and display",
            "cut the power of the arm's drive and ",
        ),
    };
    let words = format!("{names}: no answer, told again: {advice}press the emergency stop\n");
    assert!(after.starts_with(&words), "{text_so_far}");
    is_told("sensor has stopped: by the operator\n");
    assert!(!text().contains("display has stopped"), "{}", text());
    // It is told again until it answers.
    pair.display.disobey(false);
    is_told("display has stopped: by the operator\n");
    signal(&running, "-INT");
    assert_eq!(running.wait(LIMIT).status.code(), Some(0));
}

#[test]
fn a_recording_that_is_ended_tells_first_what_became_of_a_stop() {
    let folder = folder("stop-and-end");
    let pair = Pair::new();
    pair.display.disobey(true);
    let path = folder.join("stop.mcap");
    let running = pair.record(
        bridge::command().stderr(Stdio::piped()),
        &[path.to_str().expect("UTF-8"), "--no-gauges", "--quiet"],
    );
    pair.wait_for_questions();
    signal(&running, "-USR1");
    let is_stop = |message: &Message| matches!(message, Message::Stop(_));
    assert!(wait_until(LIMIT, || pair
        .display
        .take_heard()
        .iter()
        .any(is_stop)));
    signal(&running, "-INT");
    let output = running.wait(LIMIT);
    let words = &output.stderr;
    assert_eq!(output.status.code(), Some(0), "{words}");
    assert!(words.contains("NOT STOPPED: "), "{words}");
    assert!(words.contains("press the emergency stop"), "{words}");
}
