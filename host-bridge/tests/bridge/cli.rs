//! The command line, where no board is needed.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program, without the settings of whoever runs the tests.
fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_host-bridge"));
    command
        .args(arguments)
        .env_remove("RIDGELINK_BENCH")
        .env_remove("HOME")
        .env_remove("XDG_CONFIG_HOME");
    command
}

fn host_bridge(arguments: &[&str]) -> Output {
    command(arguments)
        .output()
        .expect("the program can be started")
}

/// An empty folder for one test.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("cli")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder can be made");
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn shells_get_their_completions() {
    for (shell, mark) in [
        ("bash", "complete -F _host"),
        ("zsh", "#compdef host-bridge"),
        ("fish", "complete -c host-bridge"),
    ] {
        let output = host_bridge(&["completions", shell]);
        assert_eq!(output.status.code(), Some(0), "{shell}");
        let script = text(&output.stdout);
        assert!(script.contains(mark), "{shell}: {script}");
        for command in [
            "flash",
            "monitor",
            "record",
            "replay",
            "export",
            "relay",
            "doctor",
            "configure",
        ] {
            assert!(script.contains(command), "{shell} has no {command}");
        }
    }
}

#[test]
fn an_empty_name_of_the_folder_of_settings_is_none() {
    let home = folder("settings");
    let settings = home.join(".config/ridgelink");
    fs::create_dir_all(&settings).expect("a folder can be made");
    fs::write(settings.join("bench.toml"), "[sensor]\nprot = 1\n").expect("a file can be made");
    let output = command(&["flash", "sensor", "--dry-run"])
        .env("XDG_CONFIG_HOME", "")
        .env("HOME", &home)
        .output()
        .expect("the program can be started");
    let words = text(&output.stderr);
    assert!(
        words.contains("bench.toml") && words.contains("prot"),
        "{words}"
    );
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let (reader, writer) = io::pipe().expect("the system has pipes");
    drop(reader);
    let output = command(&["completions", "fish"])
        .stdout(writer)
        .output()
        .expect("the program can be started");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(text(&output.stderr), "");
}

#[test]
fn man_pages_are_written_for_the_program_and_each_command() {
    let folder = folder("man").join("made");
    let output = host_bridge(&["man", &folder.to_string_lossy()]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    for page in [
        "host-bridge",
        "host-bridge-flash",
        "host-bridge-monitor",
        "host-bridge-record",
        "host-bridge-replay",
        "host-bridge-export",
        "host-bridge-relay",
        "host-bridge-doctor",
    ] {
        let path = folder.join(format!("{page}.1"));
        let page = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
        assert!(page.contains(".TH "), "{path:?}: {page}");
    }
}

#[test]
fn a_folder_that_cant_be_written_is_named() {
    let file = folder("no-folder").join("file");
    fs::write(&file, "").expect("a file can be written");
    let output = host_bridge(&["man", &file.to_string_lossy()]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(said.contains(&*file.to_string_lossy()), "{said}");
}

#[test]
fn a_file_that_cannot_be_made_or_read_is_told_with_what_to_do() {
    let folder = folder("what-to-do");
    fs::create_dir_all(folder.join("folder.hjif")).expect("a folder can be made");
    fs::write(folder.join("file"), "mine").expect("a file can be written");
    let scene = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    fs::write(folder.join("scene.toml"), scene).expect("a file can be written");
    let long = "x".repeat(300);
    for (words, want) in [
        (
            &["record", "absent/x.mcap"][..],
            "absent/x.mcap: can't be made: No such file or directory (os error 2): make its folder first",
        ),
        (&["record", &long], ": give a shorter name"),
        (&["record", "folder.hjif"], "give the name of a file"),
        (
            &["record", "folder.hjif", "--force"],
            "give the name of a file",
        ),
        (
            &["record", "--csv", "file"],
            "a file is in the way: give another place",
        ),
        (
            &["record", "--csv", "file", "--force"],
            "a file is in the way: give another place",
        ),
        (
            &["record", "/dev/full", "--force"],
            "make room, or give another place; 0 bytes of it are safe",
        ),
        (
            &["export", "scene.toml", "folder.hjif"],
            "folder.hjif: can't be written: is a directory: give the name of a file",
        ),
        (
            &["doctor", "--bench", "absent.toml"],
            "name a bench file with --bench, or in RIDGELINK_BENCH",
        ),
    ] {
        let run = command(words).current_dir(&folder).output();
        let output = run.expect("the program can be started");
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let said = text(&output.stderr);
        assert!(said.contains(want), "{words:?}: {said}");
    }
    assert_eq!(fs::read_to_string(folder.join("file")).unwrap(), "mine");
}

#[test]
fn nothing_is_exported_to_a_name_that_no_scene_can_say() {
    let folder = folder("name");
    let scene = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    fs::write(folder.join("scene.toml"), scene).expect("a file can be written");
    for ending in ["wav", "hjif"] {
        let name = [b"\xff.", ending.as_bytes()].concat();
        let mut command = command(&["export", "scene.toml"]);
        let run = command
            .arg(OsStr::from_bytes(&name))
            .current_dir(&folder)
            .output();
        let output = run.expect("the program can be started");
        assert_eq!(output.status.code(), Some(2));
        let said = text(&output.stderr);
        assert!(said.contains("is no UTF-8"), "{said}");
    }
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 1);
}

#[test]
fn a_number_below_0_is_refused_by_what_may_be_given() {
    for (words, want) in [
        (&["record", "x.mcap", "--for", "-1"][..], "seconds above 0"),
        (&["record", "x.mcap", "--split", "-1"], "minutes, 0 or more"),
        (&["monitor", "--plain", "--for", "-1"], "seconds above 0"),
        (&["monitor", "--plain", "--every", "-1"], "seconds above 0"),
        (&["doctor", "--for", "-1"], "give 0.5 to 3600"),
        (
            &["replay", "x", "--to", "monitor", "--speed", "-1"],
            "give 0.1 to 100",
        ),
    ] {
        let output = host_bridge(words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let said = text(&output.stderr);
        assert!(said.contains(want), "{words:?}: {said}");
    }
}

#[test]
fn an_unknown_command_is_refused() {
    let output = host_bridge(&["dance"]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(said.contains("'dance'"), "{said}");
}

#[test]
fn a_bad_bench_file_is_refused_in_one_line_by_file_line_and_key() {
    let folder = folder("bench");
    let bench = folder.join("bad.toml");
    for (bad, want) in [
        (
            "[sensor]\nprot = \"/dev/ttyACM0\"\n",
            "2: sensor: unknown field `prot`, expected one of `port`, `link`, `usb`, `elf`, `rtt`",
        ),
        (
            "[display]\nport = 3\n",
            "2: display.port: invalid type: integer `3`, expected path string",
        ),
        (
            "sensor = 3\n",
            "1: sensor: invalid type: integer `3`, expected a table",
        ),
        ("\n[sensor\n", "2: unclosed table, expected `]`"),
        ("[sensor]\nport = \"a\"\nport = \"b\"\n", "3: duplicate key"),
        ("[display]\nport = \"\"\n", "2: display.port: is empty"),
        ("[sensor]\nusb = \"\"\n", "2: sensor.usb: is empty"),
    ] {
        fs::write(&bench, bad).expect("a file can be written");
        for command in ["doctor", "monitor"] {
            let output = host_bridge(&[command, "--bench", &bench.to_string_lossy()]);
            assert_eq!(output.status.code(), Some(2), "{command}");
            let said = text(&output.stderr);
            let want = format!("{}:{want}", bench.display());
            assert!(said.contains(&want), "{command}: {said}");
            assert_eq!(said.lines().count(), 1, "{command}: {said}");
        }
    }
}

#[test]
fn an_empty_name_of_a_port_is_refused_by_its_argument() {
    for (argument, name) in [("--sensor", ""), ("--display", ""), ("--sensor", "usb:")] {
        let output = host_bridge(&["doctor", argument, name]);
        assert_eq!(output.status.code(), Some(2), "{argument} {name:?}");
        let said = text(&output.stderr);
        let want = format!("invalid value '{name}' for '{argument} <PORT>'");
        for want in [&*want, "give a port, such as /dev/ttyACM0, or usb:SERIAL"] {
            // clap has words of its own for an empty value.
            assert!(said.contains(want), "{argument} {name:?}: {said}");
        }
    }
}

#[test]
fn a_bench_file_that_is_not_there_is_refused_by_name() {
    let output = host_bridge(&["doctor", "--bench", "no-such-bench.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(said.contains("no-such-bench.toml: can't be read"), "{said}");
}

#[test]
fn one_place_for_both_boards_is_refused() {
    let output = host_bridge(&["doctor", "--sensor", "/dev/a", "--display", "/dev/a"]);
    assert_eq!(output.status.code(), Some(2));
    let said = text(&output.stderr);
    assert!(said.contains("/dev/a can't be both boards"), "{said}");
}
