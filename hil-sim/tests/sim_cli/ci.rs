//! `hil-sim` in somebody's CI: JUnit XML, annotations, shards, threads, golden hashes, a first scene.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use quick_junit::Report;
use serde_json::Value;

use crate::{command, folder, told};

const SOUND: &str = "duration_s = 0.3\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";

/// Runs `hil-sim` in `folder`: exit status, standard output, standard error.
fn hil_sim(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    told(crate::hil_sim(folder, arguments))
}

/// Scenes of these names, all sound, with the name's place as seed.
fn scenes(folder: &Path, names: &[&str]) {
    for (seed, name) in names.iter().enumerate() {
        let noise = "[gauges]\nsnr_db = 20\n";
        let text = format!("seed = {seed}\n{SOUND}{noise}");
        fs::write(folder.join(format!("{name}.toml")), text).unwrap();
    }
}

fn json(folder: &Path, file: &str) -> Vec<Value> {
    let text = fs::read_to_string(folder.join(file)).unwrap();
    let Value::Array(list) = serde_json::from_str(&text).unwrap() else {
        panic!("no list: {text}")
    };
    list
}

#[test]
fn what_is_not_as_expected_is_a_failure_and_an_annotation_at_its_line() {
    let folder = folder("ci/failure");
    scenes(&folder, &["good"]);
    let bad = format!("{SOUND}\n[expect]\nwrong_share_max = 0.5\nmean_mm = 3.0\n");
    fs::write(folder.join("bad.toml"), bad).unwrap();
    let arguments = ["run", "good.toml", "bad.toml", "--junit", "out.xml"];
    let (status, plain, errors) = hil_sim(&folder, &arguments);
    assert_eq!(status, Some(1), "{errors}");
    assert!(!plain.contains("::error"), "{plain}");
    let annotated = [
        told(
            command(&folder, &arguments)
                .args(["--annotate", "github"])
                .output()
                .unwrap(),
        ),
        told(
            command(&folder, &arguments)
                .env("GITHUB_ACTIONS", "true")
                .output()
                .unwrap(),
        ),
    ];
    for (status, output, _) in annotated {
        assert_eq!(status, Some(1));
        let lines: Vec<&str> = output
            .lines()
            .filter(|line| line.starts_with("::"))
            .collect();
        assert_eq!(lines.len(), 1, "{output}");
        let start = "::error file=bad.toml,line=7,title=bad is not as expected::mean_mm: ";
        let rest = lines[0].strip_prefix(start).expect(lines[0]);
        let (mean_mm, end) = rest.split_once(" is ").expect(rest);
        assert!(
            (mean_mm.parse::<f64>().unwrap() - 2.0).abs() < 0.01,
            "{rest}"
        );
        assert_eq!(end, "not within 2.9700 and 3.0300");
    }
    let off = told(
        command(&folder, &arguments)
            .env("GITHUB_ACTIONS", "true")
            .args(["--annotate", "off"])
            .output()
            .unwrap(),
    );
    assert!(!off.1.contains("::error"));

    let report =
        Report::deserialize_from_str(&fs::read_to_string(folder.join("out.xml")).unwrap()).unwrap();
    let suite = &report.test_suites[0];
    assert_eq!((suite.tests, suite.failures, suite.errors), (2, 1, 0));
    let names: Vec<&str> = suite
        .test_cases
        .iter()
        .map(|case| case.name.as_str())
        .collect();
    assert_eq!(names, ["good", "bad"]);
}

#[test]
fn what_cannot_be_used_is_an_error_at_its_line_and_nothing_runs() {
    let folder = folder("ci/error");
    scenes(&folder, &["good"]);
    fs::write(folder.join("bad.toml"), "seed = 1\nduration_s = 0\n").unwrap();
    let board = format!("{SOUND}[[fault]]\nkind = \"panic\"\nat_s = 0.1\n");
    fs::write(folder.join("board.toml"), board).unwrap();
    let (status, output, errors) = hil_sim(
        &folder,
        &[
            "run",
            "good.toml",
            "bad.toml",
            "board.toml",
            "--junit",
            "out.xml",
            "--annotate",
            "github",
        ],
    );
    assert_eq!(status, Some(2));
    let lines: Vec<&str> = output.lines().collect();
    assert_eq!(lines.len(), 2, "{output}");
    assert!(lines[0].starts_with("::error file=bad.toml,line=2,title=this scene cannot be used::bad.toml:2: duration_s: 0 is not"), "{output}");
    assert!(
        lines[1].starts_with("::error file=board.toml,line=5,"),
        "{output}"
    );
    assert!(
        errors.contains("board.toml:5: fault[0].kind: \"panic\" breaks a board"),
        "{errors}"
    );
    let report =
        Report::deserialize_from_str(&fs::read_to_string(folder.join("out.xml")).unwrap()).unwrap();
    let suite = &report.test_suites[0];
    assert_eq!((suite.tests, suite.errors), (3, 2));
}

#[test]
fn every_scene_is_in_one_shard_and_threads_change_nothing() {
    let folder = folder("ci/shards");
    let names = ["a", "b", "c", "d", "e", "f", "g"];
    fs::create_dir(folder.join("more")).unwrap();
    scenes(&folder, &names[..4]);
    scenes(&folder.join("more"), &names[4..]);
    fs::write(folder.join("golden.toml"), "").unwrap();
    let names_of = |list: &[Value]| -> Vec<String> {
        list.iter()
            .map(|scene| scene["name"].as_str().unwrap().to_owned())
            .collect()
    };
    let mut all = Vec::new();
    let mut hashes = BTreeSet::new();
    for jobs in ["1", "3", "0"] {
        let (status, _, errors) = hil_sim(&folder, &["run", ".", "-j", jobs, "--json", "all.json"]);
        assert_eq!(status, Some(0), "{errors}");
        let list = json(&folder, "all.json");
        assert_eq!(names_of(&list), names);
        hashes.insert(
            list.iter()
                .map(|scene| scene["hash"].to_string())
                .collect::<Vec<_>>(),
        );
        all = list;
    }
    assert_eq!(hashes.len(), 1, "{hashes:?}");
    let mut seen = Vec::new();
    for shard in ["1/3", "2/3", "3/3"] {
        let (status, ..) = hil_sim(
            &folder,
            &["run", ".", "--shard", shard, "--json", "part.json"],
        );
        assert_eq!(status, Some(0));
        for scene in json(&folder, "part.json") {
            let whole = all
                .iter()
                .find(|other| other["name"] == scene["name"])
                .unwrap();
            assert_eq!(whole["hash"], scene["hash"]);
            seen.push(scene["name"].as_str().unwrap().to_owned());
        }
    }
    seen.sort();
    assert_eq!(seen, names);
    // More shards than scenes: some have nothing to do, and that is well.
    let (status, ..) = hil_sim(
        &folder,
        &["run", "a.toml", "--shard", "2/2", "--json", "none.json"],
    );
    assert_eq!((status, json(&folder, "none.json").len()), (Some(0), 0));
    let (status, _, errors) = hil_sim(&folder, &["run", "a.toml", "--shard", "3/2"]);
    assert_eq!(status, Some(2));
    assert!(errors.contains("give i/n"), "{errors}");
}

#[test]
fn golden_hashes_hold_until_a_run_changes_and_are_renewed_by_one_command() {
    let folder = folder("ci/golden");
    scenes(&folder, &["a", "b"]);
    let (status, _, errors) = hil_sim(&folder, &["golden", "check", "a.toml"]);
    assert_eq!(status, Some(2));
    assert!(errors.contains("golden.toml: cannot be read"), "{errors}");
    let (status, output, _) = hil_sim(&folder, &["golden", "renew", "a.toml"]);
    assert_eq!(status, Some(0));
    assert!(
        output.contains("a.toml: native: ") && output.contains(", new"),
        "{output}"
    );
    let (status, output, _) = hil_sim(
        &folder,
        &["golden", "check", ".", "-j", "2", "--repeat", "5"],
    );
    assert_eq!(status, Some(1), "b has no hash");
    assert!(
        output.contains("b.toml: golden: golden.toml has no hash of b.toml"),
        "{output}"
    );
    assert_eq!(hil_sim(&folder, &["golden", "renew", "."]).0, Some(0));
    let (status, output, _) = hil_sim(&folder, &["golden", "check", ".", "--repeat", "5"]);
    assert_eq!(status, Some(0), "{output}");
    assert!(output.contains("2 scenes, 10 runs (native)"), "{output}");
    assert_eq!(
        hil_sim(&folder, &["run", ".", "--golden", "golden.toml"]).0,
        Some(0)
    );

    let text = fs::read_to_string(folder.join("b.toml")).unwrap();
    fs::write(folder.join("b.toml"), text.replace("seed = 1", "seed = 2")).unwrap();
    for arguments in [
        &["golden", "check", "."][..],
        &["run", ".", "--golden", "golden.toml", "--junit", "out.xml"],
    ] {
        let (status, output, _) = told(
            command(&folder, arguments)
                .args(["--annotate", "github"])
                .output()
                .unwrap(),
        );
        assert_eq!(status, Some(1), "{output}");
        assert!(output.contains("the run has changed: look at what and why, and if it is meant, hil-sim golden renew"), "{output}");
        assert!(!output.contains("FAILED") || output.matches("FAILED").count() == 1);
        assert!(
            output.contains("::error file=golden.toml,line=8,"),
            "{output}"
        );
        assert!(!output.contains("file=a.toml"), "{output}");
    }
    assert!(
        fs::read_to_string(folder.join("out.xml"))
            .unwrap()
            .contains("failures=\"1\"")
    );
    let (status, output, _) = hil_sim(&folder, &["golden", "renew", "."]);
    assert_eq!(status, Some(0));
    assert!(
        output.contains(" -> ") && output.contains("1 of 2 unchanged"),
        "{output}"
    );
    assert_eq!(hil_sim(&folder, &["golden", "check", "."]).0, Some(0));
    let (status, _, errors) = hil_sim(&folder, &["golden", "check", "golden.toml"]);
    assert_eq!(status, Some(2));
    assert!(errors.contains("is no scene"), "{errors}");
}

#[test]
fn a_report_says_that_a_run_has_changed_since_its_golden_hash() {
    let folder = folder("ci/golden-report");
    scenes(&folder, &["a", "b"]);
    assert_eq!(hil_sim(&folder, &["golden", "renew", "."]).0, Some(0));
    let text = fs::read_to_string(folder.join("b.toml")).unwrap();
    fs::write(folder.join("b.toml"), text.replace("seed = 1", "seed = 2")).unwrap();
    let arguments = ["run", ".", "--golden", "golden.toml", "--report", "o.html"];
    assert_eq!(hil_sim(&folder, &arguments).0, Some(1));
    let page = fs::read_to_string(folder.join("o.html")).unwrap();
    assert_eq!(page.matches("<span class=unmet>unmet</span>").count(), 1);
    assert_eq!(page.matches("Not as expected: golden: ").count(), 1);
}

#[test]
fn the_first_scene_is_written_once_loads_and_passes() {
    let folder = folder("ci/init");
    let (status, output, errors) = hil_sim(&folder, &["init", "mine.toml"]);
    assert_eq!(status, Some(0), "{errors}");
    assert!(output.contains("hil-sim run mine.toml"), "{output}");
    let written = fs::read(folder.join("mine.toml")).unwrap();
    let (status, output, errors) = hil_sim(&folder, &["run", "mine.toml"]);
    assert_eq!(status, Some(0), "{output}{errors}");
    let (status, _, errors) = hil_sim(&folder, &["init", "mine.toml"]);
    assert_eq!(status, Some(2));
    assert!(
        errors.contains("mine.toml: cannot be made: give a file that is not there yet"),
        "{errors}"
    );
    assert_eq!(fs::read(folder.join("mine.toml")).unwrap(), written);
    assert_eq!(hil_sim(&folder, &["init"]).0, Some(0));
    assert!(folder.join("scene.toml").exists());
}

#[test]
fn every_line_of_the_first_scene_that_is_not_in_force_may_be() {
    let folder = folder("ci/init-all");
    hil_sim(&folder, &["init", "mine.toml"]);
    let text = fs::read_to_string(folder.join("mine.toml")).unwrap();
    // A key or a section behind "# ", at the line's beginning.
    let in_force: String = text
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(rest) if rest.starts_with('[') || rest.split(' ').nth(1) == Some("=") => rest,
            _ => line,
        })
        .filter(|line| !line.starts_with("kind = \"constant\"") && !line.starts_with("speed_mm_s"))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(
        in_force.contains("\nkind = \"link-down\"") && in_force.contains("\nkind = \"sinusoid\""),
        "{in_force}"
    );
    fs::write(folder.join("all.toml"), in_force).unwrap();
    let (status, _, errors) = hil_sim(&folder, &["run", "all.toml"]);
    assert_ne!(status, Some(2), "{errors}");
}

/// Scenes of each contact model, each family of faults, travelling, recorded input, a bad link: what was seen when
/// their hashes were renewed last is what still runs, on any machine.
#[test]
fn the_committed_golden_hashes_hold() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let toml = |file: &fs::DirEntry| file.path().extension().is_some_and(|end| end == "toml");
    let count = fs::read_dir(&scenes)
        .unwrap()
        .flatten()
        .filter(toml)
        .count();
    assert!(count > 20, "{count} files with the hashes' own");
    let (status, output, errors) =
        hil_sim(&scenes, &["golden", "check", "--file", "golden.toml", "."]);
    assert_eq!(status, Some(0), "{output}{errors}");
}

#[test]
fn a_file_that_holds_no_hashes_is_made_anew_as_its_refusal_says() {
    let folder = folder("ci/golden-garbage");
    scenes(&folder, &["a"]);
    let renew = ["golden", "renew", "--file", "g.toml", "a.toml"];
    for garbage in ["garbage [", "[\"a.toml\"]\nnative = \"7\"\n"] {
        fs::write(folder.join("g.toml"), garbage).unwrap();
        let (status, _, errors) = hil_sim(&folder, &renew);
        assert_eq!(status, Some(2), "{errors}");
        let advice = "take it away and make it anew with hil-sim golden renew --file g.toml";
        assert!(errors.contains(advice), "{errors}");
        fs::remove_file(folder.join("g.toml")).unwrap();
        assert_eq!(hil_sim(&folder, &renew).0, Some(0));
    }
    // Each cause is told once.
    let missing = ["golden", "check", "--file", "nowhere/g.toml", "a.toml"];
    for arguments in [
        missing,
        ["golden", "renew", "--file", "nowhere/g.toml", "a.toml"],
    ] {
        let (status, _, errors) = hil_sim(&folder, &arguments);
        assert_eq!(status, Some(2), "{errors}");
        assert!(errors.matches("No such file").count() <= 1, "{errors}");
    }
}
