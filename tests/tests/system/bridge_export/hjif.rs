//! What is exported as `.hjif`, held against the standard's names, types and ranges.

use super::*;

const MOST: i64 = u32::MAX as i64;

const VECTOR: &[Field] = &[
    ("X", true, Kind::Whole(-127, 127)),
    ("Y", true, Kind::Whole(-127, 127)),
    ("Z", true, Kind::Whole(-127, 127)),
];

const KEYFRAME: &[Field] = &[
    ("amplitude_modulation", false, Kind::Number(-1.0, 1.0)),
    ("frequency_modulation", false, Kind::Number(0.0, 1e4)),
    ("relative_position", false, Kind::Whole(0, MOST)),
];

const EFFECT: &[Field] = &[
    ("id", false, Kind::Whole(0, MOST)),
    (
        "effect_type",
        true,
        Kind::Word(&["Basis", "Composite", "Reference"]),
    ),
    ("position", false, Kind::Whole(0, MOST)),
    ("keyframes", false, Kind::List(KEYFRAME)),
];

const BAND: &[Field] = &[
    (
        "band_type",
        true,
        Kind::Word(&["WaveletWave", "VectorialWave", "Curve", "Transient"]),
    ),
    (
        "curve_type",
        false,
        Kind::Word(&["Linear", "Cubic", "Akima", "Bezier", "BSpline", "Unknown"]),
    ),
    ("lower_frequency_limit", true, Kind::Number(0.0, 1e4)),
    ("upper_frequency_limit", true, Kind::Number(0.0, 1e4)),
    ("effects", true, Kind::List(EFFECT)),
];

const CHANNEL: &[Field] = &[
    ("id", true, Kind::Whole(0, MOST)),
    ("description", true, Kind::Text),
    ("reference_device_id", false, Kind::Whole(0, MOST)),
    ("gain", true, Kind::Number(0.0, f64::MAX)),
    ("mixing_coefficient", true, Kind::Number(0.0, f64::MAX)),
    ("actuator_resolution", false, Kind::Object(VECTOR)),
    ("body_part_target", false, Kind::Texts),
    ("frequency_sampling", false, Kind::Whole(0, MOST)),
    ("sample_count", false, Kind::Whole(0, MOST)),
    ("bands", true, Kind::List(BAND)),
];

const DEVICE: &[Field] = &[
    ("id", true, Kind::Whole(1, MOST)),
    ("name", true, Kind::Text),
    ("minimum_frequency", false, Kind::Number(0.0, f64::MAX)),
    ("maximum_frequency", false, Kind::Number(0.0, f64::MAX)),
    ("maximum_voltage", false, Kind::Number(0.0, f64::MAX)),
    (
        "type",
        false,
        Kind::Word(&["LRA", "VCA", "ERM", "Piezo", "Unknown"]),
    ),
];

const PERCEPTION: &[Field] = &[
    ("id", true, Kind::Whole(0, MOST)),
    (
        "perception_modality",
        true,
        Kind::Word(&["Vibrotactile Texture"]),
    ),
    ("description", true, Kind::Text),
    ("avatar_id", true, Kind::Whole(0, MOST)),
    ("effect_library", true, Kind::List(EFFECT)),
    ("reference_devices", false, Kind::List(DEVICE)),
    ("channels", true, Kind::List(CHANNEL)),
    ("unit_exponent", false, Kind::Whole(-128, 127)),
    ("perception_unit_exponent", false, Kind::Whole(-128, 127)),
];

const EXPERIENCE: &[Field] = &[
    ("version", true, Kind::Word(&["2023"])),
    ("profile", true, Kind::Word(&["Main", "Simple Parametric"])),
    ("level", true, Kind::Whole(1, 2)),
    ("date", true, Kind::Text),
    ("description", true, Kind::Text),
    ("timescale", false, Kind::Whole(1, 48_000)),
    (
        "avatars",
        true,
        Kind::List(&[
            ("id", true, Kind::Whole(1, MOST)),
            ("lod", true, Kind::Whole(0, 2)),
            (
                "type",
                true,
                Kind::Word(&["Vibration", "Pressure", "Temperature", "Custom"]),
            ),
        ]),
    ),
    ("perceptions", true, Kind::List(PERCEPTION)),
    (
        "syncs",
        true,
        Kind::List(&[("timestamp", true, Kind::Whole(0, MOST))]),
    ),
];

/// What is not as the fields say, with its path.
fn wrong(object: &Value, fields: &[Field], path: &str, found: &mut Vec<String>) {
    let Some(members) = object.as_object() else {
        found.push(format!("{path} is no object"));
        return;
    };
    for name in members.keys() {
        if !fields.iter().any(|(known, ..)| known == name) {
            found.push(format!("{path}.{name} is no field of the standard"));
        }
    }
    for (name, needed, kind) in fields {
        let path = format!("{path}.{name}");
        let Some(value) = members.get(*name) else {
            if *needed {
                found.push(format!("{path} is missing"));
            }
            continue;
        };
        let is_right = match kind {
            Kind::Text => value.is_string(),
            Kind::Whole(low, high) => value
                .as_i64()
                .is_some_and(|at| (*low..=*high).contains(&at)),
            Kind::Number(low, high) => value
                .as_f64()
                .is_some_and(|at| (*low..=*high).contains(&at)),
            Kind::Word(words) => value.as_str().is_some_and(|word| words.contains(&word)),
            Kind::Texts => value
                .as_array()
                .is_some_and(|all| all.iter().all(Value::is_string)),
            Kind::Object(fields) => {
                wrong(value, fields, &path, found);
                true
            }
            Kind::List(fields) => {
                let all = value.as_array();
                for (at, one) in all.into_iter().flatten().enumerate() {
                    wrong(one, fields, &format!("{path}[{at}]"), found);
                }
                all.is_some()
            }
        };
        if !is_right {
            found.push(format!("{path} is {value}, not {kind:?}"));
        }
    }
}

#[test]
fn what_is_written_has_the_standards_names_types_and_ranges() {
    let folder = folder("structure");
    let (recording, _) = recording(&folder, STROKES);
    let scene = folder.join("weave.toml");
    let toml = format!("duration_s = 1.5\n{SURFACE}{MOTION}");
    fs::write(&scene, toml).expect("a file can be written");
    for from in [recording, scene] {
        let to = from.with_extension("hjif");
        export(&from, &to);
        let file: Value = serde_json::from_slice(&fs::read(&to).expect("a file")).expect("JSON");
        let mut found = Vec::new();
        wrong(&file, EXPERIENCE, "", &mut found);
        assert!(found.is_empty(), "{found:#?}");
        let perception = &file["perceptions"][0];
        let device = &perception["reference_devices"][0];
        assert_eq!(device["maximum_voltage"], 5.0);
        assert_eq!(device["maximum_frequency"], 500.0);
        // What refers to something finds it, and no id is there twice.
        assert_eq!(perception["avatar_id"], file["avatars"][0]["id"]);
        for (channel, id) in perception["channels"]
            .as_array()
            .into_iter()
            .flatten()
            .zip(0..)
        {
            assert_eq!(channel["id"], id);
            assert_eq!(channel["reference_device_id"], device["id"]);
            let resolution = &channel["actuator_resolution"];
            assert_eq!(
                (&resolution["X"], &resolution["Y"]),
                (&10.into(), &5.into())
            );
        }
    }
    let mut found = Vec::new();
    wrong(
        &serde_json::json!({"version": "2023", "colour": 1}),
        EXPERIENCE,
        "",
        &mut found,
    );
    assert!(
        found.contains(&".colour is no field of the standard".to_owned()),
        "{found:?}"
    );
    assert!(
        found.contains(&".perceptions is missing".to_owned()),
        "{found:?}"
    );
}
