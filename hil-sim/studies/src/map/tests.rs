//! Maps as a whole, on small grids.

use std::collections::BTreeSet;
use std::fs;
use std::num::NonZero;
use std::path::PathBuf;

use super::error::MapError;
use super::journal;
use super::knob::Knob;
use super::measurement::Measurement;
use super::*;
use hil_sim_core::judge::outcome::Outcome;

/// Two speeds × three wavelengths.
fn small() -> Map {
    Map {
        name: "small",
        title: "Small",
        conditions: "20 dB",
        x: Axis::linear("speed v in mm/s", Knob::SPEED, 30.0, 70.0, 2),
        y: Axis::log("wavelength λ in mm", Knob::WAVELENGTH, 1.0, 4.0, 3),
        base: vec![Knob::SNR.at(20.0)],
    }
}

/// A plan in a folder of the test's own, empty.
fn plan(test: &str) -> Plan {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../target/tmp/map")
        .join(test);
    fs::remove_dir_all(&folder).ok();
    Plan {
        methods: vec!["counting".into()],
        folder,
        shard: None,
        threads: NonZero::new(2).unwrap(),
        renew: false,
    }
}

fn make(map: &Map, plan: &Plan) -> Result<(usize, Vec<PathBuf>), MapError> {
    let mut survey = Survey::open(map, plan)?;
    let mut runs = 0;
    survey.run(|| runs += 1)?;
    Ok((runs, survey.finish()?.files))
}

fn refusal(map: &Map, plan: &Plan) -> String {
    match make(map, plan) {
        Ok((runs, _)) => panic!("{runs} runs instead of a refusal"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn every_map_has_a_name_and_cells_of_its_own() {
    let maps = catalogue();
    assert_eq!(maps.len(), 12);
    let names: BTreeSet<&str> = maps.iter().map(|map| map.name).collect();
    assert_eq!(names.len(), maps.len());
    for map in &maps {
        let texts: BTreeSet<String> = (0..map.len())
            .map(|cell| map.scene_text(cell, "counting"))
            .collect();
        assert_eq!(texts.len(), map.len(), "{}", map.name);
        let parameters: BTreeSet<Vec<&str>> =
            (0..map.len()).map(|cell| map.parameters(cell)).collect();
        assert_eq!(parameters.len(), map.len(), "{}", map.name);
        assert_eq!(map.columns().len(), map.parameters(0).len());
    }
}

#[test]
fn cells_and_places_are_one_to_one() {
    let map = small();
    for cell in 0..map.len() {
        let (column, row) = map.place(cell);
        assert_eq!(map.cell(column, row), cell);
        let (x, y) = (&map.x.steps[column].label, &map.y.steps[row].label);
        assert_eq!(map.nearest(x, y).unwrap(), cell);
    }
    let error = map.nearest("50", "long").unwrap_err().to_string();
    assert!(error.contains("give a number from 1 to 4"), "{error}");
}

#[test]
fn a_place_with_a_name_is_found_by_it() {
    let map = find("friction-speed").unwrap();
    let cell = map.nearest("50", "2-mild-true").unwrap();
    assert_eq!(map.parameters(cell), ["50", "2", "mild", "true"]);
    assert!(map.nearest("50", "2-mild").is_err());
    let unknown = find("altitude").unwrap_err().to_string();
    assert!(unknown.contains("hum-wavelength"), "{unknown}");
}

#[test]
fn the_seed_is_the_cell_s_and_not_the_method_s() {
    let map = small();
    let seed = |cell, method| map.scene(cell, method).unwrap().seed;
    assert_eq!(seed(0, "counting"), seed(0, "default"));
    assert_ne!(seed(0, "counting"), seed(1, "counting"));
}

#[test]
fn a_cell_s_scene_runs_to_the_same_numbers_by_itself() {
    let scene = small().scene(3, "counting").unwrap();
    let measured = Measurement::of(&scene).unwrap();
    let recording = hil_sim_core::native::run(&scene).unwrap();
    let summary = Outcome::new(scene, recording).verdict.summary;
    // Rounded to four decimals.
    assert!((measured.rms_percent.unwrap() - summary.rms_percent.unwrap()).abs() <= 0.5001e-4);
    assert_eq!(measured.wrong_share(), summary.wrong_share);
    assert_eq!(measured.estimates, 1_000);
}

#[test]
fn a_map_is_measured_written_and_drawn() {
    let (map, plan) = (small(), plan("whole"));
    let (runs, files) = make(&map, &plan).unwrap();
    assert_eq!(runs, 6);
    let csv = fs::read_to_string(&files[0]).unwrap();
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(
        lines[0],
        "cell,method,speed_mm_s,wavelength_mm,rms_percent,bias_percent,valid_share,estimates,valid,wrong,wrong_share,key"
    );
    assert_eq!(lines.len(), 7);
    assert!(lines[6].starts_with("5,counting,70,4,"), "{}", lines[6]);
    let svg = fs::read_to_string(&files[1]).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    for label in ["speed v in mm/s", "wavelength λ in mm", "counting"] {
        assert!(svg.contains(label), "{label}");
    }
    let words = fs::read_to_string(&files[2]).unwrap();
    assert!(words.contains("\n- counting is valid for "), "{words}");
}

#[test]
fn a_map_that_is_there_is_not_run_again() {
    let (map, plan) = (small(), plan("again"));
    let (_, files) = make(&map, &plan).unwrap();
    let first = fs::read(&files[0]).unwrap();
    assert_eq!(make(&map, &plan).unwrap().0, 0);
    assert_eq!(fs::read(&files[0]).unwrap(), first);
}

#[test]
fn a_map_that_was_stopped_anywhere_comes_to_the_same_file() {
    let (map, plan) = (small(), plan("stopped"));
    let (_, files) = make(&map, &plan).unwrap();
    let whole = fs::read(&files[0]).unwrap();
    let rows: Vec<&[u8]> = whole.split_inclusive(|byte| *byte == b'\n').collect();
    // Rows in another order, the last one or the header cut off at several places, and nothing at all.
    let some = [rows[0], rows[5], rows[2], rows[4]].concat();
    let before_last = some.len() - rows[4].len();
    for end in [
        0,
        3,
        rows[0].len() - 1,
        rows[0].len(),
        before_last + 1,
        some.len() - 1,
        some.len(),
    ] {
        fs::write(&files[0], &some[..end]).unwrap();
        let there = some[..end].iter().filter(|byte| **byte == b'\n').count();
        let (runs, _) = make(&map, &plan).unwrap();
        assert_eq!(runs, 6 - there.saturating_sub(1), "cut at {end}");
        assert_eq!(fs::read(&files[0]).unwrap(), whole, "cut at {end}");
    }
}

#[test]
fn shards_come_to_the_same_file_as_the_whole() {
    let (map, mut plan) = (small(), plan("shards"));
    let (_, files) = make(&map, &plan).unwrap();
    let whole = fs::read(&files[0]).unwrap();
    fs::remove_file(&files[0]).unwrap();
    for number in 1..=3 {
        let text = format!("{number}/4");
        plan.shard = Some(text.parse().unwrap());
        let (_, files) = make(&map, &plan).unwrap();
        let name = files[0].file_name().unwrap().to_string_lossy().into_owned();
        assert_eq!(name, format!("small.{number}-of-4.csv"));
        assert_eq!(files.len(), 1, "no picture");
    }
    plan.shard = None;
    let survey = Survey::open(&map, &plan).unwrap();
    let lacking = survey.complete().unwrap_err().to_string();
    // Cell 3 only.
    assert!(
        lacking.contains("1 of 6 runs are missing (of the shards 4/4)"),
        "{lacking}"
    );
    drop(survey);
    let (runs, files) = make(&map, &plan).unwrap();
    assert_eq!(runs, 1);
    assert_eq!(fs::read(&files[0]).unwrap(), whole);
}

#[test]
fn a_file_of_another_grid_or_version_is_refused_and_renewed_if_asked() {
    let (map, mut plan) = (small(), plan("foreign"));
    let (_, files) = make(&map, &plan).unwrap();
    let whole = fs::read_to_string(&files[0]).unwrap();
    let key = whole.lines().nth(1).unwrap().rsplit(',').next().unwrap();
    let other = Map {
        base: vec![Knob::SNR.at(21.0)],
        ..small()
    };
    for (what, line, text) in [
        (
            "the header is not that of small",
            1,
            "λ;v\n1;2\n".to_owned(),
        ),
        ("another version", 2, whole.replace(key, "0123456789abcdef")),
        (
            "\"steam\" is unknown here",
            3,
            whole.replacen("1,counting", "1,steam", 1),
        ),
        (
            "cell 2 of this map is another",
            4,
            whole.replacen("\n2,counting,30,", "\n2,counting,31,", 1),
        ),
        ("rms_percent is \"NaN\"", 2, {
            let rms = whole.lines().nth(1).unwrap().split(',').nth(4).unwrap();
            whole.replacen(rms, "NaN", 1)
        }),
    ] {
        assert_ne!(text, whole);
        fs::write(&files[0], text).unwrap();
        let refusal = refusal(&map, &plan);
        let at = format!("{}:{line}: ", files[0].display());
        assert!(
            refusal.starts_with(&at) && refusal.contains(what) && refusal.contains("--renew"),
            "{refusal}"
        );
        plan.renew = true;
        make(&map, &plan).unwrap();
        plan.renew = false;
        assert_eq!(fs::read_to_string(&files[0]).unwrap(), whole);
    }
    assert!(refusal(&other, &plan).contains("measured on another grid"));
}

#[test]
fn a_file_that_another_process_writes_is_refused() {
    let (map, plan) = (small(), plan("busy"));
    fs::create_dir_all(&plan.folder).unwrap();
    let path = plan.folder.join("small.csv");
    let held = journal::lock(&path).unwrap();
    assert!(refusal(&map, &plan).contains("another hil-sim map writes it"));
    drop(held);
    // A shard at work keeps the whole from being joined.
    let held = journal::lock(&plan.folder.join("small.1-of-2.csv")).unwrap();
    fs::write(plan.folder.join("small.1-of-2.csv"), row::header(&map)).unwrap();
    assert!(refusal(&map, &plan).contains("small.1-of-2.csv: another hil-sim map writes it"));
    drop(held);
    assert_eq!(make(&map, &plan).unwrap().0, 6);
}

#[test]
fn methods_are_added_to_a_map_without_running_the_others_again() {
    let (map, mut plan) = (small(), plan("methods"));
    make(&map, &plan).unwrap();
    plan.methods = vec!["default".into(), "counting".into()];
    let mut survey = Survey::open(&map, &plan).unwrap();
    assert_eq!(survey.missing(), 6);
    survey.run(|| {}).unwrap();
    let made = survey.finish().unwrap();
    let methods: Vec<&str> = made.lines.iter().map(|line| &*line.cells[1].1).collect();
    // Those that maps compare by default come first.
    assert_eq!(methods, ["counting", "default"]);
    plan.methods = vec!["divination".into()];
    assert_eq!(refusal(&map, &plan), "map small");
}
