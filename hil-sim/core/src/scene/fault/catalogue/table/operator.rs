//! The operator's hand, and what hosts ask for.

use protocol::{Hold, Role, Trip};

use super::{AGAIN_MS, BASE, COUNTED_MS, DANGEROUS, FADED, PAST_STATUS_S};
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Class, Key, Lasts, Needs, Row, Sign};

/// The same, for a stop that somebody asks for.
const AT_ONCE: Option<f64> = Some(5.0);

pub(super) static ROWS: [Row; 7] = [
    Row {
        kind: Kind::HandEncoderDead,
        name: "hand-encoder-dead",
        meaning: "the hand's encoder stands still while the hand moves",
        injected: "TIM4's counter stays at its last value",
        lasts: Lasts::For(3.5),
        needs: Needs::Nothing,
        class: Class::Fades,
        signs: &[Sign::Fading(Hold::Contradiction)],
        seen_within_ms: Some(3_500.0),
        also: &[FADED],
        again_within_ms: AGAIN_MS,
        expected: "0 V within 19 ms, as for a hand at rest, which it can't be told from; called a \
                   contradiction if the arm is said to move for 3 s; drives again when it counts",
        watch_s: 3.9,
        ..DANGEROUS
    },
    Row {
        kind: Kind::HandEncoderJump,
        name: "hand-encoder-jump",
        meaning: "the hand's encoder jumps further than a hand moves",
        injected: "so many counts more in TIM4's counter from one tick on",
        keys: &[Key {
            name: "counts",
            meaning: "the jump in counts of 5 µm, 1 to 30 000",
            default: 2_000.0,
            low: 1.0,
            high: 30_000.0,
            whole: true,
            drawn: Some((500.0, 30_000.0)),
        }],
        needs: Needs::Nothing,
        trips: &[Trip::HandEncoder],
        signs: &[Sign::Stopped(Trip::HandEncoder), Sign::ClearFell],
        also: &[
            Sign::Counted(Role::Display, "encoder_jumps"),
            Sign::Counted(Role::Display, "clears"),
        ],
        expected: "stopped: hand encoder",
        ..DANGEROUS
    },
    Row {
        kind: Kind::EmergencyStop,
        name: "emergency-stop",
        meaning: "the emergency-stop button is pressed, or its wire breaks",
        injected: "D4 is released to its pull-up",
        lasts: Lasts::For(0.1),
        safe_within_ms: AT_ONCE,
        trips: &[Trip::EmergencyStop],
        signs: &[Sign::Stopped(Trip::EmergencyStop), Sign::ClearFell],
        also: &[Sign::Counted(Role::Display, "clears")],
        seen_within_ms: AT_ONCE,
        expected: "stopped: emergency stop; stays so when the button comes back",
        ..BASE
    },
    Row {
        kind: Kind::StopFromConsole,
        name: "stop-from-console",
        meaning: "a host on the console asks for a stop",
        injected: "Stop on USART3; the time counts from its first bit",
        safe_within_ms: AT_ONCE,
        trips: &[Trip::Operator],
        signs: &[Sign::Stopped(Trip::Operator), Sign::ClearFell],
        also: &[Sign::Counted(Role::Display, "clears")],
        seen_within_ms: AT_ONCE,
        expected: "stopped: operator",
        ..BASE
    },
    Row {
        kind: Kind::StopFromPeer,
        name: "stop-from-peer",
        meaning: "a host on the link asks for a stop",
        injected: "Stop on USART2 between two frames of the sensor, which are numbered anew; the time \
                   counts from at_s",
        needs: Needs::Nothing,
        safe_within_ms: AT_ONCE,
        trips: &[Trip::Host],
        signs: &[Sign::Stopped(Trip::Host), Sign::ClearFell],
        also: &[Sign::Counted(Role::Display, "clears")],
        seen_within_ms: AT_ONCE,
        expected: "stopped: host",
        ..BASE
    },
    Row {
        kind: Kind::WrongConfiguration,
        name: "wrong-configuration",
        meaning: "a host asks for settings that can't be",
        injected: "Configure on USART3 with an amplitude of 60 V, everything else as it is",
        class: Class::Holds,
        signs: &[Sign::Refuses],
        seen_within_ms: Some(20.0),
        expected: "refused with the setting's name and range; nothing changes, it drives on",
        ..BASE
    },
    Row {
        kind: Kind::ConsoleFlood,
        name: "console-flood",
        meaning: "a host on the console talks without a pause",
        injected: "Pings on USART3 at line rate",
        lasts: Lasts::For(0.3),
        class: Class::Holds,
        signs: &[
            Sign::Counted(Role::Display, "received"),
            Sign::Counted(Role::Display, "dropped"),
        ],
        seen_within_ms: COUNTED_MS,
        expected: "drives on; what is not answered is counted",
        watch_s: PAST_STATUS_S,
        ..BASE
    },
];
