//! `hil-sim jury` as a person or a script meets it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::{errors, hil_sim, json};

/// 2 mm, seen without noise.
const CLEAN: &str = "duration_s = 2.0\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";

/// A folder of the test's own, with these files in it and no others.
fn folder(test: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = crate::folder(&format!("jury/{test}"));
    for (name, text) in files {
        fs::write(folder.join(name), text).unwrap();
    }
    folder
}

fn jury(folder: &Path, arguments: &[&str]) -> Output {
    hil_sim(folder, &[&["jury"], arguments].concat())
}

/// Expects a refusal that says all of this.
fn refuses(folder: &Path, arguments: &[&str], said: &[&str]) {
    let output = jury(folder, arguments);
    let errors = errors(&output);
    assert_eq!(output.status.code(), Some(2), "{errors}");
    for said in said {
        assert!(errors.contains(said), "{said:?} is not in {errors:?}");
    }
}

#[test]
fn a_folder_is_judged_by_its_own_truths_family_by_family() {
    let index = r#"[
        { "name": "tip-F1-a", "truth": 2.0, "note": "as it is" },
        { "name": "tip-F2-b", "truth": 3.0, "note": "as it is not" },
        { "name": "flat", "truth": 0, "family": "nothing" },
        { "name": "half", "truth": [[0, 2.0], [1.505, 4.0]] }
    ]"#;
    let folder = folder(
        "judged",
        &[
            ("index.json", index),
            ("tip-F1-a.toml", CLEAN),
            ("tip-F2-b.toml", CLEAN),
            ("flat.toml", CLEAN),
            ("half.toml", CLEAN),
        ],
    );
    let output = jury(&folder, &["--folder", ".", "--json", "out.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let begin = |name: &str| text.lines().any(|line| line.starts_with(name));
    assert!(
        begin("family") && begin("tip ") && begin("nothing ") && begin("half ") && begin("all ")
    );
    let told = json(&folder.join("out.json"));
    assert_eq!(told["engine"], "native");
    let said = |scene: usize, key: &str| told["scenes"][scene]["said"][key].as_u64().unwrap();
    // 99 estimates come after 1 s.
    for scene in 0..4 {
        assert!((98..=100).contains(&said(scene, "all")));
    }
    assert_eq!(said(0, "right"), said(0, "all"));
    assert_eq!(said(1, "wrong"), said(1, "all"));
    assert_eq!(said(2, "wrong"), said(2, "all"));
    // Half of it is right.
    assert!((48..=52).contains(&said(3, "right")));
    assert_eq!(said(3, "right") + said(3, "wrong"), said(3, "all"));
    // What is felt is judged by the same truths.
    let felt = |scene: usize, key: &str| told["scenes"][scene]["felt"][key].as_f64().unwrap();
    assert!(felt(0, "right") > 0.9 && felt(0, "wrong") == 0.0);
    for scene in [1, 2] {
        let (right, wrong) = (felt(scene, "right"), felt(scene, "wrong"));
        assert!(right == 0.0 && wrong > 0.9, "{scene}: {right}, {wrong}");
    }
    let tip = &told["families"][0];
    assert_eq!((&tip["name"], &tip["surfaces"]), (&"tip".into(), &2.into()));
    assert_eq!(tip["right"]["share"], 0.5);
    assert_eq!(told["families"][3]["name"], "all");
}

#[test]
fn what_is_felt_right_and_wrong_are_shares_of_the_same_time() {
    let index = r#"[{ "name": "a", "truth": [[0, 2.0], [1.0, 0]] }]"#;
    let folder = folder("felt", &[("index.json", index), ("a.toml", CLEAN)]);
    let output = jury(&folder, &["--folder", ".", "--json", "out.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let told = json(&folder.join("out.json"));
    let felt = |key: &str| told["scenes"][0]["felt"][key].as_f64().unwrap();
    // Driven from some 0.1 s on; from 1 s on, half of the time, there is nothing that could be right.
    assert!((0.4..0.5).contains(&felt("right")), "{}", felt("right"));
    assert!((felt("wrong") - 0.5).abs() < 0.01, "{}", felt("wrong"));
}

#[test]
fn a_folder_that_cannot_be_judged_is_refused_with_what_where_and_what_to_do() {
    let judge = ["--folder", "."];
    refuses(
        &folder("empty", &[]),
        &judge,
        &[
            "index.json: cannot be read",
            "list of its scenes and their truths",
        ],
    );
    refuses(
        &folder("no-json", &[("index.json", "[{]")]),
        &judge,
        &["index.json: no JSON", "line 1"],
    );
    for nothing in ["[]", "{}"] {
        refuses(
            &folder("nothing", &[("index.json", nothing)]),
            &judge,
            &[
                "index.json: not a list with anything in it",
                "give a list of",
            ],
        );
    }
    for nameless in [r#"[{"truth": 2}]"#, r#"[{"name": "../a", "truth": 2}]"#] {
        refuses(
            &folder("nameless", &[("index.json", nameless)]),
            &judge,
            &["index.json: entry 1: no usable name"],
        );
    }
    for (truth, said) in [
        ("", "truth is missing"),
        (r#", "truth": -1"#, "truth is -1"),
        (r#", "truth": "2 mm""#, "truth is \"2 mm\""),
        (r#", "truth": [[1, 2], [0, 3]]"#, "truth is [[1,2],[0,3]]"),
    ] {
        let index = format!(r#"[{{"name": "a"{truth}}}]"#);
        refuses(
            &folder("bad-truth", &[("index.json", &index), ("a.toml", CLEAN)]),
            &judge,
            &["index.json: a: ", said, "give λ in mm"],
        );
    }
    refuses(
        &folder(
            "no-scene",
            &[("index.json", r#"[{"name": "gone", "truth": 2}]"#)],
        ),
        &judge,
        &["gone.toml: no such scene", "put it there"],
    );
    refuses(
        &folder(
            "bad-scene",
            &[
                ("index.json", r#"[{"name": "a", "truth": 2}]"#),
                ("a.toml", "duration_s = 0\n"),
            ],
        ),
        &judge,
        &["a.toml", "duration_s"],
    );
}

#[test]
fn strangers_are_judged_class_by_class_and_the_same_whatever_the_threads() {
    let folder = folder("strangers", &[]);
    let judged = |jobs: &str, file: &str| {
        let arguments = [
            "--seed",
            "30",
            "--surfaces",
            "12",
            "--shapes",
            "--force-channel",
            "-j",
            jobs,
            "--json",
            file,
        ];
        let output = jury(&folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let text = judged("1", "one.json");
    assert!(text.starts_with("seeds 30–41 (tuning), method "), "{text}");
    let heard = [
        "spectrum, force channel, valid",
        "of one wave alone, its shape",
    ];
    assert!(heard.iter().all(|heard| text.contains(heard)), "{text}");
    assert_eq!(text, judged("3", "three.json"));
    let told = json(&folder.join("one.json"));
    assert_eq!(told, json(&folder.join("three.json")));
    let trials = told["trials"].as_array().unwrap();
    let seeds: Vec<u64> = trials
        .iter()
        .map(|trial| trial["seed"].as_u64().unwrap())
        .collect();
    assert_eq!(seeds, (30..42).collect::<Vec<_>>());
    // The classes' surfaces are all surfaces; the last two rows say so again.
    let classes = told["classes"].as_array().unwrap();
    let surfaces = |rows: &[Value]| -> u64 {
        rows.iter()
            .map(|row| row["surfaces"].as_u64().unwrap())
            .sum()
    };
    let (each, both) = classes.split_at(classes.len() - 2);
    assert_eq!((surfaces(each), surfaces(both)), (12, 12));
}

#[test]
fn arguments_that_cannot_be_used_are_refused() {
    let folder = folder("arguments", &[]);
    refuses(
        &folder,
        &["--seed", "9990", "--surfaces", "20"],
        &["9990 to 10009", "10000–19999 for reporting"],
    );
    refuses(&folder, &["--surfaces", "0"], &["give 1 or more"]);
    refuses(
        &folder,
        &["--surfaces", "1", "--max-age-ms", "1"],
        &["--max-age-ms", "20..=5000"],
    );
    refuses(
        &folder,
        &["--surfaces", "1", "--valid-percent", "100"],
        &["--valid-percent", "50..=99"],
    );
    refuses(
        &folder,
        &["--surfaces", "1", "--json", "nowhere/out.json"],
        &["nowhere/out.json: cannot be written"],
    );
    // One or the other.
    refuses(&folder, &["--folder", ".", "--seed", "3"], &["--folder"]);
    refuses(&folder, &["--engine", "elf"], &["--folder"]);
    refuses(
        &folder,
        &["--engine", "elf", "--surfaces", "1"],
        &["--engine elf", "give --folder too"],
    );
    let largest = u64::MAX.to_string();
    refuses(
        &folder,
        &["--surfaces", "2", "--seed", &largest],
        &["beyond the largest, 18446744073709551615", "--seed"],
    );
}
