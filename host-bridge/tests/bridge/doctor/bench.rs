//! A bench as the doctor finds it, well or spoiled.

use host_bridge::doctor::examination::BoardFacts;
use host_bridge::doctor::examination::ClockFacts;
use host_bridge::doctor::examination::Drift;
use host_bridge::doctor::examination::ElfFacts;
use host_bridge::doctor::examination::Examination;
use host_bridge::doctor::examination::ProbeFacts;
use host_bridge::doctor::findings;
use host_bridge::doctor::findings::Finding;
use host_bridge::place::StLink;
use host_bridge::state::State;
use protocol::{
    DisplayCounters, DisplayState, GaugeHealth, Hello, PortCounters, ResetCause, Role,
    RoleCounters, SensorCounters, Status,
};

pub fn hello(role: Role) -> Hello {
    Hello::new(role, "stm32f429zi", [0, 1, 0])
}

pub fn status(role: Role, uptime_us: u64, frames: u32) -> Status {
    let port = PortCounters {
        sent: frames,
        received: frames,
        ..PortCounters::new()
    };
    Status {
        uptime_us,
        reset: ResetCause::Power,
        watchdog_resets: 0,
        stack_free_bytes: 80_000,
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
pub fn board(role: Role) -> BoardFacts {
    let known = State::Known(format!("/dev/tty-{}", role.name()).into(), hello(role));
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
pub fn bench() -> Examination {
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
pub fn spoiled(spoil: impl FnOnce(&mut Examination)) -> Vec<Finding> {
    let mut bench = bench();
    spoil(&mut bench);
    findings::of(&bench)
}

pub fn sensor_spoiled(spoil: impl FnOnce(&mut BoardFacts)) -> Vec<Finding> {
    spoiled(|bench| spoil(&mut bench.boards[0]))
}

pub fn display_spoiled(spoil: impl FnOnce(&mut BoardFacts)) -> Vec<Finding> {
    spoiled(|bench| spoil(&mut bench.boards[1]))
}

/// Asserts that there is one finding: kind, what with its board, advice.
#[track_caller]
pub fn one(found: &[Finding], kind: &str, what: &str, advice: &str) {
    let said: Vec<(&str, String, &str)> = found
        .iter()
        .map(|finding| (finding.kind, finding.to_string(), finding.advice.as_str()))
        .collect();
    assert_eq!(said, [(kind, what.to_owned(), advice)]);
}

pub fn sensor_counters(board: &mut BoardFacts, set: impl Fn(&mut SensorCounters)) {
    for status in [&mut board.first, &mut board.last].into_iter().flatten() {
        if let RoleCounters::Sensor(counters) = &mut status.role {
            set(counters);
        }
    }
}

pub fn display_counters(board: &mut BoardFacts, set: impl Fn(&mut DisplayCounters)) {
    for status in [&mut board.first, &mut board.last].into_iter().flatten() {
        if let RoleCounters::Display(counters) = &mut status.role {
            set(counters);
        }
    }
}

pub fn peer(board: &mut BoardFacts, set: impl Fn(&mut PortCounters)) {
    for status in [&mut board.first, &mut board.last].into_iter().flatten() {
        set(&mut status.peer);
    }
}
