//! The libs compute the same on processors that have nothing in common: this host, the emulated boards' and
//! QEMU's, each a minute of both boards' logic and the wire between.

use std::process::Command;

use hil_sim_boards::semihosted;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::{Fault, Kind};
use tests::run::scene;
use tests::{elves, other_processor};

#[path = "../../../plain-board/src/rehearsal.rs"]
mod rehearsal;

use rehearsal::{Met, Rehearsal, SECONDS};

/// Where the program's sources are, for what a test has to say.
const PROGRAM: &str = "tests/plain-board";
const QEMU: &str = "qemu-system-arm";

fn on_the_host() -> (String, Met) {
    let mut rehearsal = Rehearsal::new();
    let seconds = (0..SECONDS)
        .map(|_| format!("{}\n", rehearsal.second()))
        .collect();
    (seconds, rehearsal.met)
}

/// The first second, and the first stage in it, in which two runs differ.
fn difference(one: &str, other: &str) -> Option<String> {
    let (mut ours, mut theirs) = (one.lines(), other.lines());
    loop {
        let (a, b) = (ours.next(), theirs.next());
        let (Some(a), Some(b)) = (a, b) else {
            return (a != b).then(|| format!("one ends: {a:?}, {b:?}"));
        };
        if a != b {
            let words = a.split_whitespace().zip(b.split_whitespace());
            let place = words.take_while(|(a, b)| a == b).count();
            let stage = a.split_whitespace().nth(place - 1).unwrap_or("?");
            return Some(format!("from {stage} on:\n{a}\n{b}"));
        }
    }
}

#[test]
fn the_rehearsal_meets_what_it_is_for() {
    let (seconds, met) = on_the_host();
    assert_eq!(seconds.lines().count(), 64);
    // By spectrum for the most part; each of the other methods has four seconds.
    assert!(met.valid[0] > 1_500, "{met:?}");
    assert!(met.valid[1..].iter().all(|&valid| valid > 50), "{met:?}");
    assert!(met.unwell > 100, "{met:?}");
    assert!(met.driving > 60_000, "{met:?}");
    assert!(met.fading > 100 && met.stopped > 1_000, "{met:?}");
    assert!(met.trips.iter().flatten().count() >= 3, "{met:?}");
    let end = met.display_end;
    assert!(end.received > 5_000, "{met:?}");
    assert!(end.corrupt > 10 && end.lost > 100, "{met:?}");
}

#[test]
fn the_emulated_boards_processor_computes_every_bit_of_it_as_the_host_does() {
    let said = semihosted::run(&elves::plain("plain-stm32f4"), "plain-board: see ./test")
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(said.is_done, "{}", said.console);
    assert_eq!(difference(&on_the_host().0, &said.console), None);
}

#[test]
fn so_does_qemus_cortex_m4f() {
    let program = elves::plain("plain-board");
    assert!(
        program.is_file(),
        "{}: not there: ./test builds it from {PROGRAM}",
        program.display()
    );
    let run = Command::new(QEMU)
        .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none"])
        .args(["-chardev", "stdio,id=console"])
        .args([
            "-semihosting-config",
            "enable=on,chardev=console",
            "-kernel",
        ])
        .arg(&program)
        .output();
    let Ok(run) = run else {
        println!("skipped: {QEMU} is not to be had here");
        return;
    };
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(
        run.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&run.stderr)
    );
    assert_eq!(difference(&on_the_host().0, &said), None);
}

#[test]
fn a_difference_is_named_by_its_second_and_its_first_stage() {
    let lines = "second  0  input 1  sensor 2\nsecond  1  input 3  sensor 4\n";
    assert_eq!(difference(lines, lines), None);
    let wrong = lines.replace("sensor 4", "sensor 5");
    let named = difference(lines, &wrong).unwrap();
    assert!(named.starts_with("from sensor on:\nsecond  1"), "{named}");
    assert!(difference(lines, "").is_some());
}

/// A stroke over a border, with a turn, noise, and a link with weather: all tasks and interrupts of both boards.
const STROKE: &str = r#"
    duration_s = 1.5

    [surface]
    specimens = [{ wavelength_mm = 2.0, length_mm = 20.0 }, { wavelength_mm = 3.0 }]

    [motion]
    kind = "sinusoid"
    amplitude_mm_s = 70.0
    frequency_hz = 0.83

    [gauges]
    snr_db = 20.0

    [link]
    delay_ms = 5.0
    jitter_ms = 5.0
    loss = 0.05
    corrupt = 0.0005
"#;
/// The flashed ELFs, on a processor that interprets where ours translates: every frame, estimate and word at the
/// converters, and the number of instructions.
#[test]
fn the_flashed_elves_do_the_same_on_another_processor() {
    let (ours, theirs) = other_processor::runs_on_both(&scene(STROKE), elves::both());
    assert_eq!(other_processor::differences(&ours, &theirs), [""; 0]);
    assert!(ours.0.estimates.len() > 100 && ours.0.outputs.len() > 2_000);
    let mut wrong = theirs;
    wrong.1.sensor_instructions += 6;
    wrong.0.outputs.pop();
    assert_eq!(
        other_processor::differences(&ours, &wrong),
        ["instructions or resets", "outputs"]
    );
}

#[test]
fn so_they_do_when_the_power_fails() {
    let broken = Scene {
        duration_s: 1.0,
        faults: vec![
            Fault::new(Kind::LinkGarbage, 0.3),
            Fault::new(Kind::PowerCycle, 0.5),
        ],
        ..scene(STROKE)
    };
    let (ours, theirs) = other_processor::runs_on_both(&broken, elves::both());
    assert_eq!(other_processor::differences(&ours, &theirs), [""; 0]);
    assert_eq!(ours.1.resets, 2);
}
