//! Files that are cut off, damaged, of another kind, too long or in the way.

use super::*;

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
    assert!(
        matches!(error, scene::SceneError::TooLong { .. }),
        "{error}"
    );
    let words = error.to_string();
    assert!(words.contains("long.mcap: that is too long"), "{words}");
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
fn zeros_with_anything_behind_them_are_damage_and_no_end() {
    let folder = folder("zeros");
    let path = folder.join("zeros.mcap");
    record_gauges(&path, 40_000);
    let whole = fs::read(&path).expect("the file can be read");
    let summary = Summary::read(&whole)
        .expect("well-formed")
        .expect("there is one");
    let third = &summary.chunk_indexes[2];
    // Where a record begins: it looks as a file does that was cut off there.
    let begin = third.chunk_start_offset as usize;
    for length in [1, 9, 10, 4_096, whole.len() - begin - 1] {
        let mut bytes = whole.clone();
        bytes[begin..begin + length].fill(0);
        fs::write(&path, &bytes).expect("the file can be written");
        let Err(error) = entries(&path) else {
            panic!("{length} zeros are taken for an end");
        };
        let words = error.to_string();
        assert!(
            words.contains("zeros.mcap: damaged after /sensor/gauges at "),
            "{length}: {words}"
        );
    }
    // With nothing behind them they are what a file system left of an end.
    for length in [1, 9, 10, 4_096, 200_000] {
        let bytes = [&whole[..begin], &vec![0; length]].concat();
        fs::write(&path, &bytes).expect("the file can be written");
        let (_, is_cut) = entries(&path).unwrap_or_else(|error| panic!("{length}: {error}"));
        assert!(is_cut, "{length}");
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
    // In one line, without what the parser traces for its authors.
    let bytes = fs::read(&path).expect("the file can be read");
    let mut told = 0;
    for at in (8..bytes.len().min(2_000)).step_by(7) {
        let (before, after) = bytes.split_at(at);
        fs::write(&path, [before, &after[3..]].concat()).expect("the file can be written");
        if let Err(error) = entries(&path) {
            let error = error.to_string();
            assert_eq!(error.lines().count(), 1, "at {at}: {error}");
            assert!(!error.contains('\u{1b}'), "at {at}: {error:?}");
            told += 1;
        }
    }
    assert!(told > 100, "{told}");
}

#[test]
fn no_flipped_bit_of_a_chunks_head_loses_anything_unnoticed() {
    const BLOCKS: u32 = 4_000;
    let folder = folder("flipped");
    let path = folder.join("flipped.mcap");
    record_gauges(&path, BLOCKS);
    let bytes = fs::read(&path).expect("the file can be read");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    let index = summary.chunk_indexes.last().expect("there are some");
    let head = index.chunk_start_offset as usize;
    // Kind and length, times, sizes, checksum, and how it is compressed.
    let length = 9 + 16 + 8 + 4 + 4 + "zstd".len() + 8;
    for bit in 0..8 * length {
        let mut flipped = bytes.clone();
        flipped[head + bit / 8] ^= 1 << (bit % 8);
        fs::write(&path, &flipped).expect("the file can be written");
        if let Ok((read, false)) = entries(&path) {
            assert_eq!(read.len(), BLOCKS as usize, "bit {bit}");
        }
    }
}

#[test]
fn a_scene_is_made_of_what_lies_before_damage() {
    let folder = folder("before-damage");
    let path = folder.join("damaged.mcap");
    let mut bytes = fs::read(readers::golden("format-2-protocol-4.mcap")).expect("it is there");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    let last = summary.chunk_indexes.last().expect("there are some");
    bytes[(last.chunk_start_offset + last.chunk_length / 2) as usize] ^= 0x55;
    fs::write(&path, &bytes).expect("the file can be written");
    let made_to = |to_s: f64| scene_until(&path, to_s);
    // The damage lies between 4.13 s and the end.
    let made = made_to(3.0).unwrap_or_else(|error| panic!("{error}"));
    let scene = Scene::load(&made.path).unwrap_or_else(|error| panic!("{error}"));
    assert!((scene.duration_s - made.duration_s).abs() < 1e-9);
    assert!(made.duration_s >= 0.1 && !made.cut, "{made:?}");
    let error = made_to(4.9).expect_err("it is damaged before");
    let words = error.to_string();
    assert!(
        words.contains("damaged.mcap: damaged after /display/motion at 4.158 s: "),
        "{words}"
    );
    // What it advises works.
    let until_s = advised_s(&words);
    assert!(until_s > 4.0, "{words}");
    made_to(until_s).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn damage_beside_the_messages_is_told_with_how_to_have_them() {
    let path = folder("beside-messages").join("damaged.mcap");
    let mut bytes = fs::read(readers::golden("format-2-protocol-4.mcap")).expect("it is there");
    let summary = Summary::read(&bytes)
        .expect("well-formed")
        .expect("there is one");
    let first = summary.chunk_indexes.first().expect("there are some");
    // A time in the index behind a chunk, which who reads from the beginning needs not.
    bytes[(first.chunk_start_offset + first.chunk_length) as usize + 17] ^= 0x55;
    fs::write(&path, &bytes).expect("the file can be written");
    let words = entries(&path).expect_err("its sum is wrong").to_string();
    assert!(words.contains("some of it may be missing"), "{words}");
    let until_s = advised_s(&words);
    assert!(until_s > 4.1, "{words}");
    scene_until(&path, until_s).unwrap_or_else(|error| panic!("{error}"));
}

/// What a complaint advises to give as --to-time, in s.
fn advised_s(words: &str) -> f64 {
    let advised = words.split("can be had with --to-time ").nth(1);
    let until_s = advised.and_then(|time| time.parse().ok());
    until_s.unwrap_or_else(|| panic!("{words}"))
}

/// Makes a scene of a recording until then, in s, beside it.
fn scene_until(path: &Path, to_s: f64) -> Result<scene::Made, scene::SceneError> {
    let settings = scene::Settings {
        path: path.with_file_name("before.toml"),
        from_s: 1.0,
        to_s: Some(to_s),
        wavelength_mm: Some(2.0),
        expect: false,
        force: true,
    };
    let recording = Reader::open(path).expect("its beginning is whole");
    scene::write(recording, &settings)
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

    // And is no part, whatever it is called.
    fs::write(&path, "kept").expect("the file can be written");
    let error = Recorder::start(settings(true))
        .map(drop)
        .expect_err("there is another file");
    let words = error.to_string();
    assert!(
        words.contains("kept-2.mcap: would be in the way"),
        "{words}"
    );
    for kept in [&path, &part_path(&path, 2)] {
        assert_eq!(fs::read(kept).expect("still there"), b"kept");
        fs::remove_file(kept).expect("it can be removed");
    }

    // Parts go with the file that they were parts of, and nothing else does.
    let recorder = Recorder::start(Settings {
        part: Some(Duration::from_millis(1)),
        ..settings(false)
    });
    let recorder = recorder.expect("nothing is in the way");
    let has_begun = || part_path(&path, 2).exists();
    assert!(wait_until(LIMIT, has_begun), "there is no second part");
    recorder.stop().expect("a whole file");
    let other = folder.join("kept-x.mcap");
    fs::write(&other, "kept").expect("the file can be written");
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
