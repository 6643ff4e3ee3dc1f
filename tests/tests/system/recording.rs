//! Recordings as files: nothing lost in them, nor with what is cut off, and words for what is wrong.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use hil_sim_core::scene::Scene;
use host_bridge::clock::SystemClock;
use host_bridge::clock::now_us;
use host_bridge::link::Event;
use host_bridge::recording::reader::{ReadError, Reader};
use host_bridge::recording::row::{GaugeRow, Lost, Row, VOLTS_PER_CODE};
use host_bridge::recording::{Entry, Recorder, RecordingError, Settings, part_path};
use host_bridge::replay::{Pace, play, scene};
use mcap::{MessageStream, Summary};
use protocol::{GAUGE_BLOCK, GaugeSample, Gauges, Hello, Message, PortCounters, Role};
use ros2msg::Definition;
use tests::fake_board::wait_until;
use tests::utterance::Speaker;

mod readers;
mod spoiled;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("recording")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

fn heard(message: Message) -> Event {
    Event::Heard {
        at_us: now_us(),
        message,
    }
}

fn recorder(path: &Path) -> Recorder {
    Recorder::start(Settings {
        mcap: Some(path.to_owned()),
        ..Settings::default()
    })
    .expect("a file can be made")
}

/// Blocks that may wait for the disk: nearly as many as the recorder's queue takes.
const AHEAD: u64 = 30_000;

/// Records `blocks` blocks of samples, no faster than the disk takes them.
fn record_gauges(path: &Path, blocks: u32) {
    let recorder = recorder(path);
    let mut speaker = Speaker::new(3);
    for block in 0..blocks {
        let has_room = || recorder.progress().tally.samples / 8 + AHEAD > u64::from(block);
        assert!(has_room() || wait_until(LIMIT, has_room), "{block} blocks");
        let gauges = speaker.gauges(block * GAUGE_BLOCK as u32);
        recorder.on_event(Role::Sensor, &heard(gauges));
    }
    let progress = recorder.stop().expect("a whole file");
    assert_eq!(progress.tally.samples, u64::from(blocks) * 8);
}

/// Everything that can be read of a file, and whether it was cut off.
fn entries(path: &Path) -> Result<(Vec<Entry>, bool), ReadError> {
    let mut reader = Reader::open(path)?;
    let mut entries = Vec::new();
    while let Some(entry) = reader.next_entry()? {
        entries.push(entry);
    }
    Ok((entries, reader.is_cut()))
}

/// What a recording plays as fast as it can.
fn events(path: &Path) -> Vec<(Role, Event)> {
    let pace = Pace {
        speed: 100.0,
        ..Pace::default()
    };
    let mut events = Vec::new();
    let recording = Reader::open(path).expect("a recording");
    let ended = AtomicBool::new(false);
    play(&SystemClock, recording, &pace, &ended, |role, event| {
        events.push((role, event));
    })
    .expect("it can be read to the end");
    events
}

/// Without the time at which it was heard, which a replay has its own of.
fn messages(events: impl IntoIterator<Item = (Role, Event)>) -> Vec<(Role, Message)> {
    events
        .into_iter()
        .filter_map(|(role, event)| match event {
            Event::Heard { message, .. } => Some((role, message)),
            _ => None,
        })
        .collect()
}

#[test]
fn every_message_is_recorded_once_in_order_and_read_back_as_it_was() {
    let path = folder("everything").join("everything.mcap");
    let recorder = recorder(&path);
    let mut said = Vec::new();
    let mut speakers = [
        (Role::Sensor, Speaker::new(1)),
        (Role::Display, Speaker::new(2)),
    ];
    let mut sample = 0;
    for turn in 0..3_000 {
        for (role, speaker) in &mut speakers {
            let message = match (turn % 10, *role) {
                (3, Role::Sensor) => {
                    sample += GAUGE_BLOCK as u32;
                    speaker.gauges(sample)
                }
                (7, _) => speaker.oddity(),
                // A host's own words are no display's, and the other way round.
                (8, Role::Display) => speaker.message(Role::Sensor),
                (_, role) => speaker.message(role),
            };
            recorder.on_event(*role, &heard(message.clone()));
            said.push((*role, message));
        }
    }
    let progress = recorder.stop().expect("a whole file");
    assert_eq!(progress.tally.messages, said.len() as u64);
    let read = messages(events(&path));
    for (read, said) in read.iter().zip(&said) {
        assert_eq!(read, said);
    }
    assert_eq!(read.len(), said.len());
}

#[test]
fn numbers_that_are_none_are_kept() {
    let path = folder("nan").join("nan.mcap");
    let recorder = recorder(&path);
    let mut speaker = Speaker::new(4);
    let Message::Estimate(estimate) = speaker.estimate() else {
        unreachable!("an estimate was asked for");
    };
    let odd = protocol::Estimate {
        wavelength_mm: Some(f32::NAN),
        counted_mm: None,
        confidence: f32::NAN,
        ..estimate
    };
    recorder.on_event(Role::Sensor, &heard(Message::Estimate(odd)));
    recorder.stop().expect("a whole file");
    let [(_, Message::Estimate(read))] = &messages(events(&path))[..] else {
        panic!("one estimate was said");
    };
    assert!(read.wavelength_mm.is_some_and(f32::is_nan) && read.confidence.is_nan());
    assert_eq!(read.counted_mm, None);
}

#[test]
fn all_codes_can_be_told_from_the_volts_that_are_written() {
    let mut gauges = Gauges {
        first_sample: 0,
        instant_us: 0,
        position_um: -5,
        samples: [GaugeSample::default(); GAUGE_BLOCK],
    };
    for code in 0..=u16::MAX {
        gauges.samples[0].codes = [code; 6];
        let row = GaugeRow::all(&gauges)[0];
        assert_eq!(row.codes(), [code; 6]);
        // 10 µV, rounded.
        let volts = f64::from(code) * VOLTS_PER_CODE;
        assert!((row.g0_v - volts).abs() < 5.1e-6);
    }
}

#[test]
fn samples_have_the_place_and_the_time_at_which_they_were_taken() {
    let samples = std::array::from_fn(|at| GaugeSample {
        codes: [0; 6],
        travel_um: 10 * at as i16 - 30,
    });
    let rows = GaugeRow::all(&Gauges {
        first_sample: 80,
        instant_us: 1_000_000,
        position_um: 500,
        samples,
    });
    // 500, then −20, −10, 0, 10 … further.
    let places = [500, 480, 470, 470, 480, 500, 530, 570];
    for (index, row) in rows.into_iter().enumerate() {
        assert_eq!(row.sample, 80 + index as u32);
        assert_eq!(row.instant_us, 1_000_000 + 1_000 * index as u64);
        assert_eq!(row.position_um, places[index]);
    }
}

#[test]
fn a_long_recording_goes_on_in_another_file_that_stands_for_itself() {
    let path = folder("parts").join("long.mcap");
    let recorder = Recorder::start(Settings {
        mcap: Some(path.clone()),
        part: Some(Duration::from_millis(1)),
        ..Settings::default()
    })
    .expect("a file can be made");
    let known = Event::StateChanged(host_bridge::state::State::Known(
        "/dev/ttyACM0".into(),
        Hello::new(Role::Sensor, "stm32f429zi", [0, 1, 0]),
    ));
    recorder.on_event(Role::Sensor, &known);
    let mut speaker = Speaker::new(9);
    let mut said = Vec::new();
    // A part ends with the first time that everything is made safe after its length.
    while !part_path(&path, 3).exists() {
        let message = speaker.message(Role::Sensor);
        recorder.on_event(Role::Sensor, &heard(message.clone()));
        said.push((Role::Sensor, message));
        std::thread::park_timeout(Duration::from_millis(5));
    }
    recorder.stop().expect("whole files");
    let mut read = Vec::new();
    let mut part = 1;
    while part_path(&path, part).exists() {
        let path = part_path(&path, part);
        let bytes = fs::read(&path).expect("the file can be read");
        let summary = Summary::read(&bytes)
            .expect("well-formed")
            .expect("there is one");
        assert!(
            summary
                .metadata_indexes
                .iter()
                .any(|index| index.name == "sensor")
        );
        let (entries, is_cut) = entries(&path).expect("a recording");
        assert!(!is_cut);
        // What was told of the board before comes first, and is no message of this part.
        let told = usize::from(part > 1);
        let messages = messages(events(&path));
        let count = entries
            .iter()
            .filter(|entry| !matches!(entry.row, Row::Link(_)))
            .count();
        assert!(messages.len() - count <= told);
        read.extend(messages.into_iter().skip(messages_told(part, count, &path)));
        part += 1;
    }
    assert_eq!(read, said);
}

/// How many messages a part plays that were said in an earlier one.
fn messages_told(part: u32, count: usize, path: &Path) -> usize {
    if part == 1 {
        0
    } else {
        messages(events(path)).len() - count
    }
}

#[test]
fn a_table_has_a_line_for_each_message_and_its_units_in_the_header() {
    let folder = folder("csv").join("made");
    let recorder = Recorder::start(Settings {
        csv: Some(folder.clone()),
        ..Settings::default()
    })
    .expect("a folder can be made");
    let mut speaker = Speaker::new(5);
    for block in 0..100 {
        recorder.on_event(Role::Sensor, &heard(speaker.gauges(block * 8)));
        recorder.on_event(Role::Display, &heard(speaker.motion()));
        recorder.on_event(Role::Sensor, &heard(speaker.estimate()));
        recorder.on_event(Role::Display, &heard(speaker.message(Role::Display)));
    }
    recorder.stop().expect("whole files");
    let lines = |name: &str| -> Vec<Vec<String>> {
        let text = fs::read_to_string(folder.join(name)).expect("the file can be read");
        let rows = text
            .lines()
            .map(|line| line.split(',').map(str::to_owned).collect());
        rows.collect()
    };
    let gauges = lines("sensor-gauges.csv");
    assert_eq!(
        gauges[0].join(","),
        "time_s,sample,block,instant_us,position_um,travel_um,g0_v,g1_v,g2_v,g3_v,g4_v,tangential_v"
    );
    let samples: Vec<u32> = gauges[1..]
        .iter()
        .map(|row| row[1].parse().expect("a number"))
        .collect();
    assert_eq!(samples, (0..800).collect::<Vec<_>>());
    for (name, least) in [
        ("sensor-estimate.csv", 100),
        ("display-motion.csv", 100),
        ("display-safety.csv", 1),
        ("display-status.csv", 1),
        ("display-configuration.csv", 1),
        ("display-clock.csv", 1),
    ] {
        let rows = lines(name);
        assert!(rows.len() > least, "{name}: {} lines", rows.len());
        assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{name}");
    }
    assert!(lines("sensor-estimate.csv")[0].contains(&"health_4".to_owned()));
    assert!(lines("display-status.csv")[0].contains(&"supervisor_trip".to_owned()));
    assert!(!folder.join("sensor-other.csv").exists());
}

#[test]
fn missing_samples_and_messages_are_counted_and_written_down() {
    let path = folder("gaps").join("gaps.mcap");
    let recorder = recorder(&path);
    let mut speaker = Speaker::new(6);
    for first in [0, 8, 40, 48] {
        recorder.on_event(Role::Sensor, &heard(speaker.gauges(first)));
    }
    recorder.on_event(Role::Sensor, &Event::Restarted);
    recorder.on_event(Role::Sensor, &heard(speaker.gauges(0)));
    let progress = recorder.stop().expect("a whole file");
    assert_eq!((progress.tally.gaps, progress.tally.lost), (1, 24));
    let (entries, _) = entries(&path).expect("a recording");
    let texts: Vec<_> = entries
        .iter()
        .filter_map(|entry| match &entry.row {
            Row::Link(link) => Some(link.text.0.as_str()),
            _ => None,
        })
        .collect();
    assert_eq!(texts, ["24 samples lost", "the board has started anew"]);
    // Right where they are missing.
    let gap = entries.iter().position(
        |entry| matches!(&entry.row, Row::Link(link) if link.lost == Some(Lost::Samples)),
    );
    let gap = gap.expect("it is told");
    let first = |at: usize| match &entries[at].row {
        Row::Gauges(row) => Some(row.first_sample),
        _ => None,
    };
    assert_eq!((first(gap - 1), first(gap + 1)), (Some(8), Some(40)));
    assert_eq!(entries[gap].log_ns, entries[gap + 1].log_ns);
}

#[test]
fn what_has_been_recorded_is_safe_within_a_second() {
    let path = folder("safe").join("safe.mcap");
    let recorder = recorder(&path);
    let mut speaker = Speaker::new(7);
    recorder.on_event(Role::Sensor, &heard(speaker.estimate()));
    assert!(wait_until(LIMIT, || recorder.progress().tally.messages == 1));
    let (read, is_cut) = entries(&path).expect("a recording");
    assert!(is_cut && read.len() == 1);
    drop(recorder);
    assert!(!entries(&path).expect("it is whole").1);
}
