//! Textures of ISO/IEC 23090-31.

use super::*;
use crate::scene_file::tests::refusals;

/// A texture with these channels, each an id, a description and its bands.
fn hjif(channels: &[(u32, &str, String)]) -> Vec<u8> {
    let channels: Vec<String> = channels
        .iter()
        .map(|(id, description, bands)| {
            format!(
                r#"{{"id":{id},"description":"{description}","gain":1.0,"mixing_coefficient":1,"bands":[{bands}]}}"#
            )
        })
        .collect();
    format!(
        r#"{{"version":"2023","profile":"Main","level":1,"date":"2024-01-01T00:00:00Z","description":"","avatars":[],
"perceptions":[{{"id":0,"perception_modality":"Vibrotactile Texture","description":"","avatar_id":0,
"effect_library":[],"channels":[{}]}}]}}"#,
        channels.join(",")
    )
    .into_bytes()
}

/// A sine of so many cycles a metre over 200 mm, as another program would write it: places in mm.
fn sine_band(per_metre: u32) -> String {
    format!(
        r#"{{"band_type":"VectorialWave","lower_frequency_limit":0,"upper_frequency_limit":10000,"effects":[{{
"effect_type":"Basis","keyframes":[{{"relative_position":0,"frequency_modulation":{per_metre},"amplitude_modulation":0.4}},
{{"relative_position":200}}]}}]}}"#
    )
}

#[test]
fn a_texture_of_iso_23090_31_is_rubbed_as_a_profile() {
    let folder = Folder::new("texture", SURFACE);
    let one = hjif(&[(3, "silk", sine_band(500))]);
    let several = hjif(&[(3, "silk", sine_band(250)), (8, "linen", sine_band(500))]);
    let section = "profile = \"recorded\"\nfile = \"t.hjif\"\nshift_mm = -10\n";
    for (bytes, keys) in [
        (&one, ""),
        (&several, "channels = [8]\n"),
        (&several, "channels = [\"linen\"]\n"),
    ] {
        let scene = folder
            .load(&format!("{section}{keys}"), "t.hjif", bytes)
            .unwrap();
        let surface = Surface::new(&scene.surface, 0.0);
        for step in 0..1_000 {
            let x_mm = f64::from(step) * 0.1;
            // Five waves before 0 mm; scaled to a sine of 1. Straight lines between points 0.02 mm apart are off by
            // (2π · 0.02/2)²/8 = 5e-4, the resampler by less.
            let off = f64::from(surface.feel(x_mm, 0)) - (TAU * x_mm / 2.0).sin();
            assert!(off.abs() < 0.002, "{keys}: {off} at {x_mm}");
        }
        // As it is, nothing blurred: 0.4 times 2.
        let felt = format!("{section}{keys}felt_per_unit = 2.0\n");
        let scene = folder.load(&felt, "t.hjif", bytes).unwrap();
        let surface = Surface::new(&scene.surface, 0.0);
        for step in 0..1_000 {
            let x_mm = f64::from(step) * 0.1;
            let off = f64::from(surface.feel(x_mm, 0)) - 0.8 * (TAU * x_mm / 2.0).sin();
            assert!(off.abs() < 0.002, "{keys}: {off} at {x_mm}");
        }
    }
    let refused = |bytes: &[u8], table: &str| {
        for (keys, want) in refusals(table) {
            let refusal = folder.refusal(&format!("{section}{keys}\n"), "t.hjif", bytes);
            assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
        }
    };
    refused(
        &several,
        r#"
        => x.toml:2: surface.channels: is missing: name one by its id or its description, of 3 ("silk"), 8 ("linen")
        channels = [5] => x.toml:7: surface.channels: 5 is the id or the description of no channel
        "#,
    );
    refused(
        &one,
        r#"
        mm_per_sample = 0.1 => x.toml:7: surface.mm_per_sample: an .hjif file has places of its own: take it out
        topic = "/h" => x.toml:7: surface.topic: the file is no MCAP: take it out
        "#,
    );
    let first = "perceptions[0].channels[0]";
    let keyframe = format!("{first}.bands[0].effects[0].keyframes[0]");
    refused(
        &hjif(&[(0, "", sine_band(20_000))]),
        &format!("=> t.hjif: {keyframe}.frequency_modulation: 20000: give 0 to 10 000"),
    );
    refused(
        &one[..one.len() - 40],
        &format!("=> t.hjif:4: {keyframe}: EOF while parsing"),
    );
    let unmixed = String::from_utf8(one.clone()).unwrap();
    refused(
        unmixed.replace("\"mixing_coefficient\":1,", "").as_bytes(),
        &format!("=> t.hjif:5: {first}: missing field `mixing_coefficient`"),
    );
    refused(b"{}", "=> t.hjif:1: missing field `version`");
    let gauges = "[gauges]\nkind = \"recorded\"\nfile = \"t.hjif\"\n";
    let refusal = folder.refusal(gauges, "t.hjif", &one);
    let want = "x.toml:6: gauges.file: a texture is a function of place, not of time";
    assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
}

#[test]
fn what_is_felt_is_neither_blurred_nor_scaled_whatever_the_format() {
    let folder = Folder::new("felt", SURFACE);
    // 0.3 mm, of which the contact's blur would leave 4 %.
    let heights: Vec<(f64, f64)> = (-500..12_000)
        .map(|row| f64::from(row) * 0.01)
        .map(|x_mm| (x_mm, 5.0 + (TAU * x_mm / 0.3).sin()))
        .collect();
    let csv: String = heights
        .iter()
        .map(|(x, h)| format!("{x:.2},{h}\n"))
        .collect();
    let csv = format!("x_mm,height\n{csv}").into_bytes();
    let keys = "profile = \"recorded\"\nfile = \"h.csv\"\nfelt_per_unit = 0.5\n";
    let scene = folder.load(keys, "h.csv", &csv).unwrap();
    let surface = Surface::new(&scene.surface, 0.0);
    for step in 0..1_000 {
        let x_mm = f64::from(step) * 0.1;
        let wanted = 0.5 * (5.0 + (TAU * x_mm / 0.3).sin());
        // Straight lines: (2π · 0.02/0.3)²/8 of 0.5.
        let off = f64::from(surface.feel(x_mm, 0)) - wanted;
        assert!(off.abs() < 0.012, "{off} at {x_mm}");
    }
    // No patch averages it once more: a fingertip of whatever kind reads the same codes.
    let codes = |contact: &str| {
        let scene = format!("{keys}[contact]\nmodel = \"{contact}\"\n");
        let mut world = World::new(&folder.load(&scene, "h.csv", &csv).unwrap()).unwrap();
        let scans = 0..4_000;
        scans
            .map(|scan| world.codes(f64::from(scan) / 4_000.0, f64::from(scan) / 80.0))
            .collect::<Vec<_>>()
    };
    let read = codes("kinematic");
    assert!(read == codes("rigid"), "a patch was felt");
    assert!(read.iter().any(|scan| scan[2] != read[0][2]));
    let refusal = folder.refusal(&keys.replace("0.5", "0"), "h.csv", &csv);
    let want = "x.toml:6: surface.felt_per_unit: 0 is not a scale";
    assert!(refusal.starts_with(want), "{refusal}\nwanted {want}");
}
