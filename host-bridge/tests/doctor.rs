//! What the doctor makes of the facts: nothing of a bench that is well, and of each fault one finding.

use host_bridge::doctor::clock::{ClockFacts, Drift};
use host_bridge::doctor::examination::{BoardFacts, ElfFacts, Examination, ProbeFacts};
use host_bridge::doctor::findings::{self, Finding};
use host_bridge::doctor::permission::Permission;
use host_bridge::doctor::report::{self, Style};
use host_bridge::doctor::{counters, json};
use host_bridge::place::StLink;
use host_bridge::state::State;
use protocol::{
    DisplayCounters, DisplayState, GaugeHealth, Hello, Hold, PortCounters, ResetCause, Role,
    RoleCounters, SensorCounters, Status, Trip,
};
use serde_json::Value;

fn hello(role: Role) -> Hello {
    Hello::new(role, "stm32f429zi", [0, 1, 0])
}

fn status(role: Role, uptime_us: u64, frames: u32) -> Status {
    let port = PortCounters {
        sent: frames,
        received: frames,
        ..PortCounters::new()
    };
    Status {
        uptime_us,
        reset: ResetCause::Power,
        watchdog_resets: 0,
        peer: port,
        console: port,
        role: match role {
            Role::Display => RoleCounters::Display(DisplayCounters {
                state: DisplayState::Ready,
                ..DisplayCounters::ZERO
            }),
            _ => RoleCounters::Sensor(SensorCounters::ZERO),
        },
    }
}

/// A board that is well.
fn board(role: Role) -> BoardFacts {
    let known = State::Known {
        port: format!("/dev/tty-{}", role.name()).into(),
        hello: hello(role),
    };
    let mut board = BoardFacts::new(role, known);
    board.hello = Some(hello(role));
    board.first = Some(status(role, 90_000_000, 4_000));
    board.last = Some(status(role, 92_000_000, 5_000));
    board.rate_hz = Some(board.nominal_rate_hz());
    board.health = (role == Role::Sensor).then_some([GaugeHealth::Good; 5]);
    board.clock = Some(ClockFacts {
        offset_us: -1_500_000,
        round_trip_us: 900,
        drift: Some(Drift {
            ppm: 30.0,
            error_ppm: 40.0,
        }),
    });
    board.elf = Some(ElfFacts {
        path: format!("/elves/firmware-{}", role.name()).into(),
        hello: Ok(hello(role)),
    });
    board
}

/// A bench that is well.
fn bench() -> Examination {
    Examination {
        looked_s: 3.0,
        st_links: vec![StLink {
            port: "/dev/tty-sensor".into(),
            serial: Some("066C".to_owned()),
        }],
        probes: vec![ProbeFacts {
            name: "STLink V2-1".to_owned(),
            vendor: 0x0483,
            product: 0x374b,
            serial: Some("066C".to_owned()),
            is_allowed: true,
        }],
        has_plugdev: true,
        boards: vec![board(Role::Sensor), board(Role::Display)],
    }
}

/// A bench that is well but for what `spoil` makes of it.
fn spoiled(spoil: impl FnOnce(&mut Examination)) -> Vec<Finding> {
    let mut bench = bench();
    spoil(&mut bench);
    findings::of(&bench)
}

fn sensor_spoiled(spoil: impl FnOnce(&mut BoardFacts)) -> Vec<Finding> {
    spoiled(|bench| spoil(&mut bench.boards[0]))
}

fn display_spoiled(spoil: impl FnOnce(&mut BoardFacts)) -> Vec<Finding> {
    spoiled(|bench| spoil(&mut bench.boards[1]))
}

/// Asserts that there is one finding: kind, what with its board, advice.
#[track_caller]
fn one(found: &[Finding], kind: &str, what: &str, advice: &str) {
    let said: Vec<(&str, String, &str)> = found
        .iter()
        .map(|finding| (finding.kind, finding.to_string(), finding.advice.as_str()))
        .collect();
    assert_eq!(said, [(kind, what.to_owned(), advice)]);
}

fn sensor_counters(board: &mut BoardFacts, set: impl Fn(&mut SensorCounters)) {
    for status in [&mut board.first, &mut board.last].into_iter().flatten() {
        if let RoleCounters::Sensor(counters) = &mut status.role {
            set(counters);
        }
    }
}

fn display_counters(board: &mut BoardFacts, set: impl Fn(&mut DisplayCounters)) {
    for status in [&mut board.first, &mut board.last].into_iter().flatten() {
        if let RoleCounters::Display(counters) = &mut status.role {
            set(counters);
        }
    }
}

fn peer(board: &mut BoardFacts, set: impl Fn(&mut PortCounters)) {
    for status in [&mut board.first, &mut board.last].into_iter().flatten() {
        set(&mut status.peer);
    }
}

#[test]
fn a_bench_that_is_well_has_no_findings() {
    assert_eq!(findings::of(&bench()), []);
}

#[test]
fn a_probe_that_is_not_for_this_user_comes_with_its_rule() {
    one(
        &spoiled(|bench| bench.probes[0].is_allowed = false),
        "probe-denied",
        "no permission to use STLink V2-1 066C as a probe",
        "put this line into /etc/udev/rules.d/70-st-link.rules, then `sudo udevadm control --reload \
         && sudo udevadm trigger`: SUBSYSTEM==\"usb\", ATTRS{idVendor}==\"0483\", \
         ATTRS{idProduct}==\"374b\", MODE=\"0660\", GROUP=\"plugdev\", TAG+=\"uaccess\"",
    );
}

#[test]
fn each_state_of_a_port_is_named_with_advice() {
    let port = || "/dev/ttyACM0".into();
    for (state, kind, what, advice) in [
        (
            State::Absent {
                place: "/dev/ttyACM0".to_owned(),
            },
            "absent",
            "sensor: /dev/ttyACM0: not there",
            "plug the board in at its ST-LINK's USB socket, or name its port with --sensor or --display",
        ),
        (
            State::Busy { port: port() },
            "busy",
            "sensor: /dev/ttyACM0: another program has it",
            "close the other program: monitor, record, relay, tio and screen all take the port for themselves",
        ),
        (
            State::Failed {
                port: port(),
                reason: "is a folder, not a serial port".to_owned(),
            },
            "failed",
            "sensor: /dev/ttyACM0: is a folder, not a serial port",
            "see whether it is a serial port",
        ),
        (
            State::Opened { port: port() },
            "opened",
            "sensor: /dev/ttyACM0: has not answered yet",
            "look longer: --for 10",
        ),
        (
            State::Silent { port: port() },
            "silent",
            "sensor: /dev/ttyACM0: silent",
            "see whether the board has power and firmware (`host-bridge flash`), and whether the port is its console",
        ),
        (
            State::Deaf { port: port() },
            "deaf",
            "sensor: /dev/ttyACM0: speaks and does not answer",
            "nothing that is sent reaches the board: see its RX line (PD9)",
        ),
        (
            State::Garbage { port: port() },
            "garbage",
            "sensor: /dev/ttyACM0: sends garbage",
            "see whether this is a Ridgelink board's console: 921600 baud, 8N1",
        ),
        (
            State::Stranger {
                port: port(),
                hello: hello(Role::Display),
                wanted: Role::Sensor,
            },
            "wrong-role",
            "sensor: /dev/ttyACM0: display 0.1.0 on stm32f429zi, not the sensor",
            "exchange --sensor and --display, or flash the other firmware",
        ),
    ] {
        one(
            &sensor_spoiled(|board| board.state = state),
            kind,
            what,
            advice,
        );
    }
}

#[test]
fn a_port_of_another_group_names_the_group() {
    one(
        &sensor_spoiled(|board| {
            board.state = State::Denied {
                port: "/dev/ttyACM0".into(),
            };
            board.permission = Some(Permission {
                group: "uucp".to_owned(),
                mode: 0o660,
                is_member: false,
                is_listed: false,
            });
        }),
        "denied",
        "sensor: /dev/ttyACM0: no permission to open it (group uucp, mode 0660)",
        "join the group that owns it: `sudo usermod -aG uucp $USER`, then log in again",
    );
}

#[test]
fn boards_of_another_version_are_named_by_what_differs() {
    let other_schema = Hello {
        schema: 7_u64.to_le_bytes(),
        ..hello(Role::Sensor)
    };
    let foreign = |hello| State::Foreign {
        port: "/dev/ttyACM0".into(),
        hello,
    };
    let found = spoiled(|bench| {
        bench.boards.truncate(1);
        bench.boards[0].elf = None;
        bench.boards[0].hello = Some(other_schema);
        bench.boards[0].state = foreign(other_schema);
    });
    let ours = format!("{:016x}", protocol::SCHEMA_HASH);
    one(
        &found,
        "foreign",
        &format!(
            "sensor: /dev/ttyACM0: sensor 0.1.0 on stm32f429zi of protocol 3, this program speaks 3 too, \
             but of schema 0000000000000007, not {ours}"
        ),
        "flash the firmware of this build: `host-bridge flash`",
    );
    let other_protocol = Hello {
        protocol: 9_u16.to_le_bytes(),
        ..hello(Role::Sensor)
    };
    let found = spoiled(|bench| {
        bench.boards[0].elf = None;
        bench.boards[0].hello = Some(other_protocol);
        bench.boards[0].state = foreign(other_protocol);
    });
    assert_eq!(
        found.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            format!(
                "the boards do not understand each other: sensor protocol 9 schema {ours}, \
                 display protocol 3 schema {ours}"
            ),
            "sensor: /dev/ttyACM0: sensor 0.1.0 on stm32f429zi of protocol 9, this program speaks 3"
                .to_owned(),
        ]
    );
    assert_eq!(found[0].kind, "boards-differ");
    assert_eq!(
        found[0].advice,
        "flash both boards with one build: `host-bridge flash`"
    );
}

#[test]
fn a_firmware_that_is_not_the_benchs_is_told_from_one_that_cant_be_read() {
    let ours = format!("{:016x}", protocol::SCHEMA_HASH);
    one(
        &sensor_spoiled(|board| {
            board.elf = Some(ElfFacts {
                path: "/elves/firmware-sensor".into(),
                hello: Ok(Hello::new(Role::Sensor, "stm32f429zi", [0, 2, 0])),
            });
        }),
        "elf-differs",
        &format!(
            "sensor: runs sensor 0.1.0 on stm32f429zi with protocol 3 schema {ours}, but firmware-sensor \
             is sensor 0.2.0 on stm32f429zi with protocol 3 schema {ours}"
        ),
        "flash what the bench names: `host-bridge flash sensor`",
    );
    one(
        &display_spoiled(|board| {
            board.elf = Some(ElfFacts {
                path: "x.elf".into(),
                hello: Err("x.elf: can't be read".to_owned()),
            });
        }),
        "elf-unusable",
        "display: x.elf: can't be read",
        "name the right file as `elf` under [display] in the bench file, or build it",
    );
}

#[test]
fn a_link_that_is_down_is_named_by_who_hears_nothing() {
    let deaf = |board: &mut BoardFacts| peer(board, |port| port.received = 4_000);
    one(
        &display_spoiled(deaf),
        "peer-link",
        "the link between the boards is down: the display hears nothing",
        "see the wire to its PD6 from the other board's PD5, and the common ground",
    );
    one(
        &spoiled(|bench| bench.boards.iter_mut().for_each(deaf)),
        "peer-link",
        "the link between the boards is down: neither hears the other",
        "see the wires between the boards: PD5 and PD6 crossed, a common ground",
    );
    // One board alone, as at one end of a relay, has nobody to hear.
    let alone = spoiled(|bench| {
        bench.boards.truncate(1);
        deaf(&mut bench.boards[0]);
    });
    assert_eq!(alone, []);
}

#[test]
fn restarts_losses_and_a_missing_status_are_named() {
    one(
        &sensor_spoiled(|board| board.restarts = 2),
        "restarted",
        "sensor: started anew twice while it was looked at",
        "see its supply; if that is well, keep its log (`host-bridge monitor` with its ELF)",
    );
    one(
        &sensor_spoiled(|board| board.losses = 3),
        "lost",
        "sensor: its line was lost 3 times while it was looked at",
        "see USB cable, plug and hub, and the board's supply",
    );
    one(
        &sensor_spoiled(|board| (board.first, board.last) = (None, None)),
        "no-status",
        "sensor: says nothing of itself",
        "reset the board; if it stays so, flash it: `host-bridge flash`",
    );
}

#[test]
fn watchdog_resets_are_named() {
    let resets = |reset| {
        sensor_spoiled(|board| {
            for status in [&mut board.first, &mut board.last].into_iter().flatten() {
                status.watchdog_resets = 1;
                status.reset = reset;
            }
        })
    };
    let advice =
        "its firmware hung or panicked: keep its log, report it; power takes the count back";
    one(
        &resets(ResetCause::Pin),
        "watchdog",
        "sensor: restarted by its watchdog once since power came on",
        advice,
    );
    one(
        &resets(ResetCause::Watchdog),
        "watchdog",
        "sensor: restarted by its watchdog once since power came on, the last start among them",
        advice,
    );
}

#[test]
fn a_count_says_whether_it_grows() {
    let advice =
        "see the wires between the boards: short, with a common ground, away from the drives";
    let corrupt = |first, last: Option<u32>| {
        sensor_spoiled(|board| {
            if let Some(status) = &mut board.first {
                status.peer.corrupt = first;
            }
            match (&mut board.last, last) {
                (Some(status), Some(count)) => status.peer.corrupt = count,
                (status, _) => *status = None,
            }
        })
    };
    for (first, last, growth) in [
        (
            5,
            Some(5),
            "5 damaged frames (corrupt), none while it was looked at",
        ),
        (
            5,
            Some(9),
            "9 damaged frames (corrupt), 4 of them while it was looked at",
        ),
        (
            0,
            Some(4),
            "4 damaged frames (corrupt), all of them while it was looked at",
        ),
        (5, None, "5 damaged frames (corrupt)"),
    ] {
        let what = format!("sensor: peer link: {growth}");
        one(&corrupt(first, last), "counter", &what, advice);
    }
}

#[test]
fn every_error_counter_of_a_port_that_grows_is_a_finding_with_advice() {
    let names = [
        "dropped",
        "lost",
        "corrupt",
        "overlong",
        "malformed",
        "overruns",
        "line_errors",
        "late",
        "duplicated",
        "foreign",
        "unheralded",
    ];
    let grown = PortCounters {
        sent: 0,
        received: 0,
        dropped: 2,
        lost: 2,
        corrupt: 2,
        overlong: 2,
        late: 2,
        duplicated: 2,
        malformed: 2,
        foreign: 2,
        unheralded: 2,
        overruns: 2,
        line_errors: 2,
    };
    let zero = PortCounters::new();
    for of in [counters::of_peer, counters::of_console] {
        let all = of(&zero, Some(&grown));
        assert_eq!(
            all.iter().map(|count| count.name).collect::<Vec<_>>(),
            names
        );
        assert!(
            all.iter()
                .all(|count| (count.count, count.grown) == (2, Some(2)))
        );
        assert!(all.iter().all(|count| count.advice.len() <= 100));
        // At rest only those that tell of a fault whenever it was.
        let at_rest = of(&grown, Some(&grown));
        let at_rest: Vec<&str> = at_rest.iter().map(|count| count.name).collect();
        assert_eq!(at_rest, names[..7]);
        assert_eq!(of(&zero, Some(&zero)), []);
    }
}

#[test]
fn what_this_end_counts_while_it_looks_is_a_finding() {
    let counted = |counters| sensor_spoiled(|board| board.counters = counters);
    one(
        &counted(PortCounters {
            lost: 7,
            ..PortCounters::new()
        }),
        "counter",
        "sensor: this end of the console: 7 frames that never came (lost), all of them while it was looked at",
        "see USB cable and hub, and whether this computer is too busy",
    );
    // The frame in whose middle the line was opened, and those before the board's Hello.
    assert_eq!(
        counted(PortCounters {
            corrupt: 1,
            unheralded: 5,
            ..PortCounters::new()
        }),
        []
    );
}

#[test]
fn what_a_sensor_counts_is_a_finding() {
    let found = sensor_spoiled(|board| {
        sensor_counters(board, |counters| {
            *counters = SensorCounters {
                samples: 1,
                adc_overruns: 2,
                dma_overruns: 3,
                deadline_misses: 4,
                estimates: 5,
                motions: 6,
            };
        });
    });
    assert_eq!(
        found.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "sensor: board: 2 conversions lost by the ADC (adc_overruns), none while it was looked at",
            "sensor: board: 3 times that scans were lost (dma_overruns), none while it was looked at",
            "sensor: board: 4 samples that were done too late (deadline_misses), none while it was looked at",
        ]
    );
}

#[test]
fn what_a_display_counts_is_a_finding() {
    let spoil = |counters: &mut DisplayCounters| {
        *counters = DisplayCounters {
            ticks: 9,
            updates: 9,
            estimates: 9,
            fades: 9,
            changes: 9,
            deadline_misses: 1,
            spi_errors: 2,
            converter_faults: 3,
            clears: 4,
            encoder_jumps: 5,
            unheard: 6,
            flooded: 7,
            implausible: 8,
            refused_estimates: 9,
            state: DisplayState::Driving,
        };
    };
    let found = display_spoiled(|board| display_counters(board, spoil));
    let names: Vec<&str> = found
        .iter()
        .filter_map(|finding| finding.what.split(['(', ')']).nth(1))
        .collect();
    // Of the last two a specimen's edge, or an estimate that came late, makes one now and then.
    let at_rest = [
        "deadline_misses",
        "spi_errors",
        "converter_faults",
        "clears",
        "encoder_jumps",
        "unheard",
        "flooded",
    ];
    assert_eq!(names, at_rest);
    let grown = display_spoiled(|board| {
        if let Some(status) = &mut board.last
            && let RoleCounters::Display(counters) = &mut status.role
        {
            counters.implausible = 1;
            counters.refused_estimates = 1;
        }
    });
    assert_eq!(
        grown.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "display: board: 1 estimates that can't be true (implausible), all of them while it was looked at",
            "display: board: 1 estimates that were old or out of range (refused_estimates), \
             all of them while it was looked at",
        ]
    );
}

#[test]
fn a_supervisor_that_keeps_the_stimulus_away_says_why_and_what_to_do() {
    let state = |state, uptime_us| {
        display_spoiled(|board| {
            display_counters(board, |counters| counters.state = state);
            if let Some(status) = &mut board.last {
                status.uptime_us = uptime_us;
            }
        })
    };
    one(
        &state(DisplayState::Stopped(Trip::EmergencyStop), 9_000_000),
        "stopped",
        "display: no stimulus: stopped: emergency stop",
        "release the emergency stop, or see its wire (D4 to ground, normally closed), then press reset",
    );
    one(
        &state(DisplayState::Fading(Hold::Stale), 9_000_000),
        "fading",
        "display: no stimulus: fading: no fresh estimate",
        "the sensor board has to be on, linked (PD5, PD6 crossed, ground) and on a surface that moves",
    );
    one(
        &state(DisplayState::Boot, 2_000_000),
        "starting",
        "display: no stimulus: starting",
        "the converters do not start: see their supply and SPI1 (SCK D13, SDI D11, SDO D12, CS D10 to D7)",
    );
    assert_eq!(state(DisplayState::Boot, 1_999_999), []);
    assert_eq!(state(DisplayState::Driving, 9_000_000), []);
}

#[test]
fn a_board_that_says_too_little_is_named() {
    one(
        &sensor_spoiled(|board| board.rate_hz = Some(0.0)),
        "rate",
        "sensor: sends no estimates",
        "reset the board; if it stays so, keep its log and report it",
    );
    one(
        &display_spoiled(|board| board.rate_hz = Some(449.0)),
        "rate",
        "display: 449 motions a second arrive instead of 500",
        "see whether this computer, its USB hub or the console line is too busy",
    );
    assert_eq!(display_spoiled(|board| board.rate_hz = Some(451.0)), []);
}

#[test]
fn each_sick_gauge_is_named() {
    for (health, word) in [
        (GaugeHealth::Dead, "dead"),
        (GaugeHealth::Stuck, "stuck at one code"),
        (GaugeHealth::Saturated, "saturated"),
        (GaugeHealth::Noisy, "noisy"),
        (GaugeHealth::Hum, "full of mains hum"),
    ] {
        let found = sensor_spoiled(|board| {
            board.health = Some([
                GaugeHealth::Good,
                GaugeHealth::Good,
                GaugeHealth::Good,
                health,
                GaugeHealth::Good,
            ]);
        });
        assert_eq!(found.len(), 1, "{word}");
        assert_eq!(
            found[0].to_string(),
            format!("sensor: gauge 3 (A3) is {word}")
        );
        assert!(!found[0].advice.is_empty());
    }
}

#[test]
fn a_clock_that_is_no_crystals_is_named_and_one_that_may_be_is_not() {
    let drifting = |ppm, error_ppm| {
        sensor_spoiled(|board| {
            if let Some(clock) = &mut board.clock {
                clock.drift = Some(Drift { ppm, error_ppm });
            }
        })
    };
    let advice = "see the 8 MHz clock that the ST-LINK gives the board; an emulated one needs an idle computer";
    one(
        &drifting(-9_000.0, 300.0),
        "drift",
        "sensor: its clock loses 9000 ppm on this computer's: more than crystals differ by",
        advice,
    );
    one(
        &drifting(801.0, 300.0),
        "drift",
        "sensor: its clock gains 801 ppm on this computer's: more than crystals differ by",
        advice,
    );
    assert_eq!(drifting(799.0, 300.0), []);
    one(
        &sensor_spoiled(|board| {
            if let Some(clock) = &mut board.clock {
                clock.round_trip_us = 80_000;
            }
        }),
        "round-trip",
        "sensor: no answer comes within 50 ms: the quickest took 80 ms",
        "see whether this computer or its USB hub is too busy",
    );
}

#[test]
fn a_board_that_is_not_there_is_asked_for_nothing_else() {
    let found = sensor_spoiled(|board| {
        *board = BoardFacts::new(
            Role::Sensor,
            State::Absent {
                place: "/dev/ttyACM0".to_owned(),
            },
        );
    });
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].kind, "absent");
}

#[test]
fn the_report_for_people_reads_well_in_eighty_columns() {
    let mut bench = bench();
    bench.boards[1].restarts = 1;
    bench.boards[1].state = State::Absent {
        place:
            "/dev/serial/by-id/usb-STMicroelectronics_STM32_STLink_066CFF484971754867083829-if02"
                .to_owned(),
    };
    let findings = findings::of(&bench);
    let expected = format!(
        "\
host-bridge 0.1.0, protocol 3, schema {:016x}

attached
  ST-LINK 066C: /dev/tty-sensor
  probe 0483:374b:066C STLink V2-1

sensor
  port         /dev/tty-sensor: sensor 0.1.0 on stm32f429zi
  bench's ELF  /elves/firmware-sensor: sensor 0.1.0 on stm32f429zi
  up           1 min 32 s, started by power, no watchdog reset
  gauges 0-4   good, good, good, good, good
  clock        -1.500000 s to this program's, drifts +30 ± 40 ppm
  round trip   0.9 ms
  says         100 estimates a second
  other board  1000 frames heard from it

display
  port         /dev/serial/by-id/usb-STMicroelectronics_STM32_STLink_066CFF484971754867083829-if02:
               not there
  bench's ELF  /elves/firmware-display: display 0.1.0 on stm32f429zi

1 finding
  1. display:
     /dev/serial/by-id/usb-STMicroelectronics_STM32_STLink_066CFF484971754867083829-if02:
     not there
     -> plug the board in at its ST-LINK's USB socket, or name its port with
        --sensor or --display
",
        protocol::SCHEMA_HASH
    );
    assert_eq!(report::write(&bench, &findings, Style::Plain), expected);
    let coloured = report::write(&bench, &findings, Style::Terminal);
    assert!(
        coloured.contains("\x1b[1;31m1 finding\x1b[0m"),
        "{coloured}"
    );
}

#[test]
fn a_bench_that_is_well_is_told_so() {
    let report = report::write(&bench(), &[], Style::Plain);
    assert!(report.ends_with("\n\nall well\n"), "{report}");
    assert!(report.contains("  supervisor   ready\n"), "{report}");
}

#[test]
fn the_report_for_scripts_keeps_its_shape() {
    let mut bench = bench();
    bench.boards[1].state = State::Busy {
        port: "/dev/ttyACM1".into(),
    };
    let findings = findings::of(&bench);
    let document: Value =
        serde_json::from_str(&json::write(&bench, &findings)).expect("well-formed");
    let keys = |value: &Value| -> Vec<String> {
        value
            .as_object()
            .map(|fields| fields.keys().cloned().collect())
            .unwrap_or_default()
    };
    assert_eq!(
        keys(&document),
        [
            "boards", "findings", "format", "looked_s", "probes", "program", "st_links", "well"
        ]
    );
    assert_eq!(document["format"], 1);
    assert_eq!(document["well"], false);
    assert_eq!(document["probes"][0]["usb"], "0483:374b");
    assert_eq!(document["st_links"][0]["port"], "/dev/tty-sensor");
    let [sensor, display] = [0, 1].map(|at| &document["boards"][at]);
    assert_eq!(
        keys(sensor),
        [
            "clock",
            "counters",
            "elf",
            "gauges",
            "hello",
            "losses",
            "peer_frames",
            "port",
            "rate_hz",
            "reset",
            "restarts",
            "role",
            "state",
            "supervisor",
            "this_end",
            "uptime_s",
            "watchdog_resets"
        ]
    );
    assert_eq!(sensor["state"], "known");
    assert_eq!(sensor["hello"]["version"], "0.1.0");
    assert_eq!(
        sensor["hello"]["schema"],
        format!("{:016x}", protocol::SCHEMA_HASH)
    );
    assert_eq!(sensor["uptime_s"], 92.0);
    assert_eq!(sensor["reset"], "power");
    assert_eq!(sensor["gauges"][4], "good");
    assert_eq!(sensor["supervisor"], Value::Null);
    assert_eq!(sensor["peer_frames"], 1_000);
    assert_eq!(sensor["counters"]["peer"]["received"], 5_000);
    assert_eq!(sensor["counters"]["role"]["adc_overruns"], 0);
    assert_eq!(sensor["clock"]["drift_ppm"], 30.0);
    assert_eq!(sensor["elf"]["error"], Value::Null);
    assert_eq!(display["state"], "busy");
    assert_eq!(display["supervisor"], "ready");
    assert_eq!(display["counters"]["role"]["state"], Value::Null);
    assert_eq!(
        document["findings"],
        serde_json::json!([{
            "board": "display",
            "kind": "busy",
            "what": "/dev/ttyACM1: another program has it",
            "advice": "close the other program: monitor, record, relay, tio and screen all take the port \
                       for themselves",
        }])
    );
}
