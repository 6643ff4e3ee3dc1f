//! Faults on the ELFs: one of every sort, and the instant.

use std::ops::Range;
use std::thread;

use hil_sim_core::judge;
use hil_sim_core::judge::fault::Finding;
use hil_sim_core::scene::Scene;
use hil_sim_core::scene::fault::{Fault, Kind};
use hil_sim_studies::campaign::{Plan, Tally, Trial, unmet};
use protocol::{Mode, Rendering, Role, RoleCounters};
use tests::elves;

/// An instruction takes 8.3 ns.
const INSTRUCTION_NS: u64 = 9;

/// One of each sort; `hil-sim campaign` tries them all, and at many instants.
const KINDS: [Kind; 18] = [
    Kind::Nothing,
    Kind::LinkGarbage,
    Kind::EstimateNan,
    Kind::HandEncoderJump,
    Kind::EmergencyStop,
    Kind::StopFromConsole,
    Kind::WrongConfiguration,
    Kind::DacIgnoresWords,
    Kind::LdacStuck,
    Kind::SpiStall,
    Kind::ThreadStall,
    Kind::Panic,
    Kind::StackOverflow,
    Kind::MemoryChanged,
    Kind::BrownOut,
    Kind::SensorHang,
    Kind::ArmEncoderDead,
    Kind::ArmEncoderJump,
];

#[test]
fn faults_of_every_sort_come_out_as_the_table_says() {
    let plan = Plan {
        kinds: KINDS.to_vec(),
        instants: 1,
        seed: 20,
        rendering: Rendering::Fundamental,
    };
    let firmwares = elves::both();
    let trials: Vec<Trial> = thread::scope(|scope| {
        let runs: Vec<_> = plan
            .shifts()
            .into_iter()
            .map(|shift| scope.spawn(move || shift.run(firmwares)))
            .collect();
        runs.into_iter()
            .flat_map(|run| {
                run.join()
                    .unwrap()
                    .unwrap_or_else(|error| panic!("{error}"))
            })
            .collect()
    });
    let tallies: Vec<Tally> = plan
        .kinds
        .iter()
        .map(|&kind| Tally::of(kind, &trials))
        .collect();
    let details: Vec<String> = trials
        .iter()
        .filter(|trial| !trial.unmet().is_empty())
        .map(|trial| format!("{:?}: {:?}", trial.finding, trial.unmet()))
        .collect();
    assert!(
        unmet(&tallies).is_empty() && details.is_empty(),
        "{:#?}\n{details:#?}",
        unmet(&tallies)
    );
}

#[test]
fn power_goes_at_the_very_instant_and_the_board_comes_back() {
    // Off the tick, off the quantum.
    let at_s = 0.612_345_678;
    let brown_out = Fault::new(Kind::BrownOut, at_s);
    let scene = Scene {
        duration_s: 1.0,
        faults: vec![brown_out],
        ..Scene::constant(2.0, 50.0)
    };
    let (recording, facts) = hil_sim_boards::run(&scene, elves::both()).unwrap();
    let signs = &recording.signs;
    assert_eq!(facts.resets, 1);
    assert_eq!(signs.resets[0].role, Role::Display);
    assert!(signs.resets[0].is_injected);
    let begins_ns = brown_out.begins_ns();
    assert!(signs.resets[0].at_ns - begins_ns <= INSTRUCTION_NS);
    assert!(signs.clears_ns[0] - begins_ns <= INSTRUCTION_NS);
    let back_ns = brown_out.ends_ns().unwrap();
    let is_driven = |at_ns: u64| at_ns > back_ns;
    let after = recording
        .outputs
        .iter()
        .filter(|output| is_driven(output.at_ns));
    assert!(after.count() > 100);
    let off = recording
        .ticks
        .iter()
        .filter(|tick| (begins_ns..back_ns).contains(&tick.at_ns));
    assert_eq!(off.count(), 0);
}

/// In the middle of a frame, too: the emulated DMA ends it and asks for an interrupt, which nothing can end without
/// DMA2's clock. On silicon, so it is between a frame's end and the answer to its interrupt.
#[test]
fn a_dma_that_stalls_in_the_middle_of_an_update_is_named() {
    const FROM_S: f64 = 0.32;
    const WATCH_S: f64 = 0.1;
    /// From a tick until its words are out.
    const UPDATE_NS: Range<u64> = 0..90_000;
    /// Less than a frame takes, 5.1 µs, so that each of the four is met.
    const STEP_NS: usize = 4_000;
    let mut healthy = Scene {
        duration_s: FROM_S + 0.01,
        ..Scene::constant(2.0, 50.0)
    };
    // A uniform stimulus is one frame for all chips.
    healthy.display.configuration.mode = Mode::Travelling;
    let firmwares = elves::both();
    let (recording, _) = hil_sim_boards::run(&healthy, firmwares).unwrap();
    let from_ns = (FROM_S * 1e9) as u64;
    let mut ticks = recording.ticks.iter().map(|tick| tick.at_ns);
    let tick_ns = ticks.find(|&at_ns| at_ns > from_ns).unwrap();
    // One after the other, so that all have the same two processors.
    let findings: Vec<(u64, Finding)> = UPDATE_NS
        .step_by(STEP_NS)
        .map(|after_ns| {
            let stall = Fault::new(Kind::DmaStall, (tick_ns + after_ns) as f64 * 1e-9);
            let scene = Scene {
                duration_s: stall.at_s + WATCH_S,
                faults: vec![stall],
                ..healthy.clone()
            };
            let (recording, _) = hil_sim_boards::run(&scene, firmwares).unwrap();
            (after_ns, judge::fault::judge(&scene, &recording).remove(0))
        })
        .collect();
    let unmet: Vec<(u64, Vec<String>)> = findings
        .iter()
        .map(|(after_ns, finding)| (*after_ns, finding.unmet()))
        .filter(|(_, unmet)| !unmet.is_empty())
        .collect();
    assert!(unmet.is_empty(), "ns after the tick: {unmet:#?}");
    assert!(findings.iter().all(|(_, finding)| finding.was_driving));
}

/// The first of its estimates never leave it: they are not said before the display has answered its greeting.
#[test]
fn a_sensor_that_starts_again_behind_a_slow_link_is_followed_again() {
    for delay_ms in [60.0, 200.0] {
        let mut scene = Scene {
            duration_s: 4.0,
            faults: vec![Fault::new(Kind::SensorPanic, 2.5)],
            ..Scene::constant(2.0, 50.0)
        };
        scene.link.delay_ms = delay_ms;
        let (recording, _) = hil_sim_boards::run(&scene, elves::both()).unwrap();
        let finding = judge::fault::judge(&scene, &recording).remove(0);
        assert_eq!(finding.unmet(), Vec::<String>::new(), "{delay_ms}");
        let status = recording.display_status.expect("one a second");
        let RoleCounters::Display(counters) = status.role else {
            panic!("the display's: {status:?}");
        };
        assert_eq!(counters.refused_estimates, 0, "{delay_ms}");
        let last_ns = recording.outputs.last().map(|output| output.at_ns);
        assert!(last_ns > Some(3_990_000_000), "{delay_ms}: {last_ns:?}");
    }
}

/// While the hand rests no words are sent, and the next look into a converter is what meets it.
#[test]
fn an_spi_that_stalls_while_the_hand_rests_is_no_converters_fault() {
    let stall = Fault::new(Kind::SpiStall, 0.5);
    let scene = Scene {
        duration_s: 0.6,
        faults: vec![stall],
        ..Scene::constant(2.0, 0.0)
    };
    let (recording, _) = hil_sim_boards::run(&scene, elves::both()).unwrap();
    let finding = judge::fault::judge(&scene, &recording).remove(0);
    assert_eq!(finding.unmet(), Vec::<String>::new());
    assert!(finding.detected_ns.is_some(), "{finding:?}");
}

/// What comes over the UARTs waits for the samples: without DMA1's clock its interrupt, if it has just asked for one,
/// cannot be ended and comes again and again.
#[test]
fn uarts_without_their_dma_cost_no_samples() {
    const TIMES: usize = 12;
    let faults = (0..TIMES).map(|turn| Fault::new(Kind::UartOverrun, 0.6 + 0.103 * turn as f64));
    let scene = Scene {
        duration_s: 2.1,
        faults: faults.collect(),
        ..Scene::constant(2.0, 50.0)
    };
    let (recording, _) = hil_sim_boards::run(&scene, elves::both()).unwrap();
    let status = recording.sensor_status.expect("two a run");
    let RoleCounters::Sensor(counters) = status.role else {
        panic!("the sensor's: {status:?}");
    };
    assert_eq!(
        (
            counters.samples,
            counters.dma_overruns,
            counters.deadline_misses
        ),
        (2_000, 0, 0),
        "{status:?}"
    );
    // At least so often something was lost of what the display says, 500 times a second.
    assert!(status.peer.lost as usize > TIMES, "{status:?}");
}

/// An error on the line ends the DMA, which then begins at its ring's start again.
#[test]
fn what_a_display_heard_before_its_line_broke_is_not_heard_again() {
    let mut stuck = Fault::new(Kind::WireStuckLow, 0.6);
    stuck.for_s = Some(0.02);
    let scene = Scene {
        duration_s: 2.1,
        faults: vec![stuck],
        ..Scene::constant(2.0, 50.0)
    };
    let (recording, _) = hil_sim_boards::run(&scene, elves::both()).unwrap();
    let port = recording.display_status.expect("two a run").peer;
    assert!(port.line_errors > 100, "{port:?}");
    assert_eq!((port.late, port.duplicated), (0, 0), "{port:?}");
}

#[test]
fn what_breaks_a_board_that_does_not_run_is_no_refusal_and_not_missed() {
    let at = |kind, at_s, for_s| Fault {
        for_s,
        ..Fault::new(kind, at_s)
    };
    let unjudged = |faults: &[Fault]| {
        let scene = Scene {
            duration_s: 2.6,
            faults: faults.to_vec(),
            ..Scene::constant(2.0, 50.0)
        };
        let (recording, _) = hil_sim_boards::run(&scene, elves::both()).unwrap();
        let findings = judge::fault::judge(&scene, &recording);
        let unmet: Vec<_> = findings.iter().flat_map(Finding::unmet).collect();
        assert_eq!(unmet, [""; 0]);
        findings[1].unjudged.clone()
    };
    let away = "whether it shows: its board does not run then".to_owned();
    for kind in [Kind::Panic, Kind::MemoryChanged, Kind::EmergencyStop] {
        let brown_out = at(Kind::BrownOut, 0.8, Some(0.5));
        let told = unjudged(&[brown_out, Fault::new(kind, 1.0)]);
        assert!(told.contains(&away), "{kind:?}: {told:?}");
    }
    let hangs_on = [
        Fault::new(Kind::SensorPanic, 0.8),
        Fault::new(Kind::SensorHang, 0.808),
    ];
    // The restart after the first shows for both.
    assert!(!unjudged(&hangs_on).contains(&away));
}
