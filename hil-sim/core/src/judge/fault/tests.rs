//! Recordings of displays that answer a fault well, or badly.

use protocol::{
    DisplayCounters, DisplayState, Hello, Hold, Message, PortCounters, Rendering, ResetCause, Role,
    RoleCounters, Safety, Status, Trip, UNITY_GAIN, UpdateRate,
};

use super::*;
use crate::judge::synthetic::{Run, word_of};
use crate::run::decoder::TimedMessage;
use crate::run::fault_evidence::{FaultEvidence, Reset};
use crate::run::recording::{ACTUATORS, OutputRecord, ZERO_VOLT, volts};
use crate::scene::Display;
use crate::scene::fault::{Fault, Kind};

mod several;

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

/// Takes the outputs to 0 V for a time, in ms.
fn silence(recording: &mut Recording, silent_ms: std::ops::Range<u64>) {
    for output in &mut recording.outputs {
        if (silent_ms.start * MS..silent_ms.end * MS).contains(&output.at_ns) {
            output.words = [ZERO_VOLT; ACTUATORS];
        }
    }
}

/// A scene of these faults with a hand at 50 mm/s over 2 mm.
fn with_faults(duration_s: f64, faults: Vec<Fault>) -> Scene {
    Scene {
        duration_s,
        faults,
        ..Scene::constant(2.0, 50.0)
    }
}

fn said(at_ms: u64, state: DisplayState) -> TimedMessage {
    let instant_us = at_ms * 1_000;
    TimedMessage {
        at_ns: at_ms * MS,
        message: Message::Safety(Safety { instant_us, state }),
    }
}

fn judged(kind: Kind, outputs: Vec<OutputRecord>, signs: FaultEvidence) -> Finding {
    judged_for(Fault::new(kind, AT_MS as f64 * 1e-3), outputs, signs)
}

fn judged_for(fault: Fault, outputs: Vec<OutputRecord>, signs: FaultEvidence) -> Finding {
    let recording = Recording {
        outputs,
        signs,
        ..Run::steady(50.0, 2.0).record()
    };
    let scene = with_faults(END_MS as f64 * 1e-3, vec![fault]);
    finding(&scene, 0, END_MS * MS, &recording)
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
fn a_display_that_says_late_that_it_has_stopped_is_found() {
    for kind in [Kind::SpiStall, Kind::DacAlarm] {
        let trip = kind.row().trips[0];
        let says_at = |after_ms| FaultEvidence {
            clears_ns: vec![(AT_MS + 2) * MS],
            display: vec![said(AT_MS + after_ms, DisplayState::Stopped(trip))],
            ..FaultEvidence::default()
        };
        let found = |after_ms| {
            judged(kind, driven(0, AT_MS + 2, ZERO_VOLT), says_at(after_ms))
                .unmet()
                .into_iter()
                .any(|unmet| unmet.starts_with("says that it has stopped after"))
        };
        assert!(!found(20), "{kind:?}");
        assert!(found(127), "{kind:?}");
    }
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

/// A wave of few steps, or one that the hand turns back in, takes long for its last step and longer until it is back.
#[test]
fn what_turns_slowly_does_not_stand_and_what_stops_does() {
    let standing = |amplitude: f64, hz: f64, held_ms: u64| {
        let mut recording = Run::steady(50.0, 2.0).record();
        for output in &mut recording.outputs {
            let held_ns = output.at_ns.saturating_sub(700 * MS).min(held_ms * MS);
            let turns = (output.at_ns - held_ns) as f64 * 1e-9 * hz;
            let word = (amplitude * (std::f64::consts::TAU * turns).sin()).round();
            output.words = [(f64::from(ZERO_VOLT) + word) as u16; ACTUATORS];
        }
        let scene = with_faults(2.0, vec![Fault::new(Kind::Nothing, 0.5)]);
        finding(&scene, 0, 2_000 * MS, &recording).standing
    };
    for (amplitude, hz) in [(20.0, 1.0), (7.0, 2.5), (60.0, 1.0), (20.0, 3.0)] {
        assert_eq!(standing(amplitude, hz, 0), 0, "{amplitude} {hz}");
        assert_eq!(standing(amplitude, hz, 120), ACTUATORS, "{amplitude} {hz}");
    }
    // At 36 Hz each tick has another word.
    assert_eq!(standing(32_000.0, 36.0, 19), 0);
    assert_eq!(standing(32_000.0, 36.0, 22), ACTUATORS);
}

#[test]
fn a_crest_that_is_cut_flat_at_its_channels_gain_does_not_stand() {
    const CHANNEL: usize = 17;
    let stands = |scene: &Scene, flat_ms: u64, offset: i32| {
        let mut recording = Run::steady(50.0, 2.0).record();
        for output in &mut recording.outputs {
            let is_flat = (700 * MS..(700 + flat_ms) * MS).contains(&output.at_ns);
            let word = if is_flat { offset } else { 0 };
            output.words[CHANNEL] = (i32::from(ZERO_VOLT) + word) as u16;
        }
        finding(scene, 0, 2_000 * MS, &recording).standing
    };
    let scene = with_faults(2.0, vec![Fault::new(Kind::Nothing, 0.5)]);
    let standing = |gain_q15: u16, offset: i32| {
        let mut scene = scene.clone();
        scene.display.actuators[CHANNEL].gain_q15 = gain_q15;
        stands(&scene, 60, offset)
    };
    for gain_q15 in [UNITY_GAIN, UNITY_GAIN / 2, UNITY_GAIN / 10 * 9, 1_000] {
        let crest = 32_767 * i32::from(gain_q15) / i32::from(UNITY_GAIN);
        for sign in [1, -1] {
            assert_eq!(standing(gain_q15, sign * crest), 0, "{gain_q15}");
            assert_eq!(standing(gain_q15, sign * (crest - 40)), 1, "{gain_q15}");
        }
    }
    // What is further than its channel goes is no crest of it.
    assert_eq!(standing(UNITY_GAIN / 2, 32_767), 1);
    // Where the amplitude follows the surface or its force, or an actuator's model, a crest may be anywhere below.
    let weaker: [fn(&mut Display); 3] = [
        |display| display.configuration.reference_lsb = 1_341,
        |display| display.configuration.reference_mn = 80,
        |display| display.actuators[CHANNEL].resonance_dhz = 900,
    ];
    for weaker in weaker {
        let mut scene = scene.clone();
        weaker(&mut scene.display);
        assert_eq!(stands(&scene, 60, -7_494), 0);
        assert_eq!(stands(&scene, 101, -7_494), 1);
        scene.display.actuators[CHANNEL].gain_q15 = UNITY_GAIN / 5;
        assert_eq!(stands(&scene, 60, -7_494), 1);
    }
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
        display: vec![said(AT_MS + 600, DisplayState::Stopped(Trip::Panic))],
        clears_ns: vec![(AT_MS + 1) * MS],
        ..FaultEvidence::default()
    };
    let outputs = || driven(0, AT_MS, ZERO_VOLT);
    let once = vec![reset(400, Role::Display)];
    assert_eq!(judged(Kind::Panic, outputs(), signs(once)).unmet(), [""; 0]);
    let beside = vec![reset(400, Role::Display), reset(450, Role::Sensor)];
    let finding = judged(Kind::Panic, outputs(), signs(beside));
    assert!(!finding.is_restart_against_the_table());
    assert_eq!(
        finding.unmet(),
        ["not to be expected: sensor reset, at 350.00 ms"]
    );
    let twice = vec![reset(400, Role::Display), reset(800, Role::Display)];
    let finding = judged(Kind::Panic, outputs(), signs(twice));
    assert!(finding.is_restart_against_the_table());
}

#[test]
fn a_panic_has_to_pull_clr_before_the_missing_ticks_let_it_fall() {
    let unmet = |silent_ms: u64| {
        let signs = FaultEvidence {
            resets: vec![Reset {
                role: Role::Display,
                at_ns: (AT_MS + 400) * MS,
                is_injected: false,
            }],
            display: vec![said(AT_MS + 600, DisplayState::Stopped(Trip::Panic))],
            clears_ns: vec![silent_ms * MS],
            ..FaultEvidence::default()
        };
        judged(Kind::Panic, driven(0, silent_ms, ZERO_VOLT), signs).unmet()
    };
    assert_eq!(unmet(AT_MS + 1), [""; 0]);
    assert_eq!(unmet(AT_MS + 2), ["0 V after 2.00 ms of 1"]);
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
    assert_eq!(
        finding.unmet(),
        [
            "no sign of it",
            "does not say that it has stopped: [Converter]"
        ]
    );
}

#[test]
fn a_sign_of_what_is_no_fault_is_a_false_alarm() {
    let signs = FaultEvidence {
        clears_ns: vec![(AT_MS + 5) * MS],
        ..FaultEvidence::default()
    };
    let finding = judged(Kind::Nothing, driven(0, END_MS, ZERO_VOLT), signs);
    assert_eq!(
        finding.unmet(),
        ["not to be expected: CLR fell, at 5.00 ms"]
    );
}

/// The link is cut for 0.7 s from 0.5 s on, in 2 s; the last estimate that counts has come at 0.491 s.
const CUT_NS: std::ops::Range<u64> = 500 * MS..1_200 * MS;
const STALE_NS: u64 = 991 * MS;

/// A display that hears nothing meanwhile, and what it does in `silent_ms`, of which it says at `says` ms that it fades.
fn cut(silent_ms: std::ops::Range<u64>, says: Option<u64>) -> Vec<String> {
    let fading = |at_ms| said(at_ms, DisplayState::Fading(Hold::Stale));
    cut_and_said(silent_ms, says.map(fading).into_iter().collect())
}

fn cut_and_said(silent_ms: std::ops::Range<u64>, says: Vec<TimedMessage>) -> Vec<String> {
    let mut recording = Run::steady(50.0, 2.0).record();
    recording
        .arrived
        .retain(|arrival| !CUT_NS.contains(&arrival.at_ns));
    silence(&mut recording, silent_ms);
    recording.signs.display = says;
    unmet_of_cut(&recording)
}

fn unmet_of_cut(recording: &Recording) -> Vec<String> {
    let mut fault = Fault::new(Kind::LinkDown, 0.5);
    fault.for_s = Some(0.7);
    let scene = with_faults(2.0, vec![fault]);
    finding(&scene, 0, 2_000 * MS, recording).unmet()
}

#[test]
fn a_display_that_fades_when_estimates_are_too_old_and_drives_again_meets_everything() {
    assert_eq!(cut(1_030..1_210, Some(992)), [""; 0]);
}

#[test]
fn a_display_that_hears_nothing_after_the_link_is_back_is_found() {
    let mut recording = Run::steady(50.0, 2.0).record();
    recording
        .arrived
        .retain(|arrival| arrival.at_ns < CUT_NS.start);
    silence(&mut recording, 1_030..2_000);
    recording.signs.display = vec![said(992, DisplayState::Fading(Hold::Stale))];
    let unmet = unmet_of_cut(&recording);
    assert_eq!(unmet, ["does not drive again within 300 ms of its end"]);
}

#[test]
fn a_display_that_never_fades_is_found() {
    let stale_ms = (STALE_NS - CUT_NS.start) / MS;
    let unmet = cut(0..0, None);
    assert_eq!(unmet.len(), 2, "{unmet:?}");
    assert!(unmet[0].starts_with(&format!("does not say that it holds, Stale, at {stale_ms}")));
    // It has 50 ms to fade, and 3 ms to notice.
    assert!(unmet[1].starts_with("drives at 54"), "{unmet:?}");
}

#[test]
fn a_display_that_says_that_it_drives_while_it_is_held_is_found() {
    let unmet = |drives_ms: u64| {
        let says = vec![
            said(992, DisplayState::Fading(Hold::Stale)),
            said(drives_ms, DisplayState::Driving),
        ];
        cut_and_said(1_030..1_210, says)
    };
    // It hears from the link again at 1.201 s.
    assert_eq!(unmet(1_202), [""; 0]);
    assert_eq!(unmet(1_045), ["says that it drives at 545.00 ms, Stale"]);
}

#[test]
fn a_display_that_fades_too_early_or_for_another_reason_or_for_ever_is_found() {
    let early = cut(800..1_210, Some(800));
    assert_eq!(early, ["silent from 300.00 ms on, without a reason"]);
    let for_ever = cut(1_030..2_000, Some(992));
    assert_eq!(
        for_ever,
        [
            "silent from 530.00 ms on, without a reason",
            "does not drive again within 300 ms of its end"
        ]
    );
}

#[test]
fn a_display_that_follows_what_it_must_not_is_out_of_step() {
    let judged_from = |at_s: f64, rendering, ahead: fn(f64) -> f64, gain: fn(f64) -> f64| {
        let run = Run {
            ahead_cycles: Box::new(ahead),
            ..Run::steady(50.0, 2.0)
        };
        let mut recording = run.record();
        for output in &mut recording.outputs {
            let gain = gain(output.at_ns as f64 * 1e-9);
            output.words = output.words.map(|word| word_of(gain * volts(word)));
        }
        let mut scene = with_faults(2.0, vec![Fault::new(Kind::Nothing, at_s)]);
        scene.display.configuration.rendering = rendering;
        finding(&scene, 0, 2_000 * MS, &recording).unmet()
    };
    let judged = |ahead, gain| judged_from(0.5, Rendering::Fundamental, ahead, gain);
    // Wherever its phase began, and not where it goes then.
    assert_eq!(judged(|_| 0.3, |_| 1.0), [""; 0]);
    // Also where it has only just begun, and no cycle is whole.
    let begun = judged_from(0.04, Rendering::Shape, |_| 0.3, |_| 1.0);
    assert_eq!(begun, [""; 0]);
    let goes_on = |t_s| if t_s < 0.6 { 0.3 } else { 0.4 };
    let lost = judged(goes_on, |_| 1.0);
    assert!(lost[0].starts_with("out of step by 0.09"), "{lost:?}");
    // Unless nothing was to be heard between the two, for however short a time: it fades out in 50 ms, and in again.
    let fades = |t_s: f64| ((t_s - 0.6).abs() / 0.05).min(1.0);
    assert_eq!(judged(goes_on, fades), [""; 0]);
    // What only falls to a fifth is heard all the time.
    let softer = |t_s: f64| ((t_s - 0.6).abs() / 0.05).clamp(0.2, 1.0);
    let lost = judged(goes_on, softer);
    assert!(lost[0].starts_with("out of step by 0.0"), "{lost:?}");
}

#[test]
fn what_does_not_repeat_of_a_texture_moves_single_cycles_and_not_ten_of_them() {
    let judged = |rendering, standing: f64| {
        // To and fro by 0.11 cycles within a sixth of a second, four waves.
        let sways = move |t_s: f64| {
            let since = if t_s < 0.6 { 0.0 } else { standing };
            since + 0.11 * (std::f64::consts::TAU * 6.25 * t_s).sin()
        };
        let run = Run {
            ahead_cycles: Box::new(sways),
            ..Run::steady(50.0, 2.0)
        };
        let mut scene = with_faults(2.0, vec![Fault::new(Kind::Nothing, 0.5)]);
        scene.display.configuration.rendering = rendering;
        finding(&scene, 0, 2_000 * MS, &run.record()).unmet()
    };
    assert_eq!(judged(Rendering::Texture, 0.0), [""; 0]);
    for (rendering, standing) in [
        (Rendering::Fundamental, 0.0),
        (Rendering::Shape, 0.0),
        (Rendering::Texture, 0.08),
    ] {
        let lost = judged(rendering, standing);
        assert!(lost[0].starts_with("out of step by 0.0"), "{lost:?}");
    }
    // Half a cycle ahead and behind in turn is no phase of 0.
    let lost = judged(Rendering::Texture, 0.5);
    assert!(lost[0].starts_with("out of step by 0.4"), "{lost:?}");
}

#[test]
fn a_part_of_a_cycle_beside_a_passing_mean_tells_no_phase() {
    // What a turn of the hand may leave for a while: 1.4 V. Of 25 cycles a second, the scene leaves parts of one.
    for (begun, part) in (0..10).flat_map(|begun| (1..10).map(move |part| (begun, part))) {
        let at_ms = 500 + 4 * begun;
        let until_ms = at_ms + 4 * part;
        let mut recording = Run::steady(50.0, 2.0).record();
        for output in &mut recording.outputs {
            let mean_v = if output.at_ns < at_ms * MS { 0.0 } else { 1.4 };
            output.words = output.words.map(|word| word_of(0.7 * volts(word) + mean_v));
        }
        let scene = with_faults(
            until_ms as f64 * 1e-3,
            vec![Fault::new(Kind::Nothing, at_ms as f64 * 1e-3)],
        );
        let unmet = finding(&scene, 0, until_ms * MS, &recording).unmet();
        assert_eq!(unmet, [""; 0], "{part} tenths from {begun} on");
    }
}

#[test]
fn what_fades_in_after_a_silence_tells_no_phase_until_it_is_all_there() {
    // 5 cycles a second, of which the scene leaves two or three after the silence.
    let judged = |drives_from_s: f64, until_ms: u64, ahead_cycles: f64| {
        let run = Run {
            ahead_cycles: Box::new(move |t_s| if t_s < 1.2 { 0.313_4 } else { ahead_cycles }),
            ..Run::steady(10.0, 2.0)
        };
        let mut recording = run.record();
        for output in &mut recording.outputs {
            let t_s = output.at_ns as f64 * 1e-9;
            let gain = if t_s < 0.6 {
                1.0
            } else {
                ((t_s - drives_from_s) / 0.02).clamp(0.0, 1.0)
            };
            output.words = output.words.map(|word| word_of(gain * volts(word)));
        }
        let scene = Scene {
            duration_s: until_ms as f64 * 1e-3,
            faults: vec![Fault::new(Kind::Nothing, 0.5)],
            ..Scene::constant(2.0, 10.0)
        };
        finding(&scene, 0, until_ms * MS, &recording).unmet()
    };
    for later in 0..20 {
        let drives_from_s = 0.8 + 0.01 * f64::from(later);
        assert_eq!(
            judged(drives_from_s, 1_400, 0.313_4),
            [""; 0],
            "{drives_from_s}"
        );
        let lost = judged(drives_from_s, 1_600, 0.513_4);
        assert!(lost[0].starts_with("out of step"), "{lost:?}");
    }
}

#[test]
fn a_silence_that_tells_nothing_is_no_part_of_a_cycle() {
    // Silent for one of 12.5 cycles a second, of which the converters are told nothing, and 10 mV first.
    for falls_ms in (508..552).step_by(4) {
        let rises_ms = falls_ms + 80;
        let mut recording = Run::steady(25.0, 2.0).record();
        for output in &mut recording.outputs {
            let at_ms = output.at_ns / MS;
            let gain = match at_ms {
                _ if at_ms < falls_ms => 1.0,
                _ if at_ms < rises_ms => 0.0,
                _ if at_ms < rises_ms + 2 => 2e-3,
                _ => 1.0,
            };
            output.words = output.words.map(|word| word_of(gain * volts(word)));
        }
        recording.outputs.dedup_by_key(|output| output.words);
        let scene = Scene {
            duration_s: 0.75,
            faults: vec![Fault::new(Kind::Nothing, 0.5)],
            ..Scene::constant(2.0, 25.0)
        };
        let unmet = finding(&scene, 0, 750 * MS, &recording).unmet();
        let steps = |line: &&String| line.starts_with("out of step");
        assert_eq!(unmet.iter().find(steps), None, "{falls_ms}");
    }
}

#[test]
fn a_voltage_beyond_the_amplitude_or_the_slew_limit_is_found() {
    let spoiled = |amplitude_mv: u16, words: &[u16]| {
        let run = Run {
            amplitude_v: f64::from(amplitude_mv) * 1e-3,
            ..Run::steady(50.0, 2.0)
        };
        let mut recording = run.record();
        let late = recording
            .outputs
            .iter_mut()
            .filter(|output| output.at_ns > 700 * MS);
        for (output, &word) in late.zip(words) {
            output.words[3] = word;
        }
        let mut scene = with_faults(2.0, vec![Fault::new(Kind::Nothing, 0.5)]);
        scene.display.configuration.amplitude_mv = amplitude_mv;
        finding(&scene, 0, 2_000 * MS, &recording).unmet()
    };
    assert_eq!(spoiled(5_000, &[]), [""; 0]);
    // 0 V at once is always right, and the way back has its limit: 5 V in half a millisecond.
    assert_eq!(spoiled(5_000, &[ZERO_VOLT]), [""; 0]);
    assert_eq!(spoiled(3_000, &[]), [""; 0]);
    let beyond = ["beyond the limits of voltage and slew at 200.50 ms"];
    assert_eq!(spoiled(3_000, &[word_of(3.01)]), beyond);
    let steep = ["beyond the limits of voltage and slew at 201.50 ms"];
    assert_eq!(
        spoiled(5_000, &[ZERO_VOLT, word_of(-3.0), word_of(2.1)]),
        steep
    );
}

#[test]
fn what_is_too_short_or_too_small_need_not_be_seen() {
    let judged_at = |update_rate, fault: Fault| {
        let mut scene = with_faults(2.0, vec![fault]);
        scene.display.configuration.update_rate = update_rate;
        finding(&scene, 0, 2_000 * MS, &Run::steady(50.0, 2.0).record()).unmet()
    };
    let judged = |fault| judged_at(UpdateRate::Hz2000, fault);
    // 2 m/s are 200 counts of 5 µm a tick. An arm's jump is 1 mm at least, and what two look at it may make: 4 mm.
    for (kind, update_rate, small, seen) in [
        (Kind::HandEncoderJump, UpdateRate::Hz2000, 400.0, 401.0),
        (Kind::HandEncoderJump, UpdateRate::Hz4000, 200.0, 201.0),
        (Kind::ArmEncoderJump, UpdateRate::Hz2000, 1_000.0, 1_001.0),
        (Kind::LinkCorrupt, UpdateRate::Hz2000, 0.000_99, 0.001),
    ] {
        let unmet = |value: f64| {
            let mut fault = Fault::new(kind, 0.5);
            fault.values[0] = value;
            judged_at(update_rate, fault)
        };
        assert_eq!(unmet(small), [""; 0], "{kind:?} {update_rate:?}");
        assert_eq!(unmet(seen)[0], "no sign of it", "{kind:?} {update_rate:?}");
    }
    let mut alarm = Fault::new(Kind::DacAlarm, 0.5);
    assert_eq!(judged(alarm)[0], "no sign of it");
    alarm.for_s = Some(0.001);
    assert_eq!(judged(alarm), [""; 0]);
}

#[test]
fn what_need_not_be_seen_must_do_no_harm() {
    let short = |outputs: Vec<OutputRecord>, signs: FaultEvidence| {
        let mut alarm = Fault::new(Kind::DacAlarm, AT_MS as f64 * 1e-3);
        alarm.for_s = Some(0.001);
        judged_for(alarm, outputs, signs).unmet()
    };
    let mut again = driven(0, AT_MS + 2, ZERO_VOLT);
    again.extend(driven(600, 700, ZERO_VOLT));
    assert_eq!(
        short(again, stopped()),
        ["restarted against the table: 0 resets, drives again"]
    );
    let stands = short(driven(0, AT_MS + 2, 0x9000), FaultEvidence::default());
    assert_eq!(stands, ["50 outputs stuck"]);
    // Of what nobody has seen, a pause is no answer.
    let mut pauses = driven(0, AT_MS + 200, ZERO_VOLT);
    pauses.extend(driven(600, END_MS, ZERO_VOLT));
    assert_eq!(short(pauses, FaultEvidence::default()), [""; 0]);
}

#[test]
fn ticks_that_stop_for_less_than_a_watchdog_waits_are_answered_by_clr_alone() {
    let mut stops = Fault::new(Kind::TickStopped, AT_MS as f64 * 1e-3);
    stops.for_s = Some(0.025);
    let mut outputs = driven(0, AT_MS + 2, ZERO_VOLT);
    outputs.extend(driven(AT_MS + 30, END_MS, ZERO_VOLT));
    let signs = |display: Vec<TimedMessage>| FaultEvidence {
        display,
        clears_ns: vec![(AT_MS + 2) * MS],
        ..FaultEvidence::default()
    };
    let unmet = |display| judged_for(stops, outputs.clone(), signs(display)).unmet();
    assert_eq!(unmet(Vec::new()), [""; 0]);
    let bitten = vec![said(AT_MS + 500, DisplayState::Stopped(Trip::Watchdog))];
    assert_eq!(
        unmet(bitten),
        ["restarted against the table: 0 resets, drives again"]
    );
}

#[test]
fn a_hand_that_goes_far_while_the_ticks_stand_looks_like_a_jump() {
    let unmet = |speed_mm_s: f64| {
        let mut stops = Fault::new(Kind::TickStopped, AT_MS as f64 * 1e-3);
        stops.for_s = Some(0.02);
        let recording = Recording {
            outputs: driven(0, AT_MS + 2, ZERO_VOLT),
            signs: FaultEvidence {
                clears_ns: vec![(AT_MS + 2) * MS],
                display: vec![said(AT_MS + 21, DisplayState::Stopped(Trip::HandEncoder))],
                ..FaultEvidence::default()
            },
            ..Run::steady(speed_mm_s, 2.0).record()
        };
        let scene = Scene {
            duration_s: END_MS as f64 * 1e-3,
            faults: vec![stops],
            ..Scene::constant(2.0, speed_mm_s)
        };
        finding(&scene, 0, END_MS * MS, &recording).unmet()
    };
    // 2 m/s are 1 mm in a tick of 0.5 ms. In 20 ms and a tick 49 mm/s go as far, to a count, and 48 do not.
    assert_eq!(unmet(49.0), [""; 0]);
    assert_eq!(
        unmet(48.0),
        ["not to be expected: display: stopped, HandEncoder, at 21.00 ms"]
    );
}

#[test]
fn a_transfer_that_fails_while_no_words_go_out_need_not_show() {
    let silent = |kind: Kind| {
        let outputs = driven(0, 20, ZERO_VOLT);
        judged(kind, outputs, FaultEvidence::default())
    };
    for kind in [Kind::DmaStall, Kind::LdacStuck, Kind::ClearStuckLow] {
        let finding = silent(kind);
        assert_eq!(finding.unmet(), [""; 0], "{kind:?}");
        let why = ["whether it shows: the display does not drive"];
        assert_eq!(finding.unjudged, why, "{kind:?}");
        let driven = judged(kind, driven(0, END_MS, ZERO_VOLT), FaultEvidence::default());
        assert_eq!(driven.unmet()[0], "no sign of it", "{kind:?}");
    }
    assert_eq!(silent(Kind::SpiStall).unmet()[0], "no sign of it");
}

#[test]
fn what_shows_once_it_is_over_is_waited_for() {
    let dips = |for_s: f64, greets_ms: u64| {
        let mut fault = Fault::new(Kind::SensorBrownOut, 0.5);
        fault.for_s = Some(for_s);
        let scene = with_faults(4.0, vec![fault]);
        let mut recording = Run::steady(50.0, 4.0).record();
        recording.signs.sensor.push(TimedMessage {
            at_ns: greets_ms * MS,
            message: Message::Hello(Hello::new(Role::Sensor, "chip", [0, 1, 0]).asking(true)),
        });
        let unmet = finding(&scene, 0, 4_000 * MS, &recording).unmet();
        let late = |line: &String| line.starts_with("sensor: greets anew after");
        unmet.into_iter().filter(late).collect::<Vec<_>>()
    };
    assert_eq!(dips(0.02, 999), [""; 0]);
    assert_eq!(
        dips(0.02, 1_001),
        ["sensor: greets anew after 501.00 ms of 500"]
    );
    assert_eq!(dips(1.02, 1_999), [""; 0]);
    assert_eq!(
        dips(1.02, 2_001),
        ["sensor: greets anew after 1501.00 ms of 1500"]
    );
}

#[test]
fn a_greeting_is_a_false_alarm_unless_the_link_may_have_lost_those_before() {
    let greets = |loss: f64, at_s: f64| {
        let mut scene = with_faults(4.0, vec![Fault::new(Kind::Nothing, at_s)]);
        scene.link.loss = loss;
        let mut recording = Run::steady(50.0, 4.0).record();
        recording.signs.sensor.push(TimedMessage {
            at_ns: 3_500 * MS,
            message: Message::Hello(Hello::new(Role::Sensor, "chip", [0, 1, 0]).asking(true)),
        });
        let unmet = finding(&scene, 0, 4_000 * MS, &recording).unmet();
        unmet
            .iter()
            .any(|line| line.contains("sensor: greets anew"))
    };
    assert!(greets(0.0, 0.5));
    // Of one in five, a greeting and its answer: 36 % of the tries fail.
    assert!(!greets(0.2, 0.5) && !greets(0.2, 3.2));
    assert!(!greets(0.02, 0.5) && greets(0.02, 2.2));
}

/// What a display has counted.
fn counted(at_ms: u64, corrupt: u32, late: u32) -> TimedMessage {
    let status = Status {
        uptime_us: at_ms * 1_000,
        reset: ResetCause::Power,
        watchdog_resets: 0,
        peer: PortCounters {
            corrupt,
            late,
            ..PortCounters::default()
        },
        console: PortCounters::default(),
        role: RoleCounters::Display(DisplayCounters::default()),
        stack_free_bytes: 0,
    };
    TimedMessage {
        at_ns: at_ms * MS,
        message: Message::Status(status),
    }
}

#[test]
fn a_wavelength_that_jumps_is_a_false_alarm_on_a_plain_surface_alone() {
    let jumps = |random: f64| {
        let mut scene = with_faults(2.0, vec![Fault::new(Kind::Nothing, 0.5)]);
        scene.surface.irregularity.random = random;
        let mut recording = Run::steady(50.0, 2.0).record();
        recording.signs.display = [(400, 0), (1_400, 1)]
            .map(|(at_ms, implausible)| {
                let mut said = counted(at_ms, 0, 0);
                if let Message::Status(status) = &mut said.message {
                    status.role = RoleCounters::Display(DisplayCounters {
                        implausible,
                        ..DisplayCounters::default()
                    });
                }
                said
            })
            .to_vec();
        finding(&scene, 0, 2_000 * MS, &recording).unmet()
    };
    assert_eq!(
        jumps(0.0),
        ["not to be expected: display: implausible 1, at 900.00 ms"]
    );
    assert_eq!(jumps(0.4), [""; 0]);
}

/// A hand that moves all the time over what `spoil` makes of a sound recording, with a fault at 0.5 s.
fn spoiled(
    fault: Kind,
    scene: Scene,
    spoil: impl FnOnce(&mut Recording),
) -> (Vec<String>, Vec<String>) {
    let mut recording = Run::steady(50.0, 2.0).record();
    spoil(&mut recording);
    let scene = Scene {
        duration_s: 2.0,
        faults: vec![Fault::new(fault, 0.5)],
        ..scene
    };
    let finding = finding(&scene, 0, 2_000 * MS, &recording);
    (finding.unmet(), finding.unjudged)
}

#[test]
fn what_the_scenes_link_shows_by_itself_is_neither_a_sign_nor_a_false_alarm() {
    let judged = |kind: Kind, corrupt: f64, reorder: f64| {
        let mut scene = Scene::constant(2.0, 50.0);
        (scene.link.corrupt, scene.link.reorder) = (corrupt, reorder);
        spoiled(kind, scene, |recording| {
            recording.signs.display = vec![counted(400, 0, 0), counted(1_400, 3, 2)];
        })
    };
    let alarms = judged(Kind::Nothing, 0.0, 0.0).0;
    assert_eq!(alarms.len(), 2, "{alarms:?}");
    assert_eq!(judged(Kind::Nothing, 1e-4, 0.01).0, [""; 0]);
    let (unmet, unjudged) = judged(Kind::LinkCorrupt, 1e-4, 0.01);
    assert!(!unmet.contains(&"no sign of it".to_owned()), "{unmet:?}");
    assert!(
        unjudged
            .iter()
            .any(|line| line.ends_with("the scene's link shows the same without it")),
        "{unjudged:?}"
    );
}

#[test]
fn a_flood_a_stop_or_a_restart_takes_the_numbers_of_frames_that_a_link_brings_late() {
    let judged = |kind, reorder: f64| {
        let mut scene = Scene::constant(2.0, 50.0);
        scene.link.reorder = reorder;
        let (unmet, _) = spoiled(kind, scene, |recording| {
            let mut said = counted(1_400, 0, 0);
            if let Message::Status(status) = &mut said.message {
                status.peer.duplicated = 6;
            }
            recording.signs.display = vec![counted(400, 0, 0), said];
        });
        let mut unmet = unmet.into_iter();
        unmet.find(|line| line.contains("duplicated"))
    };
    let alarm = "not to be expected: display: duplicated 6, at 900.00 ms";
    assert_eq!(judged(Kind::LinkFlood, 0.0).as_deref(), Some(alarm));
    assert_eq!(judged(Kind::Nothing, 0.2).as_deref(), Some(alarm));
    assert_eq!(judged(Kind::LinkFlood, 0.2), None);
    assert_eq!(judged(Kind::SensorPanic, 0.2), None);
    assert_eq!(judged(Kind::StopFromPeer, 0.2), None);
    // What comes after it excuses nothing.
    let mut scene = Scene::constant(2.0, 50.0);
    scene.link.reorder = 0.2;
    scene.duration_s = 2.0;
    scene.faults = vec![
        Fault::new(Kind::Nothing, 0.5),
        Fault::new(Kind::LinkFlood, 1.6),
    ];
    let mut recording = Run::steady(50.0, 2.0).record();
    let mut said = counted(1_400, 0, 0);
    if let Message::Status(status) = &mut said.message {
        status.peer.duplicated = 6;
    }
    recording.signs.display = vec![counted(400, 0, 0), said];
    assert_eq!(finding(&scene, 0, 2_000 * MS, &recording).unmet(), [alarm]);
}

/// The last tick of a scene of 2 s.
const LAST_S: f64 = 1.999_9;

/// A recording of a display that hears of no fault, judged.
fn unheard(faults: Vec<Fault>, speed_mm_s: f64) -> Vec<Finding> {
    let scene = Scene {
        duration_s: 2.0,
        faults,
        ..Scene::constant(2.0, speed_mm_s)
    };
    let recording = Run::steady(speed_mm_s, 2.0).record();
    judge(&scene, &recording)
}

#[test]
fn what_the_end_leaves_no_time_for_is_not_judged_and_said() {
    for kind in Kind::all() {
        let finding = unheard(vec![Fault::new(kind, LAST_S)], 50.0).remove(0);
        assert_eq!(finding.unmet(), [""; 0], "{kind:?}");
        let row = kind.row();
        if row.seen_within_ms.is_some() || row.again_within_ms.is_some() {
            assert!(!finding.unjudged.is_empty(), "{kind:?}");
        }
        let says = |line: &String| line.ends_with(": the scene ends before");
        assert!(finding.unjudged.iter().all(says), "{:?}", finding.unjudged);
    }
    // With the time, it is.
    let finding = unheard(vec![Fault::new(Kind::GaugeOpen, 1.7)], 50.0).remove(0);
    assert_eq!(finding.unmet(), ["no sign of it"]);
    let finding = unheard(vec![Fault::new(Kind::GaugeOpen, 1.700_001)], 50.0).remove(0);
    assert_eq!(finding.unmet(), [""; 0]);
    assert_eq!(
        finding.unjudged,
        ["whether it shows within 300 ms: the scene ends before"]
    );
    let finding = unheard(vec![Fault::new(Kind::DacAlarm, 1.95)], 50.0).remove(0);
    assert_eq!(
        finding.unmet(),
        ["no sign of it", "outputs not at 0 V", "50 outputs stuck"]
    );
    assert_eq!(
        finding.unjudged,
        ["whether it says that it has stopped: the scene ends before"]
    );
}

#[test]
fn a_stop_after_a_stop_need_not_show_and_outputs_have_to_stay_at_zero() {
    let faults = vec![
        Fault::new(Kind::StopFromPeer, 0.5),
        Fault::new(Kind::StopFromPeer, 1.0),
    ];
    let scene = with_faults(2.0, faults);
    let mut recording = Run::steady(50.0, 2.0).record();
    let mut silent_to = |to_ms: u64| {
        silence(&mut recording, 500..to_ms);
        recording.outputs.dedup_by_key(|output| output.words);
        judge(&scene, &recording).remove(1)
    };
    // It has not stopped.
    assert_eq!(
        silent_to(0).unmet(),
        ["no sign of it", "outputs not at 0 V", "50 outputs stuck"]
    );
    assert_eq!(
        silent_to(1_500).unmet(),
        [
            "outputs not at 0 V",
            "restarted against the table: 0 resets, drives again"
        ]
    );
    let finding = silent_to(2_000);
    assert_eq!(finding.unmet(), [""; 0]);
    assert_eq!(
        finding.unjudged,
        ["whether it shows within 5 ms: the display has stopped before"]
    );
}

#[test]
fn at_slow_hands_a_converter_that_stands_still_may_show_late() {
    let unmet = |speed_mm_s| {
        let finding = unheard(vec![Fault::new(Kind::AdcStuck, 0.5)], speed_mm_s).remove(0);
        finding.unmet().contains(&"no sign of it".to_owned())
    };
    assert!(unmet(13.0));
    assert!(!unmet(11.0));
}
