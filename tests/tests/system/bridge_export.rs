//! `host-bridge export`: what goes out in `.hjif` and WAV is what was there, and comes back into a scene.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use hil_sim_core::native;
use hil_sim_core::plant::surface::{GRID_MM, Surface};
use hil_sim_core::run::recording::{ACTUATORS, ZERO_VOLT};
use hil_sim_core::scene::Scene;
use host_bridge::export::{Exported, Settings, write};
use host_bridge::recording::reader::Reader;
use host_bridge::recording::row::{GaugeRow, Row};
use protocol::{GAUGES, Gauges, Message, Role};
use serde_json::Value;
use tests::bridge;
use tests::recorded::{record, said_of};
use tests::run::scene as scene_of;
use tests::utterance::Speaker;

mod hjif;

/// Only what hangs takes so long.
const LIMIT: Duration = Duration::from_secs(120);

/// An empty folder for one test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bridge_export")
        .join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

fn settings(from: &Path, to: &Path) -> Settings {
    Settings {
        from: from.to_owned(),
        to: to.to_owned(),
        from_s: None,
        to_s: None,
        date: "2024-01-01T00:00:00Z".to_owned(),
        force: false,
    }
}

fn export(from: &Path, to: &Path) -> Vec<Exported> {
    let exports = write(&settings(from, to)).unwrap_or_else(|error| panic!("{error}"));
    exports.files
}

/// The keys of a section that is told beside a file.
fn keys<'e>(exported: &'e [Exported], ending: &str, section: &str) -> &'e str {
    let file = exported
        .iter()
        .find(|file| file.path.to_string_lossy().ends_with(ending))
        .unwrap_or_else(|| panic!("no {ending} in {exported:?}"));
    let told = file.section.as_deref().expect("a scene reads it");
    told.strip_prefix(section)
        .unwrap_or_else(|| panic!("{told}"))
}

fn samples16(path: &Path) -> (u16, u32, Vec<i16>) {
    let mut file = hound::WavReader::open(path).expect("a WAV file");
    let spec = file.spec();
    let samples = file.samples().map(|sample| sample.expect("a sample"));
    (spec.channels, spec.sample_rate, samples.collect())
}

fn samples32(path: &Path) -> Vec<i32> {
    let mut file = hound::WavReader::open(path).expect("a WAV file");
    file.samples()
        .map(|sample| sample.expect("a sample"))
        .collect()
}

/// Two specimens with all that makes a surface irregular, rubbed to and fro.
const SURFACE: &str = "[surface]\nspecimens = [{ wavelength_mm = 2.0, length_mm = 4.0 }, { wavelength_mm = 3.0 }]\n\
    start_mm = -1.0\nrandom = 0.3\nsecond_wave = 0.2\nworn = 0.1\n";
const MOTION: &str = "[motion]\nkind = \"sinusoid\"\namplitude_mm_s = 60.0\nfrequency_hz = 0.8\n";

#[test]
fn a_scenes_surface_comes_back_within_a_step_of_its_file() {
    let folder = folder("surface");
    let path = folder.join("weave.toml");
    let head = "duration_s = 1.5\n";
    fs::write(&path, format!("{head}{SURFACE}{MOTION}")).expect("a file can be written");
    let felt = Surface::new(&Scene::load(&path).expect("a scene").surface, 0.0);
    for (to, ending, steps) in [
        ("weave.hjif", "weave.hjif", 1e5),
        ("weave.wav", "weave-surface.wav", 32_767.0),
    ] {
        let exported = export(&path, &folder.join(to));
        let again = format!(
            "{head}[surface]\nspecimens = [{{ wavelength_mm = 2.0 }}]\n{}\n{MOTION}",
            keys(&exported, ending, "[surface]\n")
        );
        let again_path = folder.join("again.toml");
        fs::write(&again_path, &again).expect("a file can be written");
        let again = Scene::load(&again_path).unwrap_or_else(|error| panic!("{error}\n{again}"));
        let again = Surface::new(&again.surface, 0.0);
        // Half of ± most/steps, and what f32 rounds of some 3.
        let (mut most, mut worst, mut alive) = (0.0_f64, 0.0_f64, 0.0_f64);
        // The hand goes 23.9 mm forwards.
        for point in -150..1_300 {
            let x_mm = f64::from(point) * GRID_MM;
            let (one, other) = (
                f64::from(felt.feel(x_mm, 0)),
                f64::from(again.feel(x_mm, 0)),
            );
            most = most.max(one.abs());
            worst = worst.max((one - other).abs());
            alive = alive.max((one - f64::from(felt.feel(x_mm + 0.5, 0))).abs());
        }
        // The extreme may lie where the gauges come from beyond these points.
        let bound = 0.5 * 1.5 * most / steps + 2e-6;
        assert!(worst <= bound, "{to}: {worst} off, {bound} allowed");
        assert!(most > 1.0 && alive > 1.0, "{to}: {most}, {alive}");
    }
}

#[test]
fn what_the_wav_files_of_a_scene_hold_is_what_a_run_leaves_behind() {
    let folder = folder("signals");
    let path = folder.join("rubbed.toml");
    let toml =
        format!("duration_s = 1.0\n{SURFACE}{MOTION}[gauges]\nsnr_db = 20.0\ntangential = true\n");
    fs::write(&path, &toml).expect("a file can be written");
    let exported = export(&path, &folder.join("rubbed.wav"));
    let names: Vec<_> = exported
        .iter()
        .map(|file| file.path.file_name().unwrap_or_default().to_string_lossy())
        .collect();
    let groups = ["surface", "gauges", "force", "arm", "hand", "actuators"];
    assert_eq!(names, groups.map(|group| format!("rubbed-{group}.wav")));
    let run = native::run(&scene_of(&toml)).expect("a scene that loaded runs");

    let (channels, rate_hz, gauges) = samples16(&folder.join("rubbed-gauges.wav"));
    assert_eq!((usize::from(channels), rate_hz), (GAUGES, 4_000));
    let wanted: Vec<i16> = run
        .scans
        .iter()
        .flat_map(|scan| scan.codes[..GAUGES].to_vec())
        .map(|code| ((i32::from(code) - 2_048) * 16) as i16)
        .collect();
    assert_eq!(wanted.len(), 4_000 * GAUGES);
    assert!(gauges == wanted, "a sample is another");
    let (_, _, force) = samples16(&folder.join("rubbed-force.wav"));
    let wanted = run.scans.iter().map(|scan| scan.codes[GAUGES]);
    assert!(
        force
            .iter()
            .map(|&sample| (sample / 16 + 2_048) as u16)
            .eq(wanted)
    );

    let arm = samples32(&folder.join("rubbed-arm.wav"));
    let wanted = run
        .scans
        .iter()
        .map(|scan| (scan.position_mm * 1e3).round() as i32);
    assert!(arm.into_iter().eq(wanted));

    let (channels, rate_hz, actuators) = samples16(&folder.join("rubbed-actuators.wav"));
    assert_eq!((usize::from(channels), rate_hz), (ACTUATORS, 2_000));
    let ticks: Vec<&[i16]> = actuators.chunks_exact(ACTUATORS).collect();
    assert_eq!(ticks.len(), 2_000);
    for output in &run.outputs {
        let tick = ticks[(output.at_ns / 500_000) as usize];
        let words = tick
            .iter()
            .map(|&sample| (i32::from(sample) + i32::from(ZERO_VOLT)) as u16);
        assert!(words.eq(output.words), "at {} ns", output.at_ns);
    }
    assert!(
        actuators.iter().any(|&sample| sample > 30_000),
        "5 V are 32 767"
    );

    // The gauges and the hand of the files make the same codes at the same scans.
    let again = format!(
        "duration_s = 1.0\n[surface]\nspecimens = [{{ wavelength_mm = 2.0 }}]\n[motion]\n{}\n[gauges]\n{}\n",
        keys(&exported, "hand.wav", "[motion]\n"),
        keys(&exported, "gauges.wav", "[gauges]\n"),
    );
    let again_path = folder.join("again.toml");
    fs::write(&again_path, &again).expect("a file can be written");
    let again = Scene::load(&again_path).unwrap_or_else(|error| panic!("{error}\n{again}"));
    let again = native::run(&again).expect("a scene that loaded runs");
    for (one, other) in run.scans.iter().zip(&again.scans) {
        assert_eq!(
            one.codes[..GAUGES],
            other.codes[..GAUGES],
            "at {} ns",
            one.at_ns
        );
        // Half a µm of rounding, and straight lines between ticks: 1/8 · 0.5² ms² · 0.3 m/s².
        assert!((one.position_mm - other.position_mm).abs() < 6e-4);
    }
}

/// A recording of this scene's sensor, and its samples.
fn recording(folder: &Path, toml: &str) -> (PathBuf, Vec<GaugeRow>) {
    let scene = scene_of(toml);
    let scans = native::run(&scene).expect("a scene that loaded runs").scans;
    let path = folder.join("bench.mcap");
    record(&path, said_of(&scans, scene.sensor_configuration()));
    let mut reader = Reader::open(&path).expect("a recording");
    let mut rows = Vec::new();
    while let Some(entry) = reader.next_entry().expect("a sound recording") {
        if let Row::Gauges(row) = entry.row {
            rows.extend(GaugeRow::all(&Gauges::from(&row)));
        }
    }
    (path, rows)
}

const STROKES: &str = "duration_s = 2.0\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n\
    [motion]\nkind = \"sinusoid\"\namplitude_mm_s = 70.0\nfrequency_hz = 0.83\n";

#[test]
fn a_recordings_wav_files_hold_its_codes_and_make_a_scene() {
    let folder = folder("recording");
    let (path, rows) = recording(&folder, STROKES);
    let exported = export(&path, &folder.join("bench.wav"));
    assert_eq!(exported.len(), 2, "there is no force channel");
    let (channels, rate_hz, gauges) = samples16(&folder.join("bench-gauges.wav"));
    assert_eq!((usize::from(channels), rate_hz), (GAUGES, 1_000));
    let wanted = rows.iter().flat_map(|row| row.codes()[..GAUGES].to_vec());
    assert!(rows.len() > 1_900, "{}", rows.len());
    assert!(
        gauges
            .iter()
            .map(|&sample| (i32::from(sample) + 32_768) as u16)
            .eq(wanted)
    );
    let arm = samples32(&folder.join("bench-arm.wav"));
    assert!(
        arm.iter()
            .map(|&um| i64::from(um))
            .eq(rows.iter().map(|row| row.position_um))
    );

    let again = format!(
        "duration_s = 1.8\n[surface]\nspecimens = [{{ wavelength_mm = 2.0 }}]\n[motion]\n{}\n[gauges]\n{}\n",
        keys(&exported, "arm.wav", "[motion]\n"),
        keys(&exported, "gauges.wav", "[gauges]\n"),
    );
    let again_path = folder.join("again.toml");
    fs::write(&again_path, &again).expect("a file can be written");
    let again = Scene::load(&again_path).unwrap_or_else(|error| panic!("{error}\n{again}"));
    let run = native::run(&again).expect("a scene that loaded runs");
    let valid: Vec<f64> = run
        .estimates
        .iter()
        .filter(|record| record.estimate.valid)
        .filter_map(|record| record.estimate.wavelength_mm.map(f64::from))
        .collect();
    assert!(valid.len() > 50, "{}", valid.len());
    for mm in valid {
        assert!((mm - 2.0).abs() < 0.1, "{mm}");
    }
}

#[test]
fn a_recordings_texture_is_its_longest_stroke_in_volts_over_place() {
    let folder = folder("texture");
    let (path, rows) = recording(&folder, STROKES);
    let to = folder.join("bench.hjif");
    let exported = export(&path, &to);
    let file: Value = serde_json::from_slice(&fs::read(&to).expect("a file")).expect("JSON");
    let perception = &file["perceptions"][0];
    assert_eq!(perception["unit_exponent"], -6);
    let channels = perception["channels"].as_array().expect("channels");
    assert_eq!(channels.len(), GAUGES);
    // Half a stroke at 0.83 Hz: 2 · 70 mm/s / (2π · 0.83 Hz) = 26.8 mm.
    let places: Vec<i64> = rows.iter().map(|row| row.position_um).collect();
    let low_um = *places.iter().min().expect("samples");
    let by_place: BTreeMap<i64, Vec<&GaugeRow>> =
        rows.iter().fold(BTreeMap::new(), |mut all, row| {
            all.entry(row.position_um)
                .or_insert_with(Vec::new)
                .push(row);
            all
        });
    for (gauge, channel) in channels.iter().enumerate() {
        let keyframes = channel["bands"][0]["effects"][0]["keyframes"]
            .as_array()
            .expect("keyframes");
        let last = keyframes.last().expect("one")["relative_position"]
            .as_i64()
            .expect("a place");
        assert!((26_700..26_950).contains(&last), "{last} µm");
        let mut exact = 0;
        for keyframe in keyframes {
            let at = keyframe["relative_position"].as_i64().expect("a place") + low_um;
            let volts = 1.65
                * (1.0
                    + keyframe["amplitude_modulation"]
                        .as_f64()
                        .expect("an amplitude"));
            let here = by_place
                .get(&at)
                .unwrap_or_else(|| panic!("no sample at {at} µm"));
            // Half a hundred-thousandth of 1.65 V, and the recording's own 5 µV.
            let is_this = |row: &&&GaugeRow| (row.volts()[gauge] - volts).abs() < 14e-6;
            exact += usize::from(here.iter().any(|row| is_this(&row)));
        }
        // Where the arm turns, several samples share a place.
        assert!(
            exact * 100 > keyframes.len() * 95,
            "gauge {gauge}: {exact} of {}",
            keyframes.len()
        );
        assert!(keyframes.len() > 500, "{}", keyframes.len());
    }

    // A scene rubs it, and the estimator finds its wave.
    let again = format!(
        "duration_s = 0.3\n[surface]\nspecimens = [{{ wavelength_mm = 2.0 }}]\n{}\n[motion]\nspeed_mm_s = 65.0\n",
        keys(&exported, ".hjif", "[surface]\n").replace(
            &format!("shift_mm = {:?}", low_um as f64 * 1e-3),
            "shift_mm = -3.5"
        ),
    );
    let again_path = folder.join("again.toml");
    fs::write(&again_path, &again).expect("a file can be written");
    let again = Scene::load(&again_path).unwrap_or_else(|error| panic!("{error}\n{again}"));
    let run = native::run(&again).expect("a scene that loaded runs");
    let last = run.estimates.last().expect("estimates").estimate;
    let mm = last.wavelength_mm.map(f64::from).expect("a wavelength");
    assert!(last.valid && (mm - 2.0).abs() < 0.04, "{last:?}");
}

/// What a value of a file has to be.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Text,
    Whole(i64, i64),
    Number(f64, f64),
    Word(&'static [&'static str]),
    List(&'static [Field]),
    Object(&'static [Field]),
    Texts,
}

/// A field: its name, whether it must be there, and what it is.
type Field = (&'static str, bool, Kind);

#[test]
fn what_cannot_be_exported_is_refused_with_what_to_do() {
    let folder = folder("refusals");
    let resting = folder.join("rest");
    fs::create_dir_all(&resting).expect("a folder can be made");
    let still = STROKES.replace("amplitude_mm_s = 70.0", "amplitude_mm_s = 0.0");
    let (resting, _) = recording(&resting, &still);
    let mute = folder.join("mute.mcap");
    record(&mute, [] as [(u64, Role, Message); 0]);
    let gap = folder.join("gap.mcap");
    let mut speaker = Speaker::new(1);
    let blocks = [0, 16].map(|first| (0, Role::Sensor, speaker.gauges(first)));
    record(&gap, blocks);
    let beyond = folder.join("beyond.mcap");
    let blocks = [0, 8].map(|first| match speaker.gauges(first) {
        Message::Gauges(gauges) => Message::Gauges(Gauges {
            position_um: 1 << 40,
            ..gauges
        }),
        other => other,
    });
    record(&beyond, blocks.map(|block| (0, Role::Sensor, block)));
    let scene = folder.join("weave.toml");
    let toml = format!("duration_s = 0.2\n{SURFACE}{MOTION}");
    fs::write(&scene, &toml).expect("a file can be written");
    let far = folder.join("far.toml");
    let long = format!("duration_s = 600\n{SURFACE}[motion]\nspeed_mm_s = 100.0\n");
    fs::write(&far, long).expect("a file can be written");
    let broken = folder.join("broken.toml");
    fs::write(&broken, "duration_s = 0\n").expect("a file can be written");
    let taken = folder.join("taken.hjif");
    fs::write(&taken, "mine").expect("a file can be written");
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let resting = resting.to_string_lossy().into_owned();
    for (words, want) in [
        (
            vec![path("weave.toml"), path("x.mp3")],
            "give a name that ends in .hjif or in .wav",
        ),
        (
            vec![path("weave.toml"), path("taken.hjif")],
            "taken.hjif: is there already: give another name, or --force",
        ),
        (
            vec![
                path("weave.toml"),
                path("x.hjif"),
                "--from".into(),
                "1".into(),
            ],
            "a scene is as long as its duration_s says",
        ),
        (
            vec![path("broken.toml"), path("x.hjif")],
            "broken.toml:1: duration_s: 0 is not a duration",
        ),
        (
            vec![path("far.toml"), path("x.hjif")],
            "a texture has 10000 mm at most: give the scene a shorter duration_s",
        ),
        (
            vec![path("none.mcap"), path("x.hjif")],
            "none.mcap: can't be read",
        ),
        (
            vec![path("mute.mcap"), path("x.wav")],
            "mute.mcap: 0 samples of the gauges there",
        ),
        (
            vec![path("gap.mcap"), path("x.wav")],
            "gap.mcap: samples are missing at ",
        ),
        (
            vec![path("beyond.mcap"), path("x.wav")],
            "beyond.mcap: the arm is ",
        ),
        (vec![resting, path("x.hjif")], "the arm does not move there"),
        (
            vec![
                path("mute.mcap"),
                path("x.wav"),
                "--to-time".into(),
                "0".into(),
            ],
            "give a time after --from",
        ),
        (
            vec![path("weave.toml"), path("no/x.hjif")],
            "x.hjif: can't be written",
        ),
    ] {
        let ended = bridge::run(
            ["export".to_owned()].into_iter().chain(words.clone()),
            LIMIT,
        );
        assert_eq!(ended.status.code(), Some(2), "{words:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(want), "{words:?}: {}", ended.stderr);
    }
    assert_eq!(fs::read_to_string(&taken).expect("still there"), "mine");
    let words = [path("weave.toml"), path("taken.hjif"), "--force".to_owned()];
    let ended = bridge::run(["export".to_owned()].into_iter().chain(words), LIMIT);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for want in [
        "taken.hjif: a texture of 1 channel",
        "  [surface]",
        "  felt_per_unit = 1.0",
    ] {
        assert!(ended.stdout.contains(want), "{}", ended.stdout);
    }
}

#[test]
fn a_recording_that_was_cut_off_is_said_to_be() {
    let folder = folder("cut");
    let (whole, cut) = (folder.join("whole.mcap"), folder.join("cut.mcap"));
    let scene = scene_of("duration_s = 6.0\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n");
    let recording = native::run(&scene).unwrap_or_else(|error| panic!("{error}"));
    record(
        &whole,
        said_of(&recording.scans, scene.sensor_configuration()),
    );
    let bytes = fs::read(&whole).expect("a recording");
    fs::write(&cut, &bytes[..bytes.len() * 3 / 4]).expect("the file can be written");
    for (path, is_told) in [(whole, false), (cut, true)] {
        let to = path.with_extension("wav");
        let words = [OsStr::new("export"), path.as_os_str(), to.as_os_str()];
        let ended = bridge::run(words, LIMIT);
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
        let told = ended.stdout.contains("the recording was cut off");
        assert_eq!(told, is_told, "{}", ended.stdout);
    }
}
