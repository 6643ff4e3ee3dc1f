//! `host-bridge bringup` before the two boards' own firmware, by virtual time: a sound bench passes, and each
//! wire that is put wrong is named by the step that meets it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use hil_sim_boards::bench::Command;
use hil_sim_boards::wiring::Mistake;
use hil_sim_core::scene::{Follows, Motion, Specimen};
use protocol::Role;
use serde_json::{Value, json};
use tests::bench::folder;
use tests::bridge;
use tests::virtual_boards::VirtualBoards;
use tests::virtual_desk::Ended;

/// Far more than a look takes on a busy machine.
const LIMIT: Duration = Duration::from_secs(300);
/// What boards that have just been reset need to find each other and the surface, in s of their time.
const STARTS_S: f64 = 1.5;
/// Steps that only a person can do.
const OF_A_PERSON: [&str; 8] = [
    "zero-volt",
    "emergency-press",
    "frequency",
    "places",
    "insulation",
    "leakage",
    "finger",
    "specimens",
];

/// Each mistake, the step that meets it first, and a word of what that step says to try.
const MET_BY: [(Mistake, &str, &str); 17] = [
    (Mistake::LinkStraight, "link-to-display", "crossed"),
    (Mistake::SensorTxOpen, "link-to-display", "the sensor's PD5"),
    (
        Mistake::DisplayTxOpen,
        "link-to-sensor",
        "the display's PD5",
    ),
    (Mistake::NoGround, "link-to-display", "join the grounds"),
    (
        Mistake::HandSwapped,
        "hand-encoder",
        "exchange A and B of the hand's",
    ),
    (Mistake::HandOpen, "hand-encoder", "A or B of the hand's"),
    (
        Mistake::ArmSwapped,
        "arm-encoder",
        "exchange A and B of the arm's",
    ),
    (Mistake::ArmOpen, "arm-encoder", "A or B of the arm's"),
    (Mistake::GaugeOpen, "gauges-level", "at 0 or 3.3 V"),
    (Mistake::GaugeShort, "gauges-alive", "shorted"),
    (Mistake::StopOpen, "emergency-stop", "D4"),
    (Mistake::SdiOpen, "converters-start", "SDI D11"),
    (Mistake::SdoOpen, "converters-start", "SDO D12"),
    (Mistake::SelectOpen, "converters-start", "CS D10 D9 D8"),
    (Mistake::AlarmLow, "alarm", "ALMOUT"),
    (Mistake::LoadHigh, "drive", "LDAC's wire"),
    (Mistake::ClearLow, "drive", "CLR's wire"),
];

/// Those that an arm which is pushed by hand does not show: a bench that has got as far as the arm's drive.
const OF_THE_DRIVE: [(Mistake, &str); 2] = [
    (Mistake::PwmOpen, "PWM's wire D6"),
    (Mistake::ArmBackwards, "it goes backwards"),
];

/// A hand that goes to the right for ever, and an arm that follows it by its drive over one specimen.
fn sound() -> VirtualBoards {
    VirtualBoards::new("bringup", |options| {
        let scene = &mut options.scene;
        scene.motion = Motion::Constant { speed_mm_s: 30.0 };
        scene.arm.follows = Follows::Link;
        scene.surface.specimens = vec![Specimen {
            wavelength_mm: 2.0,
            length_mm: f64::INFINITY,
        }];
    })
}

fn state(name: &str) -> PathBuf {
    let folder = folder("bringup-states");
    fs::create_dir_all(&folder).expect("a folder for the states");
    folder.join(format!("{name}.json"))
}

/// The same, of which nothing is kept.
fn fresh_state(name: &str) -> PathBuf {
    let path = state(name);
    let _ = fs::remove_file(&path);
    path
}

fn command(bench: &VirtualBoards, state: &Path, arguments: &[&str], answers: &str) -> Ended {
    let file = bench.boards.bench_file();
    let [file, state] = [&*file, state].map(|path| path.to_str().expect("UTF-8"));
    let words = [&["bringup", "--bench", file, "--state", state], arguments];
    bench.bench.start(&words.concat(), answers).wait()
}

fn bring_up(bench: &VirtualBoards, state: &Path, arguments: &[&str]) -> (Ended, Value) {
    let ended = command(bench, state, arguments, "");
    let text =
        fs::read_to_string(state).unwrap_or_else(|error| panic!("{error}: {}", ended.output));
    let document = serde_json::from_str(&text).expect("the state is JSON");
    (ended, document)
}

/// The steps of an outcome.
fn steps<'a>(document: &'a Value, outcome: &str) -> Vec<&'a Value> {
    records(document)
        .iter()
        .filter(|record| record["outcome"] == outcome)
        .collect()
}

fn records(document: &Value) -> &Vec<Value> {
    document["steps"].as_array().expect("a list")
}

fn advice(record: &Value) -> String {
    let figures = record["figures"].as_array().expect("a list");
    let advice = figures
        .iter()
        .filter_map(|figure| figure["advice"].as_str());
    advice.collect::<Vec<_>>().join("\n")
}

/// Both boards' reset buttons, and the time to start in.
fn reset(bench: &VirtualBoards) {
    for role in [Role::Sensor, Role::Display] {
        bench
            .boards
            .command(Command::Reset(role))
            .expect("the bench stands");
    }
    bench.pass(STARTS_S);
}

/// One pair of boards for all: what an emulated pair takes longest for is its start.
#[test]
fn an_afternoon_at_one_bench() {
    let bench = &sound();
    // No reset yet: it would cut a frame off, which the doctor finds.
    bench.pass(STARTS_S);
    a_sound_bench_passes_every_step_that_needs_no_person(bench);
    what_a_person_reads_off_is_judged(bench);
    who_leaves_at_a_question_has_found_no_fault(bench);
    no_finger_goes_on_an_array_that_was_not_measured(bench);
    a_pressed_emergency_stop_is_seen(bench);
    for (mistake, step, word) in MET_BY {
        the_step_that_meets_it_names_it(bench, mistake, step, word);
    }
    for (mistake, word) in OF_THE_DRIVE {
        the_drive_s_step_names_it(bench, mistake, word);
    }
    what_is_put_right_goes_on_where_it_ended(bench);
}

fn a_sound_bench_passes_every_step_that_needs_no_person(bench: &VirtualBoards) {
    let path = fresh_state("sound");
    let (ended, document) = bring_up(bench, &path, &["--yes"]);
    for outcome in ["failed", "blocked"] {
        assert_eq!(
            steps(&document, outcome),
            Vec::<&Value>::new(),
            "{}",
            ended.output
        );
    }
    let left_out: Vec<&str> = steps(&document, "left-out")
        .iter()
        .filter_map(|record| record["step"].as_str())
        .collect();
    let mut due = vec!["usb"];
    due.extend(OF_A_PERSON);
    assert_eq!(left_out.len(), due.len(), "{left_out:?}");
    assert!(
        due.iter().all(|step| left_out.contains(step)),
        "{left_out:?}"
    );
    let all = records(&document);
    assert_eq!(ended.status, Some(0), "{}", ended.output);
    assert_eq!(
        document["doctor"]["boards"][0]["hello"]["chip"],
        "STM32F429ZI"
    );
    let page = fs::read_to_string(path.with_extension("html")).expect("a report");
    for record in all {
        let step = record["step"].as_str().expect("a name");
        assert!(page.contains(&format!("<b>{step}</b>")), "{step}");
        for figure in record["figures"].as_array().expect("a list") {
            assert!(page.contains(figure["limit"].as_str().expect("a limit")));
        }
    }
}

fn what_a_person_reads_off_is_judged(bench: &VirtualBoards) {
    for (answers, status) in [
        ("\n3.5\n", 0),
        ("\n-3.5\n", 0),
        ("\n12\ns\n", 1),
        ("\n-35\ns\n", 1),
        ("q\n", 1),
        ("", 1),
    ] {
        let path = fresh_state("answers");
        let ended = command(bench, &path, &["--only", "zero-volt"], answers);
        assert_eq!(ended.status, Some(status), "{}", ended.output);
        assert!(ended.output.contains("with a meter"), "{}", ended.output);
    }
}

/// Whoever asks for it, and whatever was left out.
fn no_finger_goes_on_an_array_that_was_not_measured(bench: &VirtualBoards) {
    const GUARDS: [&str; 4] = ["zero-volt", "emergency-press", "insulation", "leakage"];
    let path = fresh_state("finger");
    let finger = |outcomes: [&str; 4]| {
        let steps = GUARDS.iter().zip(outcomes);
        let steps: Vec<Value> = steps
            .map(|(step, outcome)| {
                json!({
                    "step": step, "outcome": outcome, "note": null, "at_unix_s": 0, "looked_s": 0.0, "figures": [],
                })
            })
            .collect();
        let kept = json!({
            "format": 1, "program": "", "protocol": 0, "schema": "", "doctor": null, "steps": steps,
        });
        fs::write(&path, kept.to_string()).expect("a state");
        command(bench, &path, &["--only", "finger"], "\nyes\n")
    };
    for (at, guard) in GUARDS.iter().enumerate() {
        for outcome in ["left-out", "failed", "blocked"] {
            let mut outcomes = ["passed"; 4];
            outcomes[at] = outcome;
            let ended = finger(outcomes);
            assert_eq!(ended.status, Some(1), "{}", ended.output);
            let blocked = format!("blocked: {guard} has to pass first");
            assert!(ended.output.contains(&blocked), "{}", ended.output);
            assert!(!ended.output.contains("5 V"), "{}", ended.output);
        }
    }
    // Reset, it has its 5 V again.
    reset(bench);
    let ended = finger(["passed"; 4]);
    assert_eq!(ended.status, Some(0), "{}", ended.output);
    let in_force = "amplitude in force: 1000 mV";
    assert!(ended.output.contains(in_force), "{}", ended.output);
}

fn who_leaves_at_a_question_has_found_no_fault(bench: &VirtualBoards) {
    let path = fresh_state("left");
    let ended = command(bench, &path, &["--only", "zero-volt"], "\n");
    assert_eq!(ended.status, Some(1), "{}", ended.output);
    let text = fs::read_to_string(&path).expect("a state");
    let document: Value = serde_json::from_str(&text).expect("the state is JSON");
    assert_eq!(*records(&document), [Value::Null; 0], "{text}");
}

fn a_pressed_emergency_stop_is_seen(bench: &VirtualBoards) {
    let path = fresh_state("pressed");
    let only = ["--yes", "--only", "emergency-press"];
    let (ended, _) = bring_up(bench, &path, &only);
    assert_eq!(ended.status, Some(1), "{}", ended.output);
    bench
        .boards
        .command(Command::Stop)
        .expect("the bench stands");
    let (ended, _) = bring_up(bench, &path, &only);
    assert_eq!(ended.status, Some(0), "{}", ended.output);
    bench
        .boards
        .command(Command::Release)
        .expect("the bench stands");
}

fn the_step_that_meets_it_names_it(
    bench: &VirtualBoards,
    mistake: Mistake,
    step: &str,
    word: &str,
) {
    let name = mistake.name();
    bench
        .boards
        .command(Command::Wrong(mistake))
        .expect("the bench stands");
    reset(bench);
    let (ended, document) = bring_up(bench, &fresh_state(name), &["--yes"]);
    bench
        .boards
        .command(Command::Right(mistake))
        .expect("the bench stands");
    let failed = steps(&document, "failed");
    let Some(first) = failed.first() else {
        panic!("{name}: nothing failed: {}", ended.output);
    };
    assert_eq!(first["step"], step, "{name}: {}", ended.output);
    assert!(advice(first).contains(word), "{name}: {}", advice(first));
    assert_eq!(ended.status, Some(1), "{name}");
}

fn the_drive_s_step_names_it(bench: &VirtualBoards, mistake: Mistake, word: &str) {
    let name = mistake.name();
    let path = fresh_state(name);
    fs::copy(state("sound"), &path).expect("what the sound bench has left");
    bench
        .boards
        .command(Command::Wrong(mistake))
        .expect("the bench stands");
    reset(bench);
    let (ended, document) = bring_up(bench, &path, &["--yes", "--from", "arm-drive"]);
    bench
        .boards
        .command(Command::Right(mistake))
        .expect("the bench stands");
    let failed = steps(&document, "failed");
    assert!(!failed.is_empty(), "{name}: {}", ended.output);
    assert_eq!(failed[0]["step"], "arm-drive", "{name}: {}", ended.output);
    assert!(
        advice(failed[0]).contains(word),
        "{name}: {}",
        advice(failed[0])
    );
}

fn what_is_put_right_goes_on_where_it_ended(bench: &VirtualBoards) {
    reset(bench);
    let path = state(Mistake::ClearLow.name());
    let (ended, document) = bring_up(bench, &path, &["--yes"]);
    // All that may be found is the frame that the reset has cut off.
    const CUT: &str = "1 damaged frames (corrupt), none while it was looked at";
    let is_cut = |record: &Value| advice(record).lines().all(|finding| finding.contains(CUT));
    let mut failed = steps(&document, "failed");
    failed.retain(|record| record["step"] != "health" || !is_cut(record));
    assert_eq!(failed, Vec::<&Value>::new(), "{}", ended.output);
    assert_eq!(
        steps(&document, "blocked"),
        Vec::<&Value>::new(),
        "{}",
        ended.output
    );
    let due_again = |step: &str| ended.output.lines().any(|line| line.starts_with(step));
    assert!(
        due_again("drive ") && !due_again("one-build "),
        "{}",
        ended.output
    );
}

#[test]
fn every_mistake_that_a_bench_can_make_is_met() {
    for mistake in Mistake::ALL {
        let is_met = MET_BY.iter().any(|(met, ..)| *met == mistake)
            || OF_THE_DRIVE.iter().any(|(met, _)| *met == mistake);
        assert!(is_met, "{}", mistake.name());
    }
}

#[test]
fn what_can_t_be_done_is_refused_with_what_to_do() {
    let refusal = |arguments: &[&str]| {
        let ended = bridge::run(["bringup"].iter().chain(arguments), LIMIT);
        assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
        ended.stderr
    };
    assert!(refusal(&["--from", "lunch"]).contains("--list names them all"));
    let path = state("no-state");
    fs::write(&path, "[1]").expect("a file");
    let path = path.to_str().expect("a name");
    assert!(refusal(&["--yes", "--state", path]).contains("is no state of a bring-up"));
    let free = fresh_state("free");
    let free = free.to_str().expect("a name");
    let one = ["--yes", "--state", free, "--sensor", "/dev/no-such-port"];
    // Two boards at one port.
    let both = [&one[..], &["--display", "/dev/no-such-port"]].concat();
    assert!(refusal(&both).contains("can't be both boards"));
}

#[test]
fn the_list_names_every_step_and_does_nothing() {
    let free = fresh_state("listed");
    let ended = bridge::run(
        [
            "bringup",
            "--list",
            "--state",
            free.to_str().expect("a name"),
        ],
        LIMIT,
    );
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for step in OF_A_PERSON
        .iter()
        .chain(MET_BY.iter().map(|(_, step, _)| step))
    {
        assert!(ended.stdout.contains(step), "{step}: {}", ended.stdout);
    }
    assert!(!free.exists());
}
