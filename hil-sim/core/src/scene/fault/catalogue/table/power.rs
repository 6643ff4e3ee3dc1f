//! What is tried beside the faults themselves.

use protocol::Role;

use super::{BASE, BOTH_RESTARTED, DANGEROUS, PAST_STATUS_S};
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Class, Key, Lasts, Needs, Row, Sign};

pub(super) static ROWS: [Row; 2] = [
    Row {
        kind: Kind::Nothing,
        name: "nothing",
        meaning: "nothing breaks: a campaign's control",
        injected: "nothing",
        needs: Needs::Nothing,
        class: Class::Holds,
        expected: "no sign of a fault, no change of the supervisor's state",
        watch_s: PAST_STATUS_S,
        ..BASE
    },
    Row {
        kind: Kind::PowerCycle,
        name: "power-cycle",
        meaning: "both boards and the converters lose their power, and get it back",
        injected: "both cores held, every peripheral at its power-on value, all RAM overwritten with \
                   random words, the DACs reset, CLR pulled low; after for_s they start",
        lasts: Lasts::For(0.005),
        keys: &[Key {
            name: "sensor",
            meaning: "1 if the sensor board loses its power too, 0 if not",
            default: 1.0,
            low: 0.0,
            high: 1.0,
            whole: true,
            drawn: None,
        }],
        class: Class::Fades,
        resets: 1,
        signs: &[
            Sign::ClearFell,
            Sign::Greets(Role::Display),
            Sign::Reset(Role::Display),
        ],
        also: &BOTH_RESTARTED,
        again_within_ms: Some(1_200.0),
        silences: &[Role::Display, Role::Sensor],
        expected: "0 V at once; the boards start, and drive when there is a fresh estimate",
        watch_s: 1.3,
        ..DANGEROUS
    },
];
