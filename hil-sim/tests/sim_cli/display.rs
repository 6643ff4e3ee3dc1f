//! What is measured on the display's ELF, a little of each. Needs the two ELFs, as ./test builds them.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use protocol::Role;

use crate::{elf, folder, hil_sim_anywhere, told};

/// Runs a command on the display's ELF: exit status, what it printed, what it complained about.
fn run(arguments: &[&str]) -> (Option<i32>, String, String) {
    let elf = elf(Role::Display).display().to_string();
    told(hil_sim_anywhere(
        &[arguments, &["--display-elf", &elf]].concat(),
    ))
}

/// Runs a chart that meets its goals; its picture and its table are there, the table with rows.
fn assert_drawn(name: &str, arguments: &[&str]) {
    let folder = folder(&format!("display-cli/{name}"));
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
    let sensor = elf(Role::Sensor).display().to_string();
    assert_drawn("texture", &["chart", "texture", "--sensor-elf", &sensor]);
}

/// A folder with one recording of a stroke over ridges of 2 mm and three partials, in which the arm is at `x_mm` at an
/// instant in s; half a second at rest in front.
fn recording(name: &str, x_mm: impl Fn(f64) -> f64) -> PathBuf {
    let folder = folder(&format!("display-cli/{name}"));
    let (mut motion, mut gauges) = ("t_s,x_mm\n".to_owned(), "t_s,g0,g1,g2,g3,g4\n".to_owned());
    for row in 0..=4_000 {
        let t_s = f64::from(row) * 1e-3;
        let x_mm = x_mm(t_s);
        let volts = [0.0, 0.4, 0.7, 1.1, 1.6].map(|place_mm| {
            let angle = TAU * (x_mm + place_mm) / 2.0;
            let wave = angle.sin() + 0.6 * (2.0 * angle).sin() + 0.4 * (3.0 * angle).sin();
            // As much noise as a converter has, or no gauge would be taken for sound.
            let noise = f64::from((row * 37 + (place_mm * 10.0) as i32 * 11) % 7 - 3) * 1e-3;
            format!("{:.5}", 1.65 + 0.2 * wave + noise)
        });
        writeln!(motion, "{t_s:.3},{x_mm:.5}").unwrap();
        writeln!(gauges, "{t_s:.3},{}", volts.join(",")).unwrap();
    }
    fs::write(folder.join("ridges.motion.csv"), motion).unwrap();
    fs::write(folder.join("ridges.gauges.csv"), gauges).unwrap();
    let scene = "duration_s = 4.0\n[surface]\nspecimens = [{ wavelength_mm = 2.0, length_mm = 10000.0 }]\n\
                 [motion]\nkind = \"recorded\"\nfile = \"ridges.motion.csv\"\n\
                 [gauges]\nkind = \"recorded\"\nfile = \"ridges.gauges.csv\"\n";
    fs::write(folder.join("ridges.toml"), scene).unwrap();
    let index = r#"[{ "name": "ridges", "truth": 2.0 }]"#;
    fs::write(folder.join("index.json"), index).unwrap();
    folder
}

/// What `chart texture` says of a folder.
fn judge_recordings(folder: &Path) -> (Option<i32>, String, String) {
    let folder = folder.display().to_string();
    run(&["chart", "texture", "--folder", &folder, "--out", &folder])
}

#[test]
fn of_a_recording_with_partials_the_shape_carries_more() {
    let folder = recording("recorded", |t_s| 50.0 * (t_s - 0.5).max(0.0));
    let (status, printed, complaint) = judge_recordings(&folder);
    assert_eq!(status, Some(0), "{printed}{complaint}");
    let csv = fs::read_to_string(folder.join("texture-recorded.csv")).unwrap();
    // With the arm, and half as fast again.
    for speed in ["50", "75"] {
        let coherence = |rendering: &str| -> f64 {
            let row = format!("ridges,ridges,true,native,50,{speed},0,{rendering},");
            let rest = csv.lines().find_map(|line| line.strip_prefix(&row));
            rest.unwrap().split(',').next().unwrap().parse().unwrap()
        };
        let (sine, shape) = (coherence("fundamental"), coherence("shape"));
        assert!(sine < 0.75 && shape > sine + 0.1, "{csv}");
    }
    let svg = fs::read_to_string(folder.join("texture-recorded.svg")).unwrap();
    assert!(svg.starts_with("<svg") && !svg.contains("NaN"));
}

#[test]
fn a_recording_that_meets_a_place_twice_or_is_none_is_refused() {
    let folder = recording("turns", |t_s| 20.0 * (2.0 * t_s).sin());
    let (status, _, complaint) = judge_recordings(&folder);
    assert_eq!(status, Some(2));
    assert!(
        complaint.contains("ridges: the arm turns back at 0.78")
            && complaint.contains("cut the recording into strokes"),
        "{complaint}"
    );
    let computed = "[surface]\nspecimens = [{ wavelength_mm = 2.0 }]\n";
    fs::write(folder.join("ridges.toml"), computed).unwrap();
    let (status, _, complaint) = judge_recordings(&folder);
    assert_eq!(status, Some(2));
    assert!(complaint.contains("must be recorded"), "{complaint}");
}

#[test]
fn a_folder_in_which_nothing_has_a_period_is_not_judged_as_carried() {
    let folder = recording("flat", |t_s| 50.0 * (t_s - 0.5).max(0.0));
    let index = r#"[{ "name": "ridges", "truth": 0 }]"#;
    fs::write(folder.join("index.json"), index).unwrap();
    let (status, printed, complaint) = judge_recordings(&folder);
    assert_eq!(status, Some(2), "{printed}{complaint}");
    assert!(
        complaint.contains("no recording has a period"),
        "{complaint}"
    );
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
    // The richest one, by its own limit.
    let (status, printed, complaint) = run(&["budget", "--quick", "--rendering", "texture"]);
    assert_eq!(status, Some(0), "{printed}{complaint}");
    assert!(printed.contains("texture"), "{printed}");
}

#[test]
fn a_short_soak_finds_every_counter_as_it_must_be() {
    let sensor = elf(Role::Sensor).display().to_string();
    let (status, printed, complaint) = run(&["soak", "--minutes", "0.2", "--sensor-elf", &sensor]);
    assert_eq!(status, Some(0), "{printed}{complaint}");
    assert!(printed.contains("all as it must be"), "{printed}");
    let words = [
        "soak",
        "--minutes",
        "0.2",
        "--sensor-elf",
        &sensor,
        "--rendering",
        "texture",
    ];
    let (status, printed, complaint) = run(&words);
    assert_eq!(status, Some(0), "{printed}{complaint}");
}

#[test]
fn a_soak_of_no_time_is_refused() {
    let (status, _, complaint) = run(&["soak", "--minutes", "0"]);
    assert_eq!(status, Some(2));
    assert!(complaint.contains("give 0.17 to 1440"), "{complaint}");
}

#[test]
fn a_missing_elf_exits_2_with_the_command_that_builds_it() {
    let out = folder("display-cli/missing").display().to_string();
    let arguments = ["timing", "--display-elf", "no-such-elf", "--out", &out];
    let (status, _, complaint) = told(hil_sim_anywhere(&arguments));
    assert_eq!(status, Some(2));
    assert!(complaint.contains("cargo build"), "{complaint}");
}
