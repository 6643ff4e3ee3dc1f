//! Recordings of displays that answer a fault well, or badly.

use firmware_display::ZERO_VOLT;
use protocol::{Safety, Trip};

use super::*;
use crate::judge::synthetic::Run;
use crate::run::fault_evidence::{FaultEvidence, Reset};
use crate::run::recording::ACTUATORS;

const MS: u64 = 1_000_000;
const AT_MS: u64 = 100;
const END_MS: u64 = 1_000;

/// Words that follow a wave on every actuator from `from_ms` on, a tick of 0.5 ms each, until `to_ms`;
/// then whatever `then` says.
fn driven(from_ms: u64, to_ms: u64, then: u16) -> Vec<OutputRecord> {
    let ticks = (2 * from_ms..2 * to_ms).map(|tick| OutputRecord {
        at_ns: tick * MS / 2,
        words: [0x9000 + (tick % 64) as u16; ACTUATORS],
        skew_ns: 0,
    });
    let last = OutputRecord {
        at_ns: to_ms * MS,
        words: [then; ACTUATORS],
        skew_ns: 0,
    };
    ticks.chain([last]).collect()
}

fn said(at_ms: u64, state: DisplayState) -> TimedMessage {
    let instant_us = at_ms * 1_000;
    TimedMessage {
        at_ns: at_ms * MS,
        message: Message::Safety(Safety { instant_us, state }),
    }
}

fn judged(kind: Kind, outputs: Vec<OutputRecord>, signs: FaultEvidence) -> Finding {
    let recording = Recording {
        outputs,
        signs,
        ..Run::steady(50.0, 2.0).record()
    };
    let fault = Fault::new(kind, AT_MS as f64 * 1e-3);
    finding(&fault, END_MS * MS, &recording)
}

fn stopped() -> FaultEvidence {
    FaultEvidence {
        display: vec![said(AT_MS + 3, DisplayState::Stopped(Trip::Converter))],
        ..FaultEvidence::default()
    }
}

#[test]
fn a_display_that_stops_in_time_and_says_so_meets_everything() {
    let finding = judged(Kind::DacAlarm, driven(0, AT_MS + 2, ZERO_VOLT), stopped());
    assert_eq!(finding.unmet(), [""; 0]);
    assert!(finding.was_driving && !finding.drives_again);
    assert_eq!(finding.safe_ns, Some(2 * MS));
    assert_eq!(finding.detected_ns, Some(3 * MS));
    assert_eq!(finding.sign, "display: stopped, Converter");
}

#[test]
fn a_display_that_stops_late_is_found() {
    let finding = judged(Kind::DacAlarm, driven(0, AT_MS + 25, ZERO_VOLT), stopped());
    assert_eq!(
        finding.unmet(),
        ["0 V after 25.00 ms of 20", "50 outputs stuck"]
    );
}

#[test]
fn outputs_that_stand_at_a_voltage_are_stuck_and_not_at_zero() {
    let finding = judged(Kind::LdacStuck, driven(0, AT_MS + 2, 0x9000), stopped());
    assert_eq!(finding.unmet(), ["outputs not at 0 V", "50 outputs stuck"]);
    // One output is enough.
    let mut outputs = driven(0, AT_MS + 2, ZERO_VOLT);
    outputs.last_mut().unwrap().words[17] = 0x8001;
    let finding = judged(Kind::LdacStuck, outputs, stopped());
    assert_eq!(finding.stuck, 1);
    assert_eq!(finding.safe_ns, None);
}

#[test]
fn a_voltage_that_passes_through_zero_is_not_safe() {
    let mut outputs = driven(0, AT_MS + 1, ZERO_VOLT);
    outputs.extend(driven(AT_MS + 4, AT_MS + 10, ZERO_VOLT));
    let finding = judged(Kind::DacAlarm, outputs, stopped());
    assert_eq!(finding.safe_ns, Some(10 * MS));
}

#[test]
fn a_stopped_display_that_drives_again_restarts_against_the_table() {
    let mut outputs = driven(0, AT_MS + 2, ZERO_VOLT);
    outputs.extend(driven(600, 700, ZERO_VOLT));
    let finding = judged(Kind::DacAlarm, outputs.clone(), stopped());
    assert!(finding.is_restart_against_the_table());
    assert_eq!(finding.safe_ns, Some(600 * MS));
    // After a brown-out it may.
    let finding = judged(Kind::BrownOut, outputs, stopped());
    assert!(!finding.is_restart_against_the_table() && finding.drives_again);
    assert_eq!(finding.safe_ns, Some(2 * MS));
}

#[test]
fn more_resets_than_the_kind_has_are_against_the_table() {
    let reset = |at_ms: u64, role| Reset {
        role,
        at_ns: at_ms * MS,
        is_injected: false,
    };
    let signs = |resets| FaultEvidence {
        resets,
        ..stopped()
    };
    let outputs = || driven(0, AT_MS, ZERO_VOLT);
    let once = vec![reset(400, Role::Display), reset(450, Role::Sensor)];
    assert_eq!(judged(Kind::Panic, outputs(), signs(once)).unmet(), [""; 0]);
    let twice = vec![reset(400, Role::Display), reset(800, Role::Display)];
    let finding = judged(Kind::Panic, outputs(), signs(twice));
    assert!(finding.is_restart_against_the_table());
}

#[test]
fn what_was_said_before_the_fault_or_after_its_time_is_no_sign_of_it() {
    let signs = FaultEvidence {
        display: vec![
            said(AT_MS - 1, DisplayState::Stopped(Trip::Converter)),
            said(AT_MS + 1, DisplayState::Driving),
            said(END_MS, DisplayState::Stopped(Trip::Converter)),
        ],
        clears_ns: vec![(AT_MS - 1) * MS],
        ..FaultEvidence::default()
    };
    let finding = judged(Kind::DacAlarm, driven(0, AT_MS + 2, ZERO_VOLT), signs);
    assert_eq!(finding.unmet(), ["no sign of it"]);
}

#[test]
fn a_sign_of_what_is_no_fault_is_a_false_alarm() {
    let signs = FaultEvidence {
        clears_ns: vec![(AT_MS + 5) * MS],
        ..FaultEvidence::default()
    };
    let finding = judged(Kind::Nothing, driven(0, END_MS, ZERO_VOLT), signs);
    assert_eq!(finding.unmet(), ["a sign of what is no fault: CLR fell"]);
}
