//! Scenes that nobody here wrote: drawn from the grammar of scenes, most of them then spoiled. Each loads or is
//! refused with file, line and key; what loads runs, and gives finite numbers.

use std::fs;
use std::path::{Path, PathBuf};

use hil_sim_core::judge::outcome::Outcome;
use hil_sim_core::native;
use hil_sim_core::scene::fault::Kind;
use hil_sim_core::scene::{Scene, SceneError};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const SCENES: u64 = 10_000;
/// Scenes that are run, at most, for so long.
const RUNS: u64 = 500;
const RUN_S: f64 = 0.3;

type Draws = Xoshiro256PlusPlus;
/// The keys of a section, each with what may stand behind it.
type Keys = &'static [(&'static str, &'static [&'static str])];

/// The sections; of what may stand behind a key, `A..B` is a number from A to B and `A...B` a whole one.
const GRAMMAR: &[(&str, Keys)] = &[
    (
        "",
        &[
            ("name", &["\"stranger\"", "\"a.b_c-1\""]),
            ("seed", &["0...1000"]),
            ("duration_s", &["0.01..0.5", "1", "0.05"]),
        ],
    ),
    (
        "surface",
        &[
            (
                "specimens",
                &[
                    "[{ wavelength_mm = 2.0 }]",
                    "[{ wavelength_mm = 1.0, length_mm = 3 }, { wavelength_mm = 4 }]",
                    "[{ wavelength_mm = 0.01, length_mm = 0.001 }, { wavelength_mm = 100 }]",
                    "[\n  { wavelength_mm = 0.5, length_mm = 10.0 },\n  { wavelength_mm = 3.0, length_mm = 1.0 },\n]",
                ],
            ),
            ("start_mm", &["-100..100", "-100000", "100000"]),
            ("random", &["0..10"]),
            ("second_wave", &["0..1"]),
            ("second_ratio", &["0.1..10"]),
            ("worn", &["0..0.9"]),
            (
                "profile",
                &[
                    "\"sine\"",
                    "\"trapezoid\"",
                    "\"recorded\"\nfile = \"heights.csv\"",
                    "\"recorded\"",
                ],
            ),
            ("file", &["\"heights.csv\"", "\"none.csv\""]),
            ("shift_mm", &["-10..10"]),
            ("interpolation", &["\"lines\"", "\"band-limited\""]),
            ("mm_per_sample", &["0.001..0.1"]),
        ],
    ),
    (
        "motion",
        &[
            ("kind", MOTIONS),
            ("speed_mm_s", &["-100..100", "0", "1000", "-1000"]),
            ("amplitude_mm_s", &["0..100", "1000"]),
            ("frequency_hz", &["0.1..20"]),
            ("file", &["\"hand.csv\"", "\"tone.wav\""]),
            ("mm_per_unit", &["0.1..20", "-1"]),
        ],
    ),
    (
        "arm",
        &[
            ("follows", &["\"motion\"", "\"link\""]),
            ("lag_ms", &["0..1000", "0"]),
            ("encoder_um", &["5", "50", "500"]),
        ],
    ),
    (
        "contact",
        &[
            (
                "model",
                &[
                    "\"auto\"",
                    "\"kinematic\"",
                    "\"rigid\"",
                    "\"viscoelastic\"",
                    "\"stick-slip\"",
                ],
            ),
            (
                "integrator",
                &[
                    "\"exact\"",
                    "\"euler\"",
                    "\"semi-implicit\"",
                    "\"rk4\"",
                    "\"implicit\"",
                    "\"adaptive\"",
                    "\"radau\"",
                ],
            ),
            ("step_us", &["0.1..250", "5", "250"]),
            (
                "friction",
                &["\"none\"", "\"mild\"", "\"strong\"", "\"severe\""],
            ),
        ],
    ),
    (
        "gauges",
        &[
            ("kind", GAUGES),
            (
                "file",
                &[
                    "\"volts.csv\"",
                    "\"tone.wav\"",
                    "\"broken.wav\"",
                    "\"broken.mcap\"",
                ],
            ),
            (
                "channels",
                &[
                    "[0, 0, 0, 0, 0]",
                    "[\"g0\", \"g1\", \"g2\", \"g3\", \"g4\"]",
                    "[0]",
                ],
            ),
            ("start_s", &["0..0.1"]),
            ("volts_per_unit", &["0.1..1"]),
            ("offset_v", &["1.65"]),
            ("snr_db", &["-40..120", "20"]),
            ("hum_50_hz", &["0..10"]),
            ("hum_60_hz", &["0..10"]),
            ("hum_off_hz", &["-2..2"]),
            ("second_harmonic", &["0..1"]),
            ("dead", &["[]", "[0]", "[0, 1, 2, 3, 4]", "[3, 3]"]),
            ("saturated", &["[]", "[1]"]),
            ("stuck", &["[2]"]),
            ("noisy", &["[3]"]),
            ("humming", &["[4]"]),
            ("trouble_from_s", &["0..1"]),
            ("trouble_for_s", &["0..1"]),
            ("resonance_hz", &["10..2000"]),
            ("resonance_damping", &["0.01..0.99"]),
            ("pink", &["0..10"]),
            ("drift", &["0..10"]),
            ("offset", &["0..10"]),
            ("skew_us", &["-5000..5000"]),
            ("tangential", &["true", "false"]),
            ("tangential_n_per_v", &["0.05..20"]),
            ("stiffness_n_per_m", &["10..10000", "400"]),
        ],
    ),
    (
        "link",
        &[
            ("delay_ms", &["0..100", "10000"]),
            ("jitter_ms", &["0..100", "10000"]),
            ("loss", &["0..1", "1"]),
            ("reorder", &["0..1", "1"]),
            ("corrupt", &["0..0.01", "1"]),
        ],
    ),
    (
        "estimator",
        &[
            (
                "method",
                &[
                    "\"default\"",
                    "\"counting\"",
                    "\"crossings\"",
                    "\"spectrum\"",
                    "\"bank\"",
                    "\"counting-adapted\"",
                ],
            ),
            ("window_ms", &["10...200"]),
            ("counted_gauge", &["0...4"]),
            ("gauges", &["[0]", "[0, 1, 2, 3, 4]", "[]"]),
            ("travel_wavelengths", &["0.3..3"]),
            ("candidates", &["12...24"]),
            ("waves", &["2...8"]),
            ("valid_percent", &["50...99"]),
            ("stiffness", &["\"configured\"", "\"estimated\""]),
        ],
    ),
    (
        "display",
        &[
            ("mode", &["\"uniform\"", "\"travelling\""]),
            (
                "rendering",
                &["\"fundamental\"", "\"shape\"", "\"texture\""],
            ),
            ("update_rate_hz", &["2000", "4000", "3000"]),
            ("max_age_ms", &["20...5000"]),
            ("fade_in_ms", &["1...1000"]),
            ("fade_out_ms", &["1...1000"]),
            ("glide_ms", &["0...500"]),
            ("amplitude_mv", &["0...5000"]),
            ("reference_lsb", &["0...2000"]),
            ("reference_mn", &["0...60000"]),
            ("full_drive_s", &["10...3600"]),
            ("pitch_um", &["100...4000"]),
        ],
    ),
    (
        "expect",
        &[
            ("wavelength_rms_percent", &["0.1..50"]),
            ("wavelength_bias_percent", &["0.1..50"]),
            ("mean_mm", &["0.5..5"]),
            ("mean_tolerance_mm", &["0.01..1"]),
            ("valid_share_min", &["0..1"]),
            ("wrong_share_max", &["0..1"]),
            ("felt_right_share_min", &["0..1"]),
            ("felt_wrong_share_max", &["0..1"]),
            ("settling_ms", &["1..500"]),
            ("latency_ms", &["1..500"]),
            ("frequency_percent", &["0.1..50"]),
            ("phase_rms_cycles", &["0.001..1"]),
        ],
    ),
];

const MOTIONS: &[&str] = &[
    "\"constant\"",
    "\"sinusoid\"\namplitude_mm_s = 70\nfrequency_hz = 0.83",
    "\"recorded\"\nfile = \"hand.csv\"",
    "\"recorded\"\nfile = \"tone.wav\"\nmm_per_unit = 2",
    "\"recorded\"",
];
const GAUGES: &[&str] = &[
    "\"kinematic\"",
    "\"recorded\"\nfile = \"volts.csv\"",
    "\"recorded\"\nfile = \"tone.wav\"\nstart_s = 0.01",
    "\"recorded\"\nfile = \"broken.mcap\"",
];
/// Keys that go with few others, and are seldom given.
const RARE: &[&str] = &[
    "amplitude_mm_s",
    "channels",
    "file",
    "frequency_hz",
    "integrator",
    "interpolation",
    "lag_ms",
    "mean_tolerance_mm",
    "mm_per_sample",
    "mm_per_unit",
    "offset_v",
    "resonance_damping",
    "shift_mm",
    "start_s",
    "step_us",
    "stiffness",
    "trouble_for_s",
    "trouble_from_s",
    "volts_per_unit",
];

/// What stands where something else should.
const WRONG: &[&str] = &[
    "-1",
    "0",
    "1e999",
    "-1e308",
    "nan",
    "inf",
    "-inf",
    "1e-320",
    "9223372036854775807",
    "0x7f",
    "\"\"",
    "\"x\"",
    "true",
    "[]",
    "[[]]",
    "{}",
    "{ a = 1 }",
    "1979-05-27",
    "[\"a\", 1]",
    "\"\\u0000\"",
    "'λ'",
    "\"../../\"",
    "[-1]",
    "[99999999999]",
    "",
];

fn number(draws: &mut Draws, form: &str) -> String {
    let whole = form.contains("...");
    match form.split_once(if whole { "..." } else { ".." }) {
        Some((low, high)) if !form.starts_with('"') => {
            let (low, high): (f64, f64) = (low.parse().unwrap(), high.parse().unwrap());
            let drawn = low + (high - low) * draws.random::<f64>();
            if whole {
                format!("{}", drawn.round())
            } else {
                format!("{drawn:?}")
            }
        }
        _ => form.to_owned(),
    }
}

/// A scene by the grammar: few of a section's keys or many.
fn scene(draws: &mut Draws) -> Vec<String> {
    let mut lines = Vec::new();
    for (section, keys) in GRAMMAR {
        let wanted = match *section {
            "" | "surface" => true,
            _ => draws.random_bool(0.4),
        };
        if !wanted {
            continue;
        }
        if !section.is_empty() {
            lines.push(format!("[{section}]"));
        }
        let share = draws.random_range(0.0..0.4);
        for (key, forms) in *keys {
            let needed = *key == "specimens" || *key == "duration_s";
            let share = if RARE.contains(key) { 0.03 } else { share };
            if needed || draws.random_bool(share) {
                let form = forms.choose(draws).unwrap();
                lines.push(format!("{key} = {}", number(draws, form)));
            }
        }
    }
    for _ in 0..draws.random_range(0..3) {
        let kind = Kind::all()
            .nth(draws.random_range(0..Kind::all().count()))
            .unwrap();
        lines.push("[[fault]]".to_owned());
        lines.push(format!("kind = \"{}\"", kind.name()));
        lines.push(format!("at_s = {}", number(draws, "0..0.3")));
        if draws.random_bool(0.3) {
            lines.push(format!("for_s = {}", number(draws, "0.01..1")));
        }
        for key in kind.row().keys {
            if draws.random_bool(0.5) {
                lines.push(format!(
                    "{} = {}",
                    key.name,
                    number(draws, &format!("{}..{}", key.low, key.high))
                ));
            }
        }
    }
    lines
}

/// Spoils a scene somewhere.
fn spoil(draws: &mut Draws, lines: &mut Vec<String>) {
    let at = draws.random_range(0..lines.len());
    let key = lines[at].split(" = ").next().unwrap_or_default().to_owned();
    match draws.random_range(0..8) {
        0..=2 => lines[at] = format!("{key} = {}", WRONG.choose(draws).unwrap()),
        3 => lines[at] = lines[at].replacen(&key, &format!("{key}s"), 1),
        4 => {
            let line = lines[at].clone();
            lines.insert(draws.random_range(0..=lines.len()), line);
        }
        5 => {
            lines.remove(at);
        }
        6 => {
            let mut letters: Vec<char> = lines[at].chars().collect();
            let place = draws.random_range(0..=letters.len());
            letters.insert(
                place,
                *['"', '[', ']', '=', '#', '\u{0}', 'é', '\\', '9', '\r']
                    .choose(draws)
                    .unwrap(),
            );
            lines[at] = letters.into_iter().collect();
        }
        _ => {
            let mut letters: Vec<char> = lines[at].chars().collect();
            if !letters.is_empty() {
                letters.remove(draws.random_range(0..letters.len()));
            }
            lines[at] = letters.into_iter().collect();
        }
    }
}

/// The files that scenes may name.
fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("strangers");
    fs::create_dir_all(&folder).unwrap();
    let rows = |header: &str, row: &dyn Fn(f64) -> String| {
        (0..=1_200).fold(format!("{header}\n"), |text, ms| {
            text + &row(f64::from(ms) / 1e3)
        })
    };
    let volts = rows("t_s,g0,g1,g2,g3,g4", &|t_s| {
        format!("{t_s},1,{},1.2,1.65,2\n", 1.0 + t_s)
    });
    fs::write(folder.join("volts.csv"), volts).unwrap();
    fs::write(
        folder.join("hand.csv"),
        rows("t_s,x_mm", &|t_s| format!("{t_s},{}\n", 40.0 * t_s)),
    )
    .unwrap();
    let heights = rows("x_mm,height", &|s| {
        format!("{},{}\n", 200.0 * s - 100.0, (300.0 * s).sin())
    });
    fs::write(folder.join("heights.csv"), heights).unwrap();
    fs::write(folder.join("broken.wav"), b"RIFF\x24\0\0\0WAVEfmt \x10\0").unwrap();
    fs::write(
        folder.join("broken.mcap"),
        b"\x89MCAP0\r\n\x01\xff\xff\xff\xff\xff\xff\xff\x7f",
    )
    .unwrap();
    let spec = hound::WavSpec {
        channels: 1,
        sample_rate: 8_000,
        bits_per_sample: 16,
        sample_format: hound::SampleFormat::Int,
    };
    let mut wav = hound::WavWriter::create(folder.join("tone.wav"), spec).unwrap();
    for sample in 0..9_600 {
        wav.write_sample((8_000.0 * (f64::from(sample) / 50.0).sin()) as i16)
            .unwrap();
    }
    wav.finalize().unwrap();
    folder
}

/// That a refusal names a file that there is, a line of it, and a key that is there, or is missing.
fn check(refusal: &SceneError, path: &Path, text: &str) {
    let told = format!("{refusal}\nof:\n{text}");
    assert!(!refusal.message.is_empty(), "{told}");
    if Path::new(&refusal.file) != path {
        // A file that the scene names.
        assert!(Path::new(&refusal.file).exists(), "{told}");
        return;
    }
    let line = refusal.line.unwrap_or_else(|| panic!("no line: {told}"));
    let lines: Vec<&str> = text.split('\n').collect();
    assert!((1..=lines.len()).contains(&line), "{told}");
    let (section, last) = refusal.key.rsplit_once('.').unwrap_or(("", &refusal.key));
    let bare = |key: &'_ str| key.split(['.', '[']).next().unwrap_or_default().to_owned();
    let (section, last) = (bare(section), bare(last));
    // Where the key stands in its section.
    let mut within = String::new();
    let mut found = Vec::new();
    for (number, text) in (1..).zip(&lines) {
        let trimmed = text.trim();
        if trimmed.starts_with('[') && trimmed.ends_with(']') {
            within = trimmed.trim_matches(['[', ']', ' ']).to_owned();
        }
        if within == section && words(text).any(|word| word == last) {
            found.push(number);
        }
    }
    // It stands in that line, or it is missing, or is one of several alike, or the text is no TOML.
    let is_one_of_several = found.len() > 1 || refusal.key.contains('[');
    let is_there = found.is_empty() || found.contains(&line) || is_one_of_several;
    assert!(last.is_empty() || is_there, "{told}");
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !(letter.is_ascii_alphanumeric() || letter == '_'))
}

#[test]
fn scenes_of_strangers_run_or_are_refused_with_file_line_and_key() {
    let path = folder().join("x.toml");
    let (mut loaded, mut run, mut refused, mut sound) = (0_u64, 0_u64, 0_u64, 0_u64);
    for seed in 0..SCENES {
        let mut draws = Draws::seed_from_u64(seed);
        let mut lines = scene(&mut draws);
        let spoiled = draws.random_range(0..4);
        for _ in 0..spoiled {
            if !lines.is_empty() {
                spoil(&mut draws, &mut lines);
            }
        }
        sound += u64::from(spoiled == 0);
        let text = lines.join("\n");
        let scene = match Scene::parse(&path, &text) {
            Ok(scene) => scene,
            Err(refusal) => {
                refused += 1;
                check(&refusal, &path, &text);
                continue;
            }
        };
        loaded += 1;
        if native::check(&scene).is_err() || run == RUNS {
            continue;
        }
        run += 1;
        let scene = Scene {
            duration_s: scene.duration_s.min(RUN_S),
            ..scene
        };
        let recording = native::run(&scene).unwrap();
        let outcome = Outcome::new(scene, recording);
        let numbers = format!("{:?}", outcome.verdict);
        assert!(
            !numbers.contains("NaN") && !numbers.contains("inf"),
            "{text}\n{numbers}"
        );
    }
    // Both ways are tried, and the sound ones are not all refused.
    assert!(
        loaded > SCENES / 20 && run == RUNS && refused > SCENES / 4 && sound > 0,
        "{loaded} loaded, {run} run, {refused} refused, {sound} not spoiled"
    );
}
