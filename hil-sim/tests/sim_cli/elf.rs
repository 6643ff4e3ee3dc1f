//! `hil-sim run --engine elf` with files that are not the firmware wanted. Needs the two ELFs, as
//! ./test builds them.

use std::fs;
use std::path::Path;
use std::process::Command;

use protocol::{Hello, PROTOCOL_VERSION, Role};

use crate::{command, elf as built, folder, told};

const SCENE: &str = "duration_s = 0.3\n[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";

fn elf(role: Role) -> Vec<u8> {
    let path = built(role);
    fs::read(&path).unwrap_or_else(|error| {
        panic!(
            "{}: {error}: run ./test, or cargo build --release --target thumbv7em-none-eabihf \
             -p firmware-sensor -p firmware-display",
            path.display()
        )
    })
}

/// Runs a scene with this file as the sensor's firmware, in a folder of the test's own: exit status,
/// what it printed, and what it complained about.
fn run_with_sensor(name: &str, bytes: Option<&[u8]>) -> (Option<i32>, String, String) {
    let folder = folder(&format!("elf-cli/{name}"));
    fs::write(folder.join("a.toml"), SCENE).unwrap();
    if let Some(bytes) = bytes {
        fs::write(folder.join("sensor.elf"), bytes).unwrap();
    }
    let mut run = command(&folder, &["run", "a.toml", "--engine", "elf"]);
    run.args(["--sensor-elf", "sensor.elf", "--display-elf"]);
    told(run.arg(built(Role::Display)).output().unwrap())
}

fn assert_refused(name: &str, bytes: Option<&[u8]>, says: &[&str]) {
    let (status, printed, complaint) = run_with_sensor(name, bytes);
    assert_eq!(status, Some(2), "{complaint}");
    assert!(printed.is_empty(), "{printed}");
    assert!(complaint.starts_with("sensor.elf: "), "{complaint}");
    for words in says {
        assert!(
            complaint.contains(words),
            "{words:?} is not in {complaint:?}"
        );
    }
}

#[test]
fn the_two_firmwares_run_a_scene() {
    let (status, printed, complaint) = run_with_sensor("sound", Some(&elf(Role::Sensor)));
    assert_eq!(status, Some(0), "{complaint}");
    assert!(printed.contains("ok"), "{printed}");
}

/// `hil-sim` with the two firmwares.
fn with_elves(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = command(folder, arguments);
    command.arg("--sensor-elf").arg(built(Role::Sensor));
    command.arg("--display-elf").arg(built(Role::Display));
    command
}

/// The hashes of scenes that are run one after the other, by one process.
fn hashes(folder: &Path, scenes: &[&str]) -> Vec<String> {
    let output = with_elves(
        folder,
        &["run", "--engine", "elf", "-j", "1", "--json", "out.json"],
    )
    .args(scenes)
    .output()
    .unwrap();
    assert!(output.status.success(), "{output:?}");
    let results: Vec<serde_json::Value> =
        serde_json::from_slice(&fs::read(folder.join("out.json")).unwrap()).unwrap();
    let hash = |result: &serde_json::Value| result["hash"].as_str().unwrap().to_owned();
    results.iter().map(hash).collect()
}

#[test]
fn boards_that_have_run_other_scenes_run_as_fresh_ones_do() {
    let folder = folder("elf-cli/one-after-the-other");
    fs::write(folder.join("a.toml"), SCENE).unwrap();
    // Another method, on a sensor that is led through its configuration, and a board that starts anew.
    let other = format!(
        "{SCENE}[estimator]\nmethod = \"counting\"\n[[fault]]\nkind = \"power-cycle\"\nat_s = 0.2\n"
    );
    fs::write(folder.join("b.toml"), other).unwrap();
    let [a, b] = [["a.toml"], ["b.toml"]].map(|scene| hashes(&folder, &scene));
    assert_ne!(a, b);
    let after = hashes(&folder, &["b.toml", "a.toml", "b.toml", "a.toml"]);
    assert_eq!(after, [&*b, &*a, &*b, &*a].concat());
}

#[test]
fn a_missing_elf_exits_2_with_the_command_that_builds_it() {
    assert_refused(
        "missing",
        None,
        &["can't be read", "cargo build", "firmware-sensor"],
    );
}

#[test]
fn a_text_for_an_elf_exits_2() {
    assert_refused(
        "text",
        Some(b"not an ELF\n"),
        &["is no ELF file", "as the build left it"],
    );
}

#[test]
fn a_truncated_elf_exits_2() {
    let whole = elf(Role::Sensor);
    assert_refused(
        "truncated",
        Some(&whole[..whole.len() / 2]),
        &["is no ELF file"],
    );
}

#[test]
fn the_other_boards_elf_exits_2() {
    let says = ["is the display board's firmware", "exchange the two"];
    assert_refused("swapped", Some(&elf(Role::Display)), &says);
}

#[test]
fn an_elf_of_another_protocol_exits_2() {
    let mut patched = elf(Role::Sensor);
    let length = protocol::HELLO_LENGTH;
    let mut changed = 0;
    for at in 0..=patched.len() - length {
        let Some(hello) = Hello::from_bytes(&patched[at..at + length]) else {
            continue;
        };
        let other = Hello {
            protocol: (PROTOCOL_VERSION + 1).to_le_bytes(),
            ..hello
        };
        patched[at..at + length].copy_from_slice(&other.to_bytes());
        changed += 1;
    }
    assert!(changed > 0, "the ELF does not hold its identity");
    let says = format!("speaks protocol {}", PROTOCOL_VERSION + 1);
    assert_refused(
        "other-protocol",
        Some(&patched),
        &[&says, "build both from the same sources"],
    );
}

/// The numbers of each row of a demo's table in `text`, without the last one, which is the machine's pace.
fn table_rows(text: &str) -> Vec<Vec<f64>> {
    let row = |line: &str| {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let mut numbers = numbers.ok().filter(|numbers| numbers.len() == 11)?;
        numbers.pop();
        Some(numbers)
    };
    text.lines().filter_map(row).collect()
}

#[test]
fn the_demo_prints_the_table_that_the_documents_show() {
    /// What two compilers may make of it, in the columns' units.
    const ALIKE: f64 = 0.02;
    let arguments = ["demo", "--report", "demo.html"];
    let output = with_elves(&folder("elf-cli/demo"), &arguments).output();
    let output = output.unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let printed = table_rows(&String::from_utf8(output.stdout).unwrap());
    assert_eq!(printed.len(), 12);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for (document, count) in [("docs/src/explanation/paper.md", 12), ("README.md", 2)] {
        let shown = table_rows(&fs::read_to_string(root.join(document)).unwrap());
        assert_eq!(shown.len(), count, "{document}");
        for row in shown {
            let is_it = |other: &&Vec<f64>| other[..2] == row[..2];
            let now = printed.iter().find(is_it).unwrap();
            let are_alike = row.iter().zip(now).all(|(a, b)| (a - b).abs() <= ALIKE);
            assert!(are_alike, "{document}: {row:?} is {now:?} now");
        }
    }
}
