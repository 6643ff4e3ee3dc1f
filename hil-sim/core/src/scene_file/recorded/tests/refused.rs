//! What cannot be read.

use super::*;
use crate::scene_file::tests::refusals;

const GAUGES: &str = "[gauges]\nkind = \"recorded\"\nfile = \"f\"\n";

#[test]
fn the_end_of_a_long_recording_goes_on_for_no_longer_than_a_short_ones() {
    let folder = Folder::new("long", SURFACE);
    // At 1 kHz, 40 ms less than the scene's 2 s, behind so many s.
    for (start_s, from) in [(0, "0"), (300, "-300")] {
        let section = format!("{GAUGES}start_s = {start_s}\n");
        let rows = (0..1_000 * start_s + 1_960).map(|_| 0.0);
        let refusal = folder.refusal(&section, "f", &wav(1_000, rows));
        let want = format!("x.toml:6: gauges.file: lasts from {from} to 1.959");
        assert!(refusal.starts_with(&want), "{refusal}");
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_its_place_and_a_way_out() {
    let folder = Folder::new("refused", SURFACE);
    let tone = wav(8_000, (0..20_000).map(|_| 0.0));
    let stereo = {
        let spec = WavSpec {
            channels: 2,
            sample_rate: 8_000,
            bits_per_sample: 16,
            sample_format: SampleFormat::Int,
        };
        let mut bytes = Cursor::new(Vec::new());
        WavWriter::new(&mut bytes, spec)
            .unwrap()
            .finalize()
            .unwrap();
        bytes.into_inner()
    };
    let loud = wav(
        8_000,
        (0..20_000).map(|row| if row == 77 { 9.0 } else { 0.0 }),
    );
    let own = mcap(
        "/imu",
        (0..9).map(|n| (n, "{\"ax\":1,\"b\":{\"c\":2}}".to_owned())),
    );
    let slow: String = (0..300)
        .map(|row| format!("{},1,1,1,1,1\n", f64::from(row) / 100.0))
        .collect();
    let gap: String = (0..1_500)
        .map(|row| {
            format!(
                "{},1,1,1,1,1\n",
                f64::from(row + u32::from(row > 700)) / 500.0
            )
        })
        .collect();
    // Rate and bytes a second.
    let mut unpaced = tone.clone();
    unpaced[24..32].fill(0);
    let header = "t_s,g0,g1,g2,g3,g4\n";
    let refused = |bytes: &[u8], table: &str| {
        for (keys, want) in refusals(table) {
            let refusal = folder.refusal(&format!("{GAUGES}{keys}\n"), "f", bytes);
            assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
        }
    };
    refused(
        &stereo,
        r#"
        => x.toml:4: gauges.channels: is missing: the file has 2 channels
        channels = [0, 1, 2, 0, 0] => x.toml:7: gauges.channels: 2 is no channel of the WAV file: give numbers from 0 to 1
        channels = [0, 1] => x.toml:7: gauges.channels: names 2 channels
        channels = [0, 1, 0, 1, -1] => x.toml:7: gauges.channels[4]: -1 is no column
        channels = [0, 0, 0, 0, 0] => f: 0 row(s) of numbers
        "#,
    );
    refused(&tone[..tone.len() - 6], "=> f: sample 19998");
    refused(&tone[..20], "=> f: cannot be read as WAV");
    refused(
        &tone,
        r#"
        rate_hz = 8000 => x.toml:7: gauges.rate_hz: a WAV file has none but its own
        topic = "/x" => x.toml:7: gauges.topic: the file is no MCAP
        start_s = 2 => x.toml:6: gauges.file: lasts from -2 to 0.49
        volts_per_unit = 0 => x.toml:7: gauges.volts_per_unit: 0 is not a scale
        "#,
    );
    refused(
        &loud,
        "=> f: sample 77 (0.009625 s), channel 0: 9 makes 10.650 V, which no ADC pin bears",
    );
    refused(
        &own,
        r#"
        => f: has no messages on /sensor/gauges: give topic as one of /imu, /other
        topic = "/imu" => x.toml:4: gauges.channels: is missing: name the messages' fields
        topic = "/imu"; channels = ["ay", "ay", "ay", "ay", "ay"] => f: message 0 of /imu, field ay: is no number there: there are ax, b.c
        topic = "/imu"; channels = [1, 1, 1, 1, 1] => x.toml:8: gauges.channels: 1 is a number: name
        "#,
    );
    refused(
        &own,
        r#"topic = "/imu"; channels = ["ax", "ax", "ax", "ax", "ax"]; logged_from_s = 100 => f: has messages on /imu from 0 to "#,
    );
    refused(&own[..30], "=> f: ");
    refused(
        &unpaced,
        "=> f: its head says 0 samples a second: give a file that says its rate",
    );
    refused(
        b"w,t,w\n0,1,2\n",
        r#"channels = ["w", "w", "w", "w", "w"]; rate_hz = 1000 => x.toml:7: gauges.channels: "w" is the name of 2 columns: give numbers, from 0 on"#,
    );
    refused(
        b"t,t,w\n0,1,2\n",
        r#"channels = ["w", "w", "w", "w", "w"]; time = "t" => x.toml:8: gauges.time: "t" is the name of 2 columns"#,
    );
    refused(
        format!("{header}0,1,1,1,1,1\n").as_bytes(),
        "time_s_per_unit = 1 => x.toml:7: gauges.time_s_per_unit: is no column's",
    );
    refused(
        b"t,w\n0,1\n",
        r#"
        channels = ["v", "v", "v", "v", "v"]; rate_hz = 1000 => x.toml:7: gauges.channels: "v" is no column: there are t, w
        channels = ["w", "w", "w", "w", "w"] => x.toml:4: gauges.time: is missing
        "#,
    );
    refused(
        b"t,w\n0,1\n0,x\n",
        r#"channels = ["w", "w", "w", "w", "w"]; rate_hz = 1000 => f:3: column 2 (w): "x" is no number"#,
    );
    refused(
        b"0,1\n0,1\n",
        "channels = [1, 1, 1, 1, 7]; rate_hz = 1000 => x.toml:7: gauges.channels: 7 is no column: the file's first line holds numbers, so give numbers from 0 to 1",
    );
    refused(
        b"0,1\n0,99\n",
        r#"channels = [1, 1, 1, 1, 1]; rate_hz = 1000 => f:2: column 2: "99" makes 100.650 V"#,
    );
    refused(
        format!("{header}{slow}").as_bytes(),
        r#"=> f:3: column 1 (t_s): "0.01" comes more than 5 ms after the row before: give 200 Hz or more"#,
    );
    refused(
        format!("{header}{gap}").as_bytes(),
        r#"=> f:703: column 1 (t_s): "1.404" comes 4.000 ms after the row before"#,
    );
}

#[test]
fn a_profile_is_no_longer_and_no_higher_than_a_surface_and_its_scale_does_not_matter() {
    let folder = Folder::new("profile-bounds", SURFACE);
    let profile = "profile = \"recorded\"\nfile = \"p.csv\"\n";
    let channels = format!("{profile}place = \"a\"\nchannels = [\"b\"]\nplace_mm_per_unit = 1e9\n");
    for (section, csv, want) in [
        (
            profile,
            "x_mm,height\n-100,0\n1e8,1\n",
            "p.csv:3: column 1 (x_mm): \"1e8\" is out of reach",
        ),
        (
            profile,
            "x_mm,height\n-1e308,0\n1e308,1\n",
            "p.csv:2: column 1 (x_mm): \"-1e308\" is out of reach",
        ),
        (
            profile,
            "x_mm,height\n0,0\n20001,1\n",
            "x.toml:5: surface.file: reaches over 20.001 m",
        ),
        (
            &channels,
            "a,b\n0,0\n1,1\n",
            "p.csv:3: column 1 (a): \"1\" is out of reach",
        ),
        (
            profile,
            "x_mm,height\n-0.30000000000000004,0\n2.1,1\n",
            "x.toml:2: surface: the profile lies from -0.300 to 2.100 mm, the gauges come from",
        ),
        (
            profile,
            "x_mm,height\n0,0\n40,1e307\n",
            "p.csv:3: column 2 (height): \"1e307\" is no height",
        ),
    ] {
        let refusal = folder.refusal(section, "p.csv", csv.as_bytes());
        assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
    }
    let codes = |scale: f64| {
        let rows = (0..2_400).map(|row| {
            let x_mm = f64::from(row) * 0.05 - 10.0;
            format!(
                "{x_mm},{:e}\n",
                scale * libm::sin(std::f64::consts::PI * x_mm)
            )
        });
        let csv = format!("x_mm,height\n{}", rows.collect::<String>());
        let scene = folder.load(profile, "p.csv", csv.as_bytes()).unwrap();
        let mut world = World::new(&scene).unwrap();
        let scans =
            (0..4_000).map(|scan| world.codes(f64::from(scan) / 4_000.0, f64::from(scan) / 160.0));
        scans.collect::<Vec<_>>()
    };
    let one = codes(1.0);
    assert!(one.iter().any(|scan| scan[2] != one[0][2]));
    for scale in [2f64.powi(36), 2f64.powi(-600)] {
        assert!(codes(scale) == one, "{scale}");
    }
}
