//! What is measured on the display's ELF, a little of each. Needs the two ELFs, as ./test builds them.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where cargo, or the folder named in RIDGELINK_ELVES, has a board's ELF.
fn elf(board: &str) -> PathBuf {
    let folder = env::var_os("RIDGELINK_ELVES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/thumbv7em-none-eabihf/release"),
        PathBuf::from,
    );
    folder.join(format!("firmware-{board}"))
}

/// A folder of the test's own, empty.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("display-cli")
        .join(name);
    fs::remove_dir_all(&folder).ok();
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Runs a command on the display's ELF: exit status, what it printed, what it complained about.
fn run(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(arguments)
        .arg("--display-elf")
        .arg(elf("display"))
        .output()
        .unwrap();
    (
        output.status.code(),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

/// Runs a chart that meets its goals; its picture and its table are there, the table with rows.
fn assert_drawn(name: &str, arguments: &[&str]) {
    let folder = folder(name);
    let out = folder.display().to_string();
    let arguments = [arguments, &["--quick", "--out", &out]].concat();
    let (status, printed, complaint) = run(&arguments);
    assert_eq!(status, Some(0), "{printed}{complaint}");
    let svg = fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    let csv = fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap();
    assert!(csv.lines().count() > 1, "{csv}");
}

#[test]
fn purity_meets_its_goals() {
    assert_drawn("purity", &["chart", "purity"]);
}

#[test]
fn a_hand_that_stops_leaves_no_voltage() {
    assert_drawn("stop", &["chart", "stop"]);
}

#[test]
fn the_link_s_delay_leaves_the_stimulus_in_step() {
    assert_drawn("delay", &["chart", "delay"]);
}

#[test]
fn partials_and_the_random_part_carry_more_of_a_surface() {
    let sensor = elf("sensor").display().to_string();
    assert_drawn("texture", &["chart", "texture", "--sensor-elf", &sensor]);
}

#[test]
fn outputs_come_in_time() {
    assert_drawn("timing", &["timing"]);
}

#[test]
fn instructions_stay_within_their_budget() {
    let (status, printed, complaint) = run(&["budget", "--quick"]);
    assert_eq!(status, Some(0), "{printed}{complaint}");
    for part in ["sines", "hand and phase", "in all"] {
        assert!(printed.contains(part), "{part} is not in {printed}");
    }
}

#[test]
fn a_short_soak_finds_every_counter_as_it_must_be() {
    let sensor = elf("sensor").display().to_string();
    let (status, printed, complaint) = run(&["soak", "--minutes", "0.2", "--sensor-elf", &sensor]);
    assert_eq!(status, Some(0), "{printed}{complaint}");
    assert!(printed.contains("all as it must be"), "{printed}");
}

#[test]
fn a_soak_of_no_time_is_refused() {
    let (status, _, complaint) = run(&["soak", "--minutes", "0"]);
    assert_eq!(status, Some(2));
    assert!(complaint.contains("give 0.17 to 1440"), "{complaint}");
}

#[test]
fn a_missing_elf_exits_2_with_the_command_that_builds_it() {
    let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["timing", "--display-elf", "no-such-elf", "--out"])
        .arg(folder("missing"))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(complaint.contains("cargo build"), "{complaint}");
}
