//! `hil-sim run` as a person or a script meets it.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use hil_sim_core::scene::Estimator;
use protocol::Role;

use crate::{command, elf, errors, folder, hil_sim, json};

const SOUND: &str = "duration_s = 0.5\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";

#[test]
fn a_scene_that_is_as_expected_exits_0_and_writes_json_and_report() {
    let folder = folder("as-expected");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    let output = hil_sim(
        &folder,
        &["run", "a.toml", "--json", "o.json", "--report", "o.html"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let json = json(&folder.join("o.json"));
    assert_eq!(json[0]["name"], "a");
    assert_eq!(json[0]["engine"], "native");
    assert_eq!(json[0]["method"], Estimator::default().method.name());
    assert_eq!(json[0]["estimates"].as_array().unwrap().len(), 50);
    assert!(
        fs::read_to_string(folder.join("o.html"))
            .unwrap()
            .starts_with("<!doctype html>")
    );
}

#[test]
fn what_a_scene_s_author_should_know_is_told_by_goals_as_by_run() {
    let folder = folder("notes-of-goals");
    for family in [
        "table-1-20-db",
        "table-1-0-db",
        "off-grid",
        "fig7",
        "reversals",
        "boundary",
        "slow-fast",
        "gauge-trouble",
        "hum",
        "stick-slip-force",
        "stick-slip-blind",
    ] {
        fs::create_dir(folder.join(family)).unwrap();
        fs::write(folder.join(family).join("a.toml"), SOUND).unwrap();
    }
    let old = format!("{SOUND}[estimator]\nmethod = \"bank\"\n");
    fs::write(folder.join("hum/a.toml"), old).unwrap();
    for words in [&["run", "hum/a.toml"][..], &["goals", "--scenes", "."]] {
        let output = hil_sim(&folder, words);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        let told = errors(&output);
        let note = "hum/a.toml:5: estimator.method: method = \"bank\" is now \"spectrum\"";
        assert!(told.contains(note), "{words:?}: {told}");
    }
}

#[test]
fn a_scene_is_never_written_over_with_results() {
    let folder = folder("over-a-scene");
    for name in ["a.toml", "b.toml"] {
        fs::write(folder.join(name), SOUND).unwrap();
    }
    for option in ["--json", "--junit", "--report"] {
        // As a shell makes it of `--json *.toml`.
        let output = hil_sim(&folder, &["run", option, "a.toml", "b.toml"]);
        assert_eq!(output.status.code(), Some(2), "{option}");
        let complaint = errors(&output);
        assert!(
            complaint.contains("a.toml: is a scene's name"),
            "{complaint}"
        );
        assert_eq!(fs::read_to_string(folder.join("a.toml")).unwrap(), SOUND);
    }
}

#[test]
fn a_demo_or_a_paper_is_never_written_over_anything_else() {
    let folder = folder("over-a-note");
    for (command, option) in [("demo", "--report"), ("paper", "--out")] {
        for (name, says) in [
            ("a.toml", "is a scene's name"),
            ("note.html", "is there, and no result from before"),
        ] {
            fs::write(folder.join(name), SOUND).unwrap();
            let [sensor, display] =
                [Role::Sensor, Role::Display].map(|role| elf(role).display().to_string());
            let output = hil_sim(
                &folder,
                &[
                    command,
                    option,
                    name,
                    "--sensor-elf",
                    &sensor,
                    "--display-elf",
                    &display,
                ],
            );
            assert_eq!(output.status.code(), Some(2), "{command} {name}");
            let complaint = errors(&output);
            assert!(complaint.contains(says), "{complaint}");
            assert_eq!(fs::read_to_string(folder.join(name)).unwrap(), SOUND);
        }
    }
}

#[test]
fn a_long_name_leaves_the_columns_where_they_are() {
    let folder = folder("long-name");
    let name = "a-name-that-is-longer-than-any-column-would-have-been";
    fs::write(folder.join("a.toml"), format!("name = \"{name}\"\n{SOUND}")).unwrap();
    fs::write(folder.join("b.toml"), format!("name = \"b\"\n{SOUND}")).unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "b.toml"]);
    let text = String::from_utf8(output.stdout).unwrap();
    // Where each number of the first column ends.
    let ends: Vec<Option<usize>> = text
        .lines()
        .skip(1)
        .map(|line| line.find(" 2.0").map(|at| at + " 2.000".len()))
        .collect();
    assert_eq!(ends.len(), 2, "{text}");
    assert!(ends[0].is_some() && ends[0] == ends[1], "{text}");
}

/// A scene whose motion is a file's.
const RECORDED: &str = "duration_s = 0.5
[surface]
specimens = [{ wavelength_mm = 2.0 }]
[motion]
kind = \"recorded\"
file = \"m.csv\"
";

#[test]
fn nothing_but_results_is_written_over_with_results() {
    let folder = folder("over-an-input");
    let motion = "t_s,x_mm\n0,0\n2,100\n";
    fs::write(folder.join("m.csv"), motion).unwrap();
    fs::write(folder.join("s.toml"), RECORDED).unwrap();
    // A scene may have any name, and begin with a bracket as JSON does.
    let other = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    fs::write(folder.join("scene"), other).unwrap();
    std::os::unix::fs::symlink("s.toml", folder.join("link.json")).unwrap();
    for option in ["--json", "--junit", "--report"] {
        for (scene, file) in [
            ("s.toml", "m.csv"),
            ("scene", "scene"),
            ("s.toml", "link.json"),
        ] {
            let output = hil_sim(&folder, &["run", scene, option, file]);
            assert_eq!(output.status.code(), Some(2), "{option} {file}");
            let complaint = errors(&output);
            let is_told = complaint.contains(&format!("{file}: is there, and no result"));
            assert!(is_told, "{complaint}");
        }
        // One from before is.
        for _ in 0..2 {
            let output = hil_sim(&folder, &["run", "s.toml", option, "o"]);
            assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        }
        fs::remove_file(folder.join("o")).unwrap();
    }
    let output = hil_sim(
        &folder,
        &["run", "s.toml", "--json", "both", "--report", "both"],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(errors(&output).contains("both: is being written already"));
    for (file, text) in [("m.csv", motion), ("s.toml", RECORDED), ("scene", other)] {
        assert_eq!(fs::read_to_string(folder.join(file)).unwrap(), text);
    }
    let mut left: Vec<String> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["link.json", "m.csv", "s.toml", "scene"]);
}

#[test]
fn results_from_before_stay_until_there_are_new_ones() {
    let folder = folder("killed");
    let before = "[{ \"name\": \"before\" }]\n";
    fs::write(folder.join("o.json"), before).unwrap();
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    let long = SOUND.replace("0.5", "600.0");
    fs::write(folder.join("long.toml"), long).unwrap();
    let mut run = command(&folder, &["run", "a.toml", "long.toml", "--json", "o.json"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // Until the first scene's line, the second one of all, is there.
    let lines = BufReader::new(run.stdout.take().unwrap()).lines();
    assert_eq!(lines.take(2).map_while(Result::ok).count(), 2);
    run.kill().unwrap();
    run.wait().unwrap();
    let text = fs::read_to_string(folder.join("o.json")).unwrap();
    assert_eq!(text, before);
}

#[test]
fn a_run_that_a_signal_ends_leaves_no_draft() {
    let folder = folder("ended");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    fs::write(folder.join("long.toml"), SOUND.replace("0.5", "600.0")).unwrap();
    for (name, number) in [("INT", 2), ("TERM", 15)] {
        let mut run = command(&folder, &["run", "a.toml", "long.toml"])
            .args(["--json", "o.json", "--junit", "o.xml"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(run.stdout.take().unwrap()).lines();
        assert_eq!(lines.take(2).map_while(Result::ok).count(), 2);
        assert!(folder.join("o.json.part").exists() && folder.join("o.xml.part").exists());
        let sent = Command::new("kill")
            .args(["-s", name, &run.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        assert_eq!(run.wait().unwrap().signal(), Some(number));
        let left = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap());
        let mut left: Vec<_> = left.map(|entry| entry.file_name()).collect();
        left.sort();
        assert_eq!(left, ["a.toml", "long.toml"], "{name}");
    }
}

#[test]
fn a_device_takes_results_as_a_file_does() {
    let folder = folder("device");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "/dev/stdout"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("\"name\": \"a\"")
    );
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "/dev/full"]);
    assert_eq!(output.status.code(), Some(2), "{}", errors(&output));
    assert!(errors(&output).contains("/dev/full"));
    assert!(!Path::new("/dev/full.part").exists());
}

/// What a shell's commands print, with the program as `$0`.
fn shell(folder: &Path, commands: &str) -> (Option<i32>, String) {
    let output = Command::new("sh")
        .args(["-c", commands])
        .arg(command(folder, &[]).get_program())
        .current_dir(folder)
        .output()
        .unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    (output.status.code(), printed)
}

#[test]
fn standard_output_takes_results_alone_and_keeps_what_is_there() {
    let folder = folder("standard-output");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    let (status, _) = shell(
        &folder,
        "{ echo first; \"$0\" run a.toml --json /dev/stdout; \"$0\" run a.toml --json /dev/stdout; echo last; } > log.txt",
    );
    assert_eq!(status, Some(0));
    let log = fs::read_to_string(folder.join("log.txt")).unwrap();
    assert!(
        log.starts_with("first\n[") && log.ends_with("]\nlast\n"),
        "{log}"
    );
    assert_eq!(log.matches("\"name\": \"a\"").count(), 2);
    let (status, printed) = shell(&folder, "\"$0\" run a.toml --json /dev/stdout");
    assert_eq!(status, Some(0));
    let results: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(results[0]["name"], "a");
}

#[test]
fn standard_output_takes_one_result() {
    let folder = folder("one-result");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    for second in ["/dev/stdout", "/dev/fd/1"] {
        let output = hil_sim(
            &folder,
            &["run", "a.toml", "--json", "/dev/stdout", "--junit", second],
        );
        assert_eq!(output.status.code(), Some(2), "{second}");
        let want = format!("{second}: standard output takes one result: give the other a file");
        assert!(errors(&output).contains(&want), "{}", errors(&output));
        assert!(output.stdout.is_empty(), "{second}");
    }
}

#[test]
fn nothing_but_results_and_drafts_of_them_is_written_over() {
    let folder = folder("over-nothing");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    fs::write(folder.join("o.json.part"), "my notes").unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "o.json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        errors(&output).contains("o.json.part: is there, and no draft"),
        "{}",
        errors(&output)
    );
    let notes = fs::read_to_string(folder.join("o.json.part")).unwrap();
    assert_eq!(notes, "my notes");
    // What a run that was killed has left is one.
    fs::write(folder.join("o.json.part"), "[{ \"name\"").unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "o.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert!(
        serde_json::from_str::<serde_json::Value>(
            &fs::read_to_string(folder.join("o.json")).unwrap()
        )
        .is_ok()
    );
    std::os::unix::fs::symlink("later.json", folder.join("link.json")).unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "link.json"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        errors(&output).contains("leads nowhere"),
        "{}",
        errors(&output)
    );
}

#[test]
fn gauges_may_come_out_of_a_pipe() {
    let folder = folder("gauges-pipe");
    let rows = (0..8_000).map(|n| format!("{},1.6,1.7,1.65,1.6,1.7\n", f64::from(n) * 250e-6));
    let table = format!("t_s,g0,g1,g2,g3,g4\n{}", rows.collect::<String>());
    let gauges = "[gauges]\nkind = \"recorded\"\nfile = \"/dev/stdin\"\n";
    fs::write(folder.join("a.toml"), format!("{SOUND}{gauges}")).unwrap();
    let mut run = command(&folder, &["run", "a.toml"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = run.stdin.take().unwrap();
    // A pipe holds less than the table, and is closed behind it.
    let writer = thread::spawn(move || pipe.write_all(table.as_bytes()));
    let output = run.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    writer.join().unwrap().unwrap();
}

#[test]
fn exactly_5_mm_s_is_no_motion() {
    let folder = folder("no-motion");
    let scene = "duration_s = 2\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n[motion]\nspeed_mm_s = 5\n";
    fs::write(folder.join("a.toml"), scene).unwrap();
    let (_, printed) = shell(&folder, "\"$0\" run a.toml --json /dev/stdout");
    let results: serde_json::Value = serde_json::from_str(&printed).unwrap();
    for share in ["valid_share", "felt_right_share", "felt_wrong_share"] {
        let share_told = results[0]["summary"].get(share);
        assert_eq!(share_told, Some(&serde_json::Value::Null), "{share}");
    }
}

#[test]
fn results_that_find_no_room_leave_no_draft_and_the_earlier_ones_in_place() {
    let folder = folder("no-room");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    for (option, file, before) in [("--json", "o.json", "[]\n"), ("--junit", "o.xml", "<?xml")] {
        fs::write(folder.join(file), before).unwrap();
        // A limit on a file's length stands in for a full disk.
        let limited = "trap '' XFSZ; ulimit -f 0; exec \"$@\"";
        let run = command(&folder, &["run", "a.toml", option, file]);
        let output = Command::new("sh")
            .args(["-c", limited, "sh"])
            .arg(run.get_program())
            .args(run.get_args())
            .current_dir(&folder)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", errors(&output));
        let told = errors(&output);
        let want = format!("{file}: can't be written: make room there, or give a file elsewhere: ");
        assert!(told.contains(&want), "{told}");
        assert!(!folder.join(format!("{file}.part")).exists(), "{told}");
        assert_eq!(fs::read_to_string(folder.join(file)).unwrap(), before);
    }
}

#[test]
fn a_scene_of_the_banks_runs_with_its_successor_and_standard_error_says_so_once() {
    let folder = folder("successor");
    let text = format!("{SOUND}[estimator]\nmethod = \"bank\"\n");
    fs::write(folder.join("a.toml"), text).unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "o.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert_eq!(
        errors(&output),
        "a.toml:5: estimator.method: method = \"bank\" is now \"spectrum\", its successor\n"
    );
    let json = json(&folder.join("o.json"));
    assert_eq!(json[0]["method"], "spectrum");
    // What is felt is in the summary, and in the line that is printed.
    let right = json[0]["summary"]["felt_right_share"].as_f64().unwrap();
    assert!((0.5..=1.0).contains(&right), "{right}");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("felt right  felt wrong"), "{said}");
    assert!(said.contains(&format!("  {right:.2}  ")), "{said}");
}

#[test]
fn an_expectation_that_fails_exits_1_and_json_is_written_all_the_same() {
    let folder = folder("not-as-expected");
    fs::write(
        folder.join("a.toml"),
        format!("{SOUND}[expect]\nmean_mm = 3.0\n"),
    )
    .unwrap();
    let output = hil_sim(&folder, &["run", "a.toml", "--json", "o.json"]);
    assert_eq!(output.status.code(), Some(1), "{}", errors(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("not as expected: mean_mm: "));
    assert!(
        fs::read_to_string(folder.join("o.json"))
            .unwrap()
            .starts_with('[')
    );
}

#[test]
fn a_scene_that_cannot_be_used_exits_2_before_anything_runs() {
    let folder = folder("unusable");
    fs::write(folder.join("good.toml"), SOUND).unwrap();
    fs::write(folder.join("bad.toml"), "duration_s = 0\n").unwrap();
    fs::write(folder.join("worse.toml"), "x = 1\n").unwrap();
    let output = hil_sim(
        &folder,
        &[
            "run",
            "good.toml",
            "bad.toml",
            "worse.toml",
            "--json",
            "o.json",
        ],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    let errors = errors(&output);
    let lines: Vec<&str> = errors.lines().collect();
    assert_eq!(lines.len(), 2, "{errors}");
    assert!(
        lines[0].starts_with("bad.toml:1: duration_s: 0 is not a duration"),
        "{errors}"
    );
    assert!(
        lines[1].starts_with("worse.toml:1: surface.specimens: there are none"),
        "{errors}"
    );
    assert!(!folder.join("o.json").exists());
}

#[test]
fn an_output_that_cannot_be_written_exits_2_before_anything_runs() {
    let folder = folder("unwritable");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    let output = hil_sim(
        &folder,
        &["run", "a.toml", "--json", "no-such-folder/o.json"],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    assert!(errors(&output).starts_with("no-such-folder/o.json: cannot be written"));
}

#[test]
fn no_scene_and_unknown_engines_exit_2() {
    let folder = folder("usage");
    for arguments in [
        &["run"][..],
        &["run", "a.toml", "--engine", "steam"],
        &["fly"],
    ] {
        assert_eq!(
            hil_sim(&folder, arguments).status.code(),
            Some(2),
            "{arguments:?}"
        );
    }
}

#[test]
fn a_reader_that_goes_away_changes_neither_files_nor_exit_status() {
    let folder = folder("unread");
    let scene = format!("{SOUND}[expect]\nmean_mm = 3.0\n");
    fs::write(folder.join("a.toml"), scene).unwrap();
    let mut child = command(&folder, &["run", "a.toml", "--json", "o.json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", errors(&output));
    assert_eq!(errors(&output), "");
    let json = json(&folder.join("o.json"));
    assert_eq!(json[0]["name"], "a");
}

#[test]
fn a_device_without_an_end_is_no_scene_and_holds_no_hashes() {
    let folder = folder("endless");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    for (arguments, file) in [
        (&["run", "/dev/zero"][..], "/dev/zero"),
        (
            &["golden", "renew", "a.toml", "--file", "/dev/full"],
            "/dev/full",
        ),
    ] {
        let output = hil_sim(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let want = format!("{file}: cannot be read: is no file, and does not end within 64 MB");
        assert!(errors(&output).starts_with(&want), "{}", errors(&output));
    }
}

#[test]
fn a_scene_out_of_a_pipe_is_read_once() {
    let folder = folder("pipe");
    let pipe = folder.join("p.toml");
    let made = Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let mut run = command(&folder, &["run", "p.toml"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    fs::write(&pipe, SOUND).unwrap();
    // All scenes have been read by the first line.
    let mut lines = BufReader::new(run.stdout.take().unwrap()).lines();
    assert!(lines.next().is_some_and(|line| line.is_ok()));
    let is_read_again = Arc::new(AtomicBool::new(false));
    let again = is_read_again.clone();
    // Waits until somebody reads.
    thread::spawn(move || {
        let _pipe = File::options().write(true).open(&pipe).unwrap();
        again.store(true, Ordering::SeqCst);
    });
    assert_eq!(run.wait().unwrap().code(), Some(0));
    assert!(!is_read_again.load(Ordering::SeqCst));
}

#[test]
fn where_nobody_can_be_told_the_exit_status_says_it() {
    let folder = folder("untold");
    let full = File::options().write(true).open("/dev/full").unwrap();
    let status = command(&folder, &["run", "nosuch"])
        .stderr(full)
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn a_folder_that_leads_back_to_itself_is_looked_through_once() {
    let folder = folder("loop");
    fs::create_dir(folder.join("in")).unwrap();
    fs::write(folder.join("in/a.toml"), SOUND).unwrap();
    std::os::unix::fs::symlink("..", folder.join("in/back")).unwrap();
    std::os::unix::fs::symlink("in", folder.join("named")).unwrap();
    for named in [".", "named"] {
        let output = hil_sim(&folder, &["run", named]);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        // The head and the scene.
        assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 2);
    }
}

#[test]
fn a_dash_is_no_file_for_results() {
    let folder = folder("dash");
    fs::write(folder.join("a.toml"), SOUND).unwrap();
    for option in ["--json", "--report", "--junit"] {
        let output = hil_sim(&folder, &["run", "a.toml", option, "-"]);
        assert_eq!(output.status.code(), Some(2), "{option}");
        assert!(errors(&output).contains("give /dev/stdout"), "{option}");
    }
    assert!(!folder.join("-").exists());
}
