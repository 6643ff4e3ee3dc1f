//! Ports and probes that can't be used, and boards that are not there.

use host_bridge::doctor::examination::BoardFacts;
use host_bridge::doctor::permission::Permission;
use host_bridge::link::host_hello;
use host_bridge::state::State;
use protocol::Role;

use super::bench::{hello, one, sensor_spoiled, spoiled};

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
            State::Absent("/dev/ttyACM0".to_owned()),
            "absent",
            "sensor: /dev/ttyACM0: not there",
            "plug the board in at its ST-LINK's USB socket, or name its port with --sensor or --display",
        ),
        (
            State::Absent("relay:bench.sensor".to_owned()),
            "absent",
            "sensor: relay:bench.sensor: not there",
            "start the relay at this site, `host-bridge relay`, with that --name: it shows the other site's board",
        ),
        (
            State::Busy(port()),
            "busy",
            "sensor: /dev/ttyACM0: another program has it",
            "close the other program (tio, screen, or one of another user's)",
        ),
        (
            State::Hung(port(), "host-bridge record (process 4711)".to_owned()),
            "busy",
            "sensor: /dev/ttyACM0: host-bridge record (process 4711) has it and does not answer",
            "let that process go on (`kill -CONT`), or end it (`kill -KILL`): then the port is had without it",
        ),
        (
            State::Failed(port(), "is a folder, not a serial port".to_owned()),
            "failed",
            "sensor: /dev/ttyACM0: is a folder, not a serial port",
            "see whether it is a serial port",
        ),
        (
            State::Opened(port()),
            "opened",
            "sensor: /dev/ttyACM0: has not answered yet",
            "look longer: --for 10",
        ),
        (
            State::Silent(port()),
            "silent",
            "sensor: /dev/ttyACM0: silent",
            "see whether the board has power and firmware (`host-bridge flash`), and whether the port is its console",
        ),
        (
            State::Deaf(port()),
            "deaf",
            "sensor: /dev/ttyACM0: speaks and does not answer",
            "nothing that is sent reaches the board: see its RX line (PD9)",
        ),
        (
            State::Garbage(port()),
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
        (
            State::Stranger {
                port: port(),
                hello: host_hello(),
                wanted: Role::Sensor,
            },
            "wrong-role",
            "sensor: /dev/ttyACM0: sends back what this program says",
            "see whether its TX is joined to its RX, or whether a computer is at its far end",
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
            board.state = State::Denied("/dev/ttyACM0".into());
            board.permission = Some(Permission {
                group: "uucp".to_owned(),
                mode: 0o660,
                is_member: false,
                is_listed: false,
                pseudo_terminal_of: None,
            });
        }),
        "denied",
        "sensor: /dev/ttyACM0: no permission to open it (group uucp, mode 0660)",
        "join the group that owns it: `sudo usermod -aG uucp $USER`, then log in again",
    );
}

#[test]
fn a_board_that_is_not_there_is_asked_for_nothing_else() {
    let found = sensor_spoiled(|board| {
        *board = BoardFacts::new(Role::Sensor, State::Absent("/dev/ttyACM0".to_owned()));
    });
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].kind, "absent");
}
