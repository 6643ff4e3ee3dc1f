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

/// Records `blocks` blocks of samples.
fn record_gauges(path: &Path, blocks: u32) {
    let recorder = recorder(path);
    let mut speaker = Speaker::new(3);
    for block in 0..blocks {
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

/// What the reference library makes of the file as a whole, by topic.
fn counts(path: &Path) -> BTreeMap<String, u64> {
    let bytes = fs::read(path).expect("the file can be read");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    let stats = summary.stats.expect("there are some");
    let mut counts = BTreeMap::new();
    for message in MessageStream::new(&bytes).expect("a whole file") {
        let message = message.expect("well-formed");
        *counts.entry(message.channel.topic.clone()).or_insert(0) += 1;
        let schema = message.channel.schema.as_ref().expect("a schema");
        assert_eq!(
            (&*schema.encoding, &*message.channel.message_encoding),
            ("ros2msg", "cdr")
        );
        assert_eq!(message.log_time, message.publish_time);
    }
    assert_eq!(stats.message_count, counts.values().sum::<u64>());
    counts
}

#[test]
fn the_reference_library_reads_it_with_a_schema_for_each_channel() {
    let path = folder("reference").join("reference.mcap");
    record_gauges(&path, 5_000);
    assert_eq!(
        counts(&path),
        BTreeMap::from([("/sensor/gauges".to_owned(), 5_000)])
    );
    let bytes = fs::read(&path).expect("the file can be read");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    assert_eq!(summary.channels.len(), 19);
    for schema in summary.schemas.values() {
        let text = str::from_utf8(&schema.data).expect("UTF-8");
        let definition = Definition::parse(&schema.name, text)
            .unwrap_or_else(|error| panic!("{}: {error}", schema.name));
        assert!(!definition.fields.is_empty());
    }
    let schema_of = |topic: &str| {
        let mut channels = summary.channels.values();
        let channel = channels.find(|channel| channel.topic == topic);
        let schema = channel.and_then(|channel| channel.schema.clone());
        let schema = schema.expect("a schema");
        let text = String::from_utf8_lossy(&schema.data).into_owned();
        (schema.name.clone(), text)
    };
    let (name, text) = schema_of("/sensor/estimate");
    assert_eq!(name, "ridgelink_msgs/msg/Estimate");
    // Descriptions with units, a flag for what may be missing, words for numbers.
    for part in [
        "# Surface wavelength λ in mm, if the estimator has one; always finite and above 0.\n\
         bool has_wavelength_mm\nfloat32 wavelength_mm\n",
        "uint8 CONTACT_STICK_SLIP=3  # Stick and slip in turn",
        "uint8 contact\n",
        "uint8 HEALTH_HUM=5  # Carries more mains hum than signal.\nuint8[5] health\n",
    ] {
        assert!(text.contains(part), "{part:?} is not in {text}");
    }
    let (name, text) = schema_of("/display/log");
    assert_eq!(name, "rcl_interfaces/msg/Log");
    assert!(text.contains("byte WARN=30\n"), "{text}");
    assert!(text.contains("MSG: builtin_interfaces/Time\n"), "{text}");
}

#[test]
fn a_line_of_a_firmwares_log_is_one_of_ros() {
    let path = folder("log").join("log.mcap");
    let recorder = recorder(&path);
    recorder.on_log(Role::Display, Some("warn"), "the link is slow".to_owned());
    recorder.on_log(Role::Display, None, "printed".to_owned());
    recorder.stop().expect("a whole file");
    let (entries, _) = entries(&path).expect("a recording");
    let lines: Vec<_> = entries
        .iter()
        .map(|entry| match &entry.row {
            Row::Log(log) => {
                let stamp_ns = u64::from(log.stamp.sec.unsigned_abs()) * 1_000_000_000
                    + u64::from(log.stamp.nanosec);
                assert_eq!(stamp_ns, entry.log_ns);
                (log.level, log.name.0.as_str(), log.msg.0.as_str())
            }
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(
        lines,
        [
            (30, "display", "the link is slow"),
            (20, "display", "printed")
        ]
    );
}

/// Others' readers, where Python and a package index are within reach.
#[test]
fn the_readers_of_others_find_every_message_once_and_the_same_values() {
    let path = folder("others-read").join("everything.mcap");
    let recorder = recorder(&path);
    let mut speakers = [
        (Role::Sensor, Speaker::new(21)),
        (Role::Display, Speaker::new(22)),
    ];
    for turn in 0..400 {
        for (role, speaker) in &mut speakers {
            let message = match (turn % 10, *role) {
                (3, Role::Sensor) => speaker.gauges(turn / 10 * GAUGE_BLOCK as u32),
                (7, _) => speaker.oddity(),
                (_, role) => speaker.message(role),
            };
            recorder.on_event(*role, &heard(message));
        }
    }
    recorder.on_log(Role::Sensor, Some("error"), "λ is gone".to_owned());
    recorder.on_counters(Role::Sensor, PortCounters::new());
    recorder.stop().expect("a whole file");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.ci/read-mcap");
    let read = Command::new(script)
        .arg(&path)
        .args([golden("format-2-protocol-4.mcap")])
        .output()
        .expect("the script can be started");
    let said = String::from_utf8_lossy(&read.stderr);
    if read.status.code() == Some(3) {
        eprintln!("{said}");
        return;
    }
    assert!(read.status.success(), "{said}");
    let found = String::from_utf8_lossy(&read.stdout);
    let line = format!("{}: /sensor/gauges: 40 messages\n", path.display());
    assert!(found.contains(&line), "{found}");
}

/// A recording that is kept with the tests: see the README beside them.
fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("golden")
        .join(name)
}

#[test]
fn recordings_of_every_format_and_protocol_are_read() {
    // Channel, and how many of it there are.
    let old = [
        ("clock", 10),
        ("configuration", 5),
        ("estimate", 32),
        ("gauges", 39),
        ("line", 10),
        ("link", 4),
        ("motion", 158),
        ("safety", 1),
    ];
    let new = [
        ("clock", 10),
        ("configuration", 4),
        ("estimate", 40),
        ("gauges", 50),
        ("line", 10),
        ("link", 4),
        ("motion", 203),
        ("safety", 1),
    ];
    // Four times a sensor of protocol 3 told how it was configured, which this version has no words for.
    let mut older = old;
    older[1].1 = 1;
    for (name, counts, passed_over, sample, position_um) in [
        ("format-1-protocol-3.mcap", older, 4, 159, 4_680),
        ("format-1-protocol-4.mcap", old, 0, 159, 4_680),
        ("format-2-protocol-4.mcap", new, 0, 144, 3_905),
    ] {
        let mut reader = Reader::open(&golden(name)).unwrap_or_else(|error| panic!("{error}"));
        let mut found = BTreeMap::new();
        let mut first = None;
        while let Some(entry) = reader
            .next_entry()
            .unwrap_or_else(|error| panic!("{error}"))
        {
            *found.entry(entry.row.kind().name()).or_insert(0) += 1;
            if let Row::Gauges(row) = entry.row {
                first.get_or_insert(row);
            }
        }
        assert_eq!(found, BTreeMap::from(counts), "{name}");
        assert_eq!(
            (reader.passed_over(), reader.is_cut()),
            (passed_over, false)
        );
        let first = first.expect("there are samples");
        assert_eq!(
            (first.first_sample, first.position_um),
            (sample, position_um),
            "{name}"
        );

        // The simulator reads the same file for itself.
        let path = folder("golden").join("golden.toml");
        let settings = scene::Settings {
            path: path.clone(),
            from_s: 1.0,
            to_s: None,
            wavelength_mm: Some(2.0),
            expect: false,
            force: true,
        };
        let recording = Reader::open(&golden(name)).expect("it was read");
        let made = scene::write(recording, &settings).unwrap_or_else(|error| panic!("{error}"));
        assert!(made.duration_s >= 0.1, "{made:?}");
        let scene = Scene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!((scene.duration_s - made.duration_s).abs() < 1e-9);
    }
}

#[test]
fn a_recording_that_is_too_long_for_a_scene_is_refused_before_it_is_read_to_its_end() {
    let folder = folder("too-long");
    let path = folder.join("long.mcap");
    record_gauges(&path, 100_000);
    let mut bytes = fs::read(&path).expect("the file can be read");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    let last = summary.chunk_indexes.last().expect("there are some");
    let middle = last.chunk_start_offset + last.chunk_length / 2;
    bytes[middle as usize] ^= 0x55;
    fs::write(&path, &bytes).expect("the file can be written");
    let settings = scene::Settings {
        path: folder.join("long.toml"),
        from_s: 0.0,
        to_s: None,
        wavelength_mm: Some(2.0),
        expect: false,
        force: false,
    };
    let recording = Reader::open(&path).expect("its beginning is whole");
    let error = scene::write(recording, &settings).expect_err("800 s are too long");
    assert!(matches!(error, scene::SceneError::TooLong), "{error}");
}

#[test]
fn a_file_cut_off_anywhere_is_read_up_to_its_last_whole_chunk() {
    let folder = folder("cut");
    let path = folder.join("whole.mcap");
    record_gauges(&path, 40_000);
    let bytes = fs::read(&path).expect("the file can be read");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    // A chunk's end, and the messages up to it.
    let mut chunks: Vec<(usize, usize)> = Vec::new();
    let mut messages = 0;
    for index in &summary.chunk_indexes {
        // The first one holds the schemas and no message.
        if !index.message_index_offsets.is_empty() {
            let indexes = summary
                .read_message_indexes(&bytes, index)
                .expect("indexes");
            messages += indexes.values().map(Vec::len).sum::<usize>();
        }
        let end = index.chunk_start_offset + index.chunk_length;
        chunks.push((end as usize, messages));
    }
    assert!(chunks.len() > 5, "{} chunks", chunks.len());
    let (whole, is_cut) = entries(&path).expect("a whole file");
    assert_eq!((whole.len(), is_cut), (40_000, false));

    // Behind the record that says whose it is, which is there from the first moment on.
    let start =
        summary.metadata_indexes[0].offset as usize + summary.metadata_indexes[0].length as usize;
    let mut places: Vec<usize> = chunks
        .iter()
        .flat_map(|&(end, _)| [end - 1, end, end + 1])
        .collect();
    let mut state = 1_u64;
    places.extend((0..8).map(|_| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        start + (state >> 33) as usize % (bytes.len() - 1 - start)
    }));
    let cut = folder.join("cut.mcap");
    for place in places.into_iter().filter(|&place| place >= start) {
        fs::write(&cut, &bytes[..place]).expect("a file can be written");
        let kept = chunks.iter().rev().find(|&&(end, _)| end <= place);
        let kept = kept.map_or(0, |&(_, messages)| messages);
        let (read, is_cut) = entries(&cut).unwrap_or_else(|error| panic!("at {place}: {error}"));
        assert!(is_cut, "at {place}");
        assert_eq!(read.len(), kept, "at {place}");
        assert!(read.iter().zip(&whole).all(|(read, whole)| read == whole));
        // What a file system may leave of a file that it had no time for.
        fs::write(&cut, [&bytes[..place], &[0; 4_096]].concat()).expect("a file can be written");
        if let Ok((read, is_cut)) = entries(&cut) {
            assert!(is_cut && read.len() == kept, "at {place}, with zeros");
        }
    }
}

#[test]
fn damage_is_named_with_file_channel_and_time() {
    let folder = folder("damage");
    let path = folder.join("damaged.mcap");
    record_gauges(&path, 30_000);
    let mut bytes = fs::read(&path).expect("the file can be read");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    let third = &summary.chunk_indexes[2];
    let middle = third.chunk_start_offset + third.chunk_length / 2;
    bytes[middle as usize] ^= 0x55;
    fs::write(&path, &bytes).expect("the file can be written");
    let mut reader = Reader::open(&path).expect("its beginning is whole");
    let mut count = 0;
    let error = loop {
        match reader.next_entry() {
            Ok(Some(_)) => count += 1,
            Ok(None) => panic!("damage is no end"),
            Err(error) => break error.to_string(),
        }
    };
    assert!(count > 1_000, "{count}");
    let start = format!("{}: damaged after /sensor/gauges at ", path.display());
    assert!(error.starts_with(&start), "{error}");
}

#[test]
fn other_files_are_refused_by_what_they_are() {
    let folder = folder("others");
    let refusal = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        fs::write(&path, bytes).expect("the file can be written");
        let error = Reader::open(&path).map(drop).expect_err("no recording");
        error
            .to_string()
            .replace(&format!("{}/", folder.display()), "")
    };
    let foreign = {
        let mut out = std::io::Cursor::new(Vec::new());
        let mut writer = mcap::WriteOptions::new()
            .profile("ros2")
            .library("rosbag")
            .create(&mut out)
            .expect("memory takes it");
        writer.finish().expect("memory takes it");
        drop(writer);
        out.into_inner()
    };
    for (name, bytes, want) in [
        (
            "text.mcap",
            &b"t_s,x_mm\n0,0\n"[..],
            "text.mcap: is no MCAP file: give an MCAP file that",
        ),
        (
            "empty.mcap",
            b"",
            "empty.mcap: ends before anything was recorded: give",
        ),
        (
            "ros.mcap",
            &foreign,
            "ros.mcap: was made by another program (rosbag): give",
        ),
    ] {
        let refusal = refusal(name, bytes);
        assert!(refusal.starts_with(want), "{refusal}");
    }
    let absent = Reader::open(&folder.join("absent.mcap"))
        .map(drop)
        .expect_err("absent");
    assert!(
        absent
            .to_string()
            .contains("absent.mcap: can't be read: No such file")
    );
    let no_file = Reader::open(&folder).map(drop).expect_err("a folder");
    assert!(no_file.to_string().contains("can't be read"), "{no_file}");
}

#[test]
fn what_is_there_already_is_left_alone_unless_forced() {
    let folder = folder("exists");
    let path = folder.join("kept.mcap");
    fs::write(&path, "kept").expect("the file can be written");
    let settings = |force| Settings {
        mcap: Some(path.clone()),
        force,
        part: Some(Duration::from_secs(60)),
        ..Settings::default()
    };
    let error = Recorder::start(settings(false))
        .map(drop)
        .expect_err("it is there");
    assert!(
        matches!(&error, RecordingError::Exists(at) if *at == path),
        "{error}"
    );
    assert_eq!(fs::read(&path).expect("still there"), b"kept");
    let recorder = Recorder::start(settings(true)).expect("it may be written over");
    recorder.stop().expect("a whole file");
    assert_eq!(entries(&path).expect("a recording").0.len(), 0);

    // What would be in the way in hours.
    fs::remove_file(&path).expect("it can be removed");
    fs::write(part_path(&path, 2), "kept").expect("the file can be written");
    let error = Recorder::start(settings(false))
        .map(drop)
        .expect_err("a later part is there");
    assert!(
        error.to_string().contains("kept-2.mcap: is there already"),
        "{error}"
    );

    // They go with the file that they were parts of, and nothing else does.
    let other = folder.join("kept-x.mcap");
    fs::write(&other, "kept").expect("the file can be written");
    fs::write(&path, "kept").expect("the file can be written");
    let recorder = Recorder::start(settings(true)).expect("it may be written over");
    recorder.stop().expect("a whole file");
    assert!(!part_path(&path, 2).exists() && other.exists());

    let csv = Settings {
        csv: Some(folder.clone()),
        ..Settings::default()
    };
    let error = Recorder::start(csv)
        .map(drop)
        .expect_err("the folder is not empty");
    assert!(matches!(error, RecordingError::Exists { .. }), "{error}");
}

#[test]
fn nothing_old_goes_where_nothing_new_can_begin() {
    let folder = folder("nothing-begins");
    let path = folder.join("kept.mcap");
    let part = part_path(&path, 2);
    fs::write(&path, "kept").expect("the file can be written");
    fs::write(&part, "kept").expect("the file can be written");
    let error = Recorder::start(Settings {
        mcap: Some(path.clone()),
        csv: Some("/proc/no-place".into()),
        force: true,
        part: None,
    })
    .map(drop)
    .expect_err("there is no such place");
    assert!(matches!(error, RecordingError::NotMade { .. }), "{error}");
    for kept in [&path, &part] {
        assert_eq!(fs::read(kept).expect("still there"), b"kept");
    }
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 2);
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
