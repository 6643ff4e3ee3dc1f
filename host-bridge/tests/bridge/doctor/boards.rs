//! Boards that are wrong, restarted, silent or ill.

use host_bridge::doctor::examination::BoardFacts;
use host_bridge::doctor::examination::Drift;
use host_bridge::doctor::examination::ElfFacts;
use host_bridge::state::State;
use protocol::{
    DisplayState, GaugeHealth, Hello, Hold, ResetCause, Role, RoleCounters, SensorCounters, Trip,
};

use super::bench::{
    display_counters, display_spoiled, hello, one, peer, sensor_counters, sensor_spoiled, spoiled,
};

#[test]
fn boards_of_another_version_are_named_by_what_differs() {
    let other_schema = Hello {
        schema: 7_u64.to_le_bytes(),
        ..hello(Role::Sensor)
    };
    let foreign = |hello| State::Foreign("/dev/ttyACM0".into(), hello);
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
            "sensor: /dev/ttyACM0: sensor 0.1.0 on stm32f429zi of protocol 7, this program speaks 7 too, \
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
                 display protocol 7 schema {ours}"
            ),
            "sensor: /dev/ttyACM0: sensor 0.1.0 on stm32f429zi of protocol 9, this program speaks 7"
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
            "sensor: runs sensor 0.1.0 on stm32f429zi with protocol 7 schema {ours}, but firmware-sensor \
             is sensor 0.2.0 on stm32f429zi with protocol 7 schema {ours}"
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
    // A relay of both consoles carries what the wires would.
    let relayed = spoiled(|bench| {
        bench.boards.iter_mut().for_each(deaf);
        let last = bench.boards[0].last.as_mut().unwrap();
        last.role = RoleCounters::Sensor(SensorCounters {
            motions: 900,
            ..SensorCounters::ZERO
        });
    });
    assert_eq!(relayed, []);
    // A count that begins again is no relay's doing.
    let restarted = spoiled(|bench| {
        bench.boards.iter_mut().for_each(deaf);
        let first = bench.boards[0].first.as_mut().unwrap();
        first.role = RoleCounters::Sensor(SensorCounters {
            motions: 900,
            ..SensorCounters::ZERO
        });
    });
    one(
        &restarted,
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
fn a_stack_that_was_nearly_full_is_named_and_one_that_nobody_measured_is_not() {
    let room = |bytes| {
        sensor_spoiled(|board| {
            if let Some(status) = &mut board.last {
                status.stack_free_bytes = bytes;
            }
        })
    };
    one(
        &room(2_047),
        "stack",
        "sensor: its stack had no more than 2047 bytes left",
        "report it with its log: a board whose stack is full stops",
    );
    assert_eq!(room(0), []);
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
fn an_arm_that_was_stopped_is_told_of_until_reset() {
    one(
        &sensor_spoiled(|board| {
            sensor_counters(board, |counters| counters.stopped = Some(Trip::Operator));
        }),
        "arm-stopped",
        "sensor: arm stopped: by the operator",
        "press the sensor board's reset button when the arm may move again",
    );
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
