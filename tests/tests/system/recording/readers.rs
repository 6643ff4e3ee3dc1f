//! What reads a recording: the reference library, the readers of others, and every later version of ours.

use super::*;

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
    let Some((status, found, said)) = read_by_others(&[&path, &golden("format-2-protocol-4.mcap")])
    else {
        return;
    };
    assert_eq!(status, Some(0), "{said}");
    let line = format!("{}: /sensor/gauges: 40 messages\n", path.display());
    assert!(found.contains(&line), "{found}");
}

/// The script's exit status, and what it says on both outputs. None where Python or a package index is not within reach.
fn read_by_others(paths: &[&Path]) -> Option<(Option<i32>, String, String)> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.ci/read-mcap");
    let read = Command::new(script)
        .args(paths)
        .output()
        .expect("the script can be started");
    let [found, said] =
        [read.stdout, read.stderr].map(|said| String::from_utf8_lossy(&said).into_owned());
    if read.status.code() == Some(3) {
        eprintln!("{said}");
        return None;
    }
    Some((read.status.code(), found, said))
}

#[test]
fn to_the_readers_of_others_a_recording_is_whole_whose_board_is_said_to_have_started_anew() {
    let folder = folder("others-read-anew");
    for (is_said, status) in [(true, 0), (false, 1)] {
        let path = folder.join(format!("{is_said}.mcap"));
        let recorder = recorder(&path);
        let mut speaker = Speaker::new(23);
        let mut say = || {
            for block in 0..4 {
                recorder.on_event(
                    Role::Sensor,
                    &heard(speaker.gauges(block * GAUGE_BLOCK as u32)),
                );
            }
        };
        say();
        if is_said {
            recorder.on_event(Role::Sensor, &Event::Restarted);
        }
        say();
        recorder.stop().expect("a whole file");
        let Some((ended, found, said)) = read_by_others(&[&path]) else {
            return;
        };
        assert_eq!(ended, Some(status), "{said}");
        assert!(found.contains("/sensor/gauges: 8 messages"), "{found}");
    }
}

/// A recording that is kept with the tests: see the README beside them.
pub fn golden(name: &str) -> PathBuf {
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
