//! Tones in every format at every rate, and what is refused.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::io::Cursor;

use hound::{SampleFormat, WavSpec, WavWriter};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use ros2msg::{Definition, encode};

use crate::judge::outcome::Outcome;
use crate::native;
use crate::plant::surface::Surface;
use crate::plant::world::World;
use crate::scene::{Motion, Scene};
use crate::scene_file::tests::Folder;

mod hjif;
mod refused;

const SURFACE: &str = "duration_s = 2.0\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";

/// Mono, floats.
fn wav(rate_hz: u32, samples: impl Iterator<Item = f64>) -> Vec<u8> {
    let spec = WavSpec {
        channels: 1,
        sample_rate: rate_hz,
        bits_per_sample: 32,
        sample_format: SampleFormat::Float,
    };
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = WavWriter::new(&mut bytes, spec).unwrap();
    for sample in samples {
        writer.write_sample(sample as f32).unwrap();
    }
    writer.finalize().unwrap();
    bytes.into_inner()
}

/// JSON messages on `topic`, logged at their times in ns.
fn mcap(topic: &str, messages: impl Iterator<Item = (u64, String)>) -> Vec<u8> {
    let messages = messages.map(|(log_time, json)| (log_time, json.into_bytes()));
    mcap_as(topic, None, messages)
}

/// Messages of ROS 2 on `topic`, with the fields of these JSON objects.
fn ros_mcap(
    topic: &str,
    (name, text): (&str, &str),
    messages: impl Iterator<Item = (u64, String)>,
) -> Vec<u8> {
    let definition = Definition::parse(name, text).unwrap();
    let messages = messages.map(|(log_time, json)| {
        let mut cdr = Vec::new();
        encode(&definition, &serde_json::from_str(&json).unwrap(), &mut cdr).unwrap();
        (log_time, cdr)
    });
    mcap_as(topic, Some((name, text)), messages)
}

/// JSON, or messages of ROS 2 of a schema.
fn mcap_as(
    topic: &str,
    schema: Option<(&str, &str)>,
    messages: impl Iterator<Item = (u64, Vec<u8>)>,
) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    // Small chunks, so that a file that is cut off has some whole ones.
    let mut writer = WriteOptions::new()
        .chunk_size(Some(4_096))
        .create(&mut bytes)
        .unwrap();
    let other = writer
        .add_channel(0, "/other", "json", &BTreeMap::new())
        .unwrap();
    let (schema, encoding) = match schema {
        None => (0, "json"),
        Some((name, text)) => {
            let schema = writer.add_schema(name, "ros2msg", text.as_bytes());
            (schema.unwrap(), "cdr")
        }
    };
    let channel_id = writer
        .add_channel(schema, topic, encoding, &BTreeMap::new())
        .unwrap();
    for (sequence, (log_time, message)) in (0..).zip(messages) {
        for channel_id in [other, channel_id] {
            let header = MessageHeader {
                channel_id,
                sequence,
                log_time,
                publish_time: log_time,
            };
            let message = if channel_id == other {
                b"{}"
            } else {
                &*message
            };
            writer.write_to_known_channel(&header, message).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// A tone of 1 in each format, from 0.1 s before the scene to 0.1 s after it, and the section that reads it.
fn tone(rate_hz: u32, tone_hz: f64) -> [(&'static str, String, Vec<u8>); 4] {
    let rate = f64::from(rate_hz);
    let count = (2.2 * rate) as u32;
    let samples = move || {
        (0..count).map(move |row| {
            let t_s = f64::from(row) / rate - 0.1;
            (t_s, (TAU * tone_hz * t_s).sin())
        })
    };
    let kind = "[gauges]\nkind = \"recorded\"\nvolts_per_unit = 0.8\noffset_v = 1.6504\n";
    let csv: String = samples()
        .map(|(t_s, x)| format!("{t_s:.7};{x:.6};idle\n"))
        .collect();
    let epoch_ns = 1_700_000_000_000_000_000_u64;
    let messages = || {
        samples().map(|(t_s, x)| {
            let ns = epoch_ns + ((t_s + 0.1) * 1e9).round() as u64;
            (ns, format!("{{\"a\":{{\"v\":[0,{x}]}}}}"))
        })
    };
    let imu = "Pair a\n===\nMSG: test_msgs/Pair\nfloat64[2] v\n";
    let section = |name: &str| {
        format!(
            "{kind}file = \"{name}\"\nstart_s = 0.1\ntopic = \"/imu\"\nchannels = [\"a.v.1\", \"a.v.1\", \"a.v.1\", \"a.v.1\", \"a.v.1\"]\n"
        )
    };
    [
        (
            "tone.csv",
            format!("{kind}file = \"tone.csv\"\ntime = \"seconds\"\nchannels = [1, 1, 1, 1, 1]\n"),
            format!("seconds;volts;note\n{csv}").into_bytes(),
        ),
        (
            "tone.wav",
            format!("{kind}file = \"tone.wav\"\nstart_s = 0.1\n"),
            wav(rate_hz, samples().map(|(_, x)| x)),
        ),
        ("tone.mcap", section("tone.mcap"), mcap("/imu", messages())),
        (
            "ros.mcap",
            section("ros.mcap"),
            ros_mcap("/imu", ("test_msgs/msg/Imu", imu), messages()),
        ),
    ]
}

/// Gauge 3 in V at each scan of the second from 0.5 s on.
fn volts(scene: &Scene) -> Vec<f64> {
    let mut world = World::new(scene).unwrap();
    (2_000..6_000)
        .map(|scan| {
            let codes = world.codes(f64::from(scan) / 4_000.0, 0.0);
            assert!(codes[..5].iter().all(|code| *code == codes[3]));
            // The ADC rounds down: half a step more.
            (f64::from(codes[3]) + 0.5) * 3.3 / 4_096.0 - 1.6504
        })
        .collect()
}

/// Amplitude, and phase in rad against the tone that was recorded.
fn amplitude(volts: &[f64], tone_hz: f64) -> (f64, f64) {
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (volt, scan) in volts.iter().zip(2_000..) {
        let phase = TAU * tone_hz * f64::from(scan) / 4_000.0;
        sine += volt * phase.sin();
        cosine += volt * phase.cos();
    }
    let scale = 2.0 / volts.len() as f64;
    ((sine * scale).hypot(cosine * scale), cosine.atan2(sine))
}

#[test]
fn a_tone_at_any_rate_in_any_format_comes_out_at_the_adc_as_it_was() {
    let folder = Folder::new("tone", SURFACE);
    // Whole numbers of cycles in the second that is looked at; prime, so that the ADC's steps are met evenly.
    for (rate_hz, tone_hz) in [
        (1_000, 59.0),
        (1_000, 463.0),
        (2_500, 61.0),
        (2_500, 1_153.0),
        (8_000, 67.0),
        (8_000, 1_877.0),
        (44_100, 71.0),
        (48_000, 1_871.0),
    ] {
        for (file, section, bytes) in tone(rate_hz, tone_hz) {
            let scene = folder.load(&section, file, &bytes).unwrap();
            let (volts, phase_rad) = amplitude(&volts(&scene), tone_hz);
            let db = 20.0 * (volts / 0.8).log10();
            // The resampler's 0.01 dB, and as much again for the converter's steps: 0.23 mV rms of noise in
            // 4000 scans leave 5 µV. A µs is 0.4 mrad at 59 Hz and 12 mrad at 1877 Hz.
            assert!(
                db.abs() < 0.02,
                "{file}, {tone_hz} Hz at {rate_hz}: {db} dB"
            );
            let shift_us = 1e6 * phase_rad / (TAU * tone_hz);
            assert!(
                shift_us.abs() < 0.5,
                "{file}, {tone_hz} Hz at {rate_hz}: {shift_us} µs"
            );
        }
    }
}

#[test]
fn a_tone_above_half_the_adcs_rate_does_not_come_out() {
    let folder = Folder::new("above", SURFACE);
    for (rate_hz, tone_hz) in [(8_000, 2_100.0), (44_100, 4_025.0), (48_000, 3_975.0)] {
        for (file, section, bytes) in tone(rate_hz, tone_hz) {
            let scene = folder.load(&section, file, &bytes).unwrap();
            // No code changes: less than 0.4 mV of 0.8 V is left, 66 dB down. Straight lines would leave a
            // tone at 25 Hz.
            let volts = volts(&scene);
            assert!(
                volts.iter().all(|volt| *volt == volts[0]),
                "{file} at {rate_hz}"
            );
        }
    }
}

#[test]
fn integers_of_any_width_are_shares_of_full_scale() {
    let folder = Folder::new("integers", SURFACE);
    for bits in [8, 16, 24, 32] {
        let spec = WavSpec {
            channels: 2,
            sample_rate: 4_000,
            bits_per_sample: bits,
            sample_format: SampleFormat::Int,
        };
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = WavWriter::new(&mut bytes, spec).unwrap();
        for _ in 0..8_000 {
            writer.write_sample(1_i32 << (bits - 2)).unwrap();
            writer.write_sample(-(1_i32 << (bits - 2))).unwrap();
        }
        writer.finalize().unwrap();
        let section =
            "[gauges]\nkind = \"recorded\"\nfile = \"x.wav\"\nchannels = [0, 1, 0, 1, 0, 1]\n";
        let scene = folder.load(section, "x.wav", &bytes.into_inner()).unwrap();
        assert!(scene.force.present);
        // 1.65 V ± half of 1 V.
        let mut world = World::new(&scene).unwrap();
        assert_eq!(world.codes(1.0, 0.0), [2668, 1427, 2668, 1427, 2668, 1427]);
    }
}

#[test]
fn what_else_a_wav_file_holds_is_passed_over_whatever_its_length() {
    let folder = Folder::new("chunks", SURFACE);
    let section = "[gauges]\nkind = \"recorded\"\nfile = \"x.wav\"\n";
    let plain = wav(4_000, (0..8_800).map(|_| 0.5));
    let data = plain.windows(4).position(|name| name == b"data").unwrap();
    for length in [3_u8, 4] {
        let mut bytes = plain.clone();
        // A byte pads what is of odd length.
        let mut chunk = [b"LIST", &[length, 0, 0, 0][..], b"abcd"].concat();
        chunk[11] *= u8::from(length == 4);
        bytes.splice(data..data, chunk);
        let scene = folder.load(section, "x.wav", &bytes).unwrap();
        let mut world = World::new(&scene).unwrap();
        assert_eq!(world.codes(1.0, 0.0)[..5], [2668; 5], "{length}");
    }
}

#[test]
fn our_own_recordings_are_read_without_a_word_about_their_columns() {
    let folder = Folder::new("own", SURFACE);
    let rows = (0..2_100_u64).map(|sample| {
        let json = format!(
            "{{\"sample\":{sample},\"block\":0,\"instant_us\":{},\"position_um\":{},\"travel_um\":50,\"g0_v\":0.5,\"g1_v\":0.825,\"g2_v\":1.0,\"g3_v\":1.5,\"g4_v\":2.5,\"tangential_v\":2.475}}",
            7_000_000 + 1_000 * sample,
            50 * sample,
        );
        // They come eight at a time.
        (1_000_000 * (sample / 8 * 8) + sample, json)
    });
    let bytes = mcap("/sensor/gauges", rows);
    let section = "[motion]\nkind = \"recorded\"\nfile = \"bench.mcap\"\n[gauges]\nkind = \"recorded\"\nfile = \"bench.mcap\"\n";
    let scene = folder.load(section, "bench.mcap", &bytes).unwrap();
    assert!((scene.motion.position_mm(1.5) - 75.0).abs() < 1e-9);
    assert!((scene.motion.velocity_mm_s(1.5) - 50.0).abs() < 1e-6);
    let mut world = World::new(&scene).unwrap();
    assert_eq!(world.codes(1.0, 0.0), [620, 1024, 1241, 1861, 3103, 2048]);
    let wired = folder
        .load(
            &format!("{section}tangential = true\n"),
            "bench.mcap",
            &bytes,
        )
        .unwrap();
    assert_eq!(World::new(&wired).unwrap().codes(1.0, 0.0)[5], 3072);
    // Half of it is missing: what is there is read.
    let cut = &bytes[..bytes.len() / 2];
    let refusal = folder.refusal(section, "bench.mcap", cut);
    assert!(
        refusal.starts_with("x.toml:6: motion.file: lasts from 0 to 1."),
        "{refusal}"
    );
}

#[test]
fn the_wavelength_of_a_recorded_tone_is_estimated() {
    let folder = Folder::new("estimate", SURFACE);
    // 50 mm/s over ridges of 2 mm: 25 Hz.
    let bytes = wav(
        44_100,
        (0..88_200).map(|row| {
            let cycles = 25.0 * f64::from(row) / 44_100.0;
            0.5 * (TAU * cycles).sin() + 0.1 * (TAU * 3.0 * cycles).sin()
        }),
    );
    let section = "[gauges]\nkind = \"recorded\"\nfile = \"ridges.wav\"\n";
    let scene = folder.load(section, "ridges.wav", &bytes).unwrap();
    let recording = native::run(&scene).unwrap();
    let summary = Outcome::new(scene, recording).verdict.summary;
    // As good as the computed gauges without noise, of Table I.
    assert!(
        summary.rms_percent.is_some_and(|rms| rms < 0.5),
        "{summary:?}"
    );
    assert!(
        summary.valid_share.is_some_and(|share| share > 0.9),
        "{summary:?}"
    );
}

#[test]
fn heights_finer_than_the_surface_is_stored_are_band_limited() {
    let folder = Folder::new("heights", SURFACE);
    // A sine of 2 mm, and ripples of 0.0208 mm that points 0.02 mm apart would take for 0.52 mm.
    let heights = || {
        (0..120_000).map(|row| {
            let x_mm = f64::from(row) * 0.001 - 5.0;
            (x_mm, (TAU * x_mm / 2.0).sin() + (TAU * x_mm / 0.0208).sin())
        })
    };
    let csv: String = heights()
        .map(|(x_mm, h)| format!("{:.0},{h}\n", 1e3 * x_mm))
        .collect();
    let mcap_rows = heights().map(|(x_mm, h)| (1, format!("{{\"x_mm\":{x_mm:.3},\"z\":{h}}}")));
    for (file, keys, bytes) in [
        (
            "h.csv",
            "channels = [\"z\"]\nplace = \"x_um\"\nplace_mm_per_unit = 1e-3\n",
            format!("x_um,z\n{csv}").into_bytes(),
        ),
        (
            "h.wav",
            "mm_per_sample = 0.001\nshift_mm = -5\n",
            wav(44_100, heights().map(|(_, h)| h)),
        ),
        (
            "h.mcap",
            "topic = \"/h\"\nchannels = [\"z\"]\nplace = \"x_mm\"\n",
            mcap("/h", mcap_rows),
        ),
    ] {
        let scene = folder
            .load(
                &format!("profile = \"recorded\"\nfile = \"{file}\"\n{keys}"),
                file,
                &bytes,
            )
            .unwrap();
        let surface = Surface::new(&scene.surface, 0.0);
        for step in 0..1_000 {
            let x_mm = f64::from(step) * 0.1;
            // Straight lines between points 0.02 mm apart are off by (2π · 0.02/2)²/8 = 5e-4; the ends' part of
            // a period changes the scale by 1 %.
            let off = f64::from(surface.feel(x_mm, 0)) - (TAU * x_mm / 2.0).sin();
            assert!(off.abs() < 0.012, "{file}: {off} at {x_mm}");
        }
    }
}

#[test]
fn a_hand_is_read_from_wav_too() {
    let folder = Folder::new("hand", SURFACE);
    let bytes = wav(
        48_000,
        (0..100_000).map(|row| f64::from(row) / 48_000.0 / 4.0),
    );
    let section =
        "[motion]\nkind = \"recorded\"\nfile = \"x.wav\"\nmm_per_unit = 200\noffset_mm = 3\n";
    let scene = folder.load(section, "x.wav", &bytes).unwrap();
    let Motion::Recorded(rows) = &scene.motion else {
        panic!("not recorded")
    };
    assert!(rows.at.len() < 8_400);
    for t_s in [0.5, 1.0, 1.2345] {
        assert!((scene.motion.position_mm(t_s) - 3.0 - 50.0 * t_s).abs() < 1e-4);
    }
}

#[test]
fn volts_are_band_limited_between_their_rows_unless_straight_lines_are_asked_for() {
    let folder = Folder::new("lines", SURFACE);
    let code = |step_s: f64, keys: &str| {
        let rows: String = (0..=(2.0 / step_s) as u32)
            .map(|row| {
                let volts = f64::from(row % 2);
                let t_s = f64::from(row) * step_s;
                format!("{t_s},{volts},{volts},{volts},{volts},{volts}\n")
            })
            .collect();
        let section = format!("[gauges]\nkind = \"recorded\"\nfile = \"x.csv\"\n{keys}");
        let csv = format!("t_s,g0,g1,g2,g3,g4\n{rows}");
        let scene = folder.load(&section, "x.csv", csv.as_bytes()).unwrap();
        World::new(&scene).unwrap().codes(1.00025, 0.0)[0]
    };
    // A quarter of the way from 0 to 1 V and back, on a cosine: (1 − cos 45°)/2 V.
    assert_eq!(code(1e-3, ""), 181);
    assert_eq!(code(1e-3, "interpolation = \"band-limited\"\n"), 181);
    assert_eq!(code(1e-3, "interpolation = \"lines\"\n"), 310);
    // An eighth of the way, and denser than the ADC can follow.
    assert_eq!(code(2e-3, ""), 47);
    assert_eq!(code(125e-6, ""), 620);
    assert_eq!(code(125e-6, "interpolation = \"lines\"\n"), 0);
}
