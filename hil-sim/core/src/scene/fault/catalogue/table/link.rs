//! The link between the boards.

use protocol::{Hold, Role};

use super::{COUNTED_MS, FADED, LINE, LINK, PAST_STATUS_S};
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Class, Key, Lasts, Row, Sign};

pub(super) static ROWS: [Row; 7] = [
    Row {
        kind: Kind::LinkDown,
        name: "link-down",
        meaning: "the link between the boards is cut",
        injected: "no byte arrives, either way",
        expected: "drives on by the last λ for max_age_ms, then fades out; drives again with the link",
        ..LINK
    },
    Row {
        kind: Kind::LinkGarbage,
        name: "link-garbage",
        meaning: "noise on the link in place of what is said",
        injected: "random bytes at line rate in place of every byte, either way",
        signs: &LINE,
        seen_within_ms: COUNTED_MS,
        also: &[Sign::Fading(Hold::Stale), FADED],
        expected: "corrupt and overlong frames counted; as link-down once the last λ is too old",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::LinkCorrupt,
        name: "link-corrupt",
        meaning: "bits on the link are turned",
        injected: "one bit of a share of the bytes, either way",
        lasts: Lasts::For(0.3),
        keys: &[Key {
            name: "share",
            meaning: "share of the bytes, 0 to 1",
            default: 0.05,
            low: 0.0,
            high: 1.0,
            whole: false,
            drawn: None,
        }],
        class: Class::Holds,
        signs: &LINE,
        seen_within_ms: COUNTED_MS,
        also: &[Sign::Fading(Hold::Stale), FADED],
        expected: "corrupt frames counted and none followed; drives on as long as good ones come",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::LinkFlood,
        name: "link-flood",
        meaning: "the sensor, or somebody in its place, talks without a pause",
        injected: "the last estimate again and again, each with the next number and a right CRC, at \
                   line rate, in place of all that the sensor says",
        lasts: Lasts::For(0.3),
        signs: &[Sign::Fading(Hold::Flood)],
        seen_within_ms: Some(110.0),
        also: &[
            FADED,
            Sign::Counted(Role::Display, "corrupt"),
            Sign::Counted(Role::Display, "flooded"),
            Sign::Counted(Role::Display, "refused_estimates"),
        ],
        expected: "fades out within 110 ms, counted; drives again when it is over",
        watch_s: 0.7,
        ..LINK
    },
    Row {
        kind: Kind::LinkReplay,
        name: "link-replay",
        meaning: "old frames come again in place of new ones",
        injected: "in place of each frame one of the back_ms before the fault, again and again, either way",
        keys: &[Key {
            name: "back_ms",
            meaning: "how much is replayed, in ms, 20 to 1000",
            default: 200.0,
            low: 20.0,
            high: 1_000.0,
            whole: false,
            drawn: None,
        }],
        signs: &LINE,
        seen_within_ms: COUNTED_MS,
        also: &[
            Sign::Fading(Hold::Stale),
            FADED,
            Sign::Counted(Role::Display, "refused_estimates"),
        ],
        expected: "late and repeated frames counted and not followed; as link-down once the last λ is \
                   too old",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
    Row {
        kind: Kind::LinkLate,
        name: "link-late",
        meaning: "the network holds frames up",
        injected: "each frame arrives delay_ms later, either way; those sent after the fault are not \
                   held up and overtake",
        keys: &[Key {
            name: "delay_ms",
            meaning: "delay in ms, 1 to 10 000",
            default: 600.0,
            low: 1.0,
            high: 10_000.0,
            whole: false,
            drawn: None,
        }],
        expected: "drives on for max_age_ms, then fades out until frames come; overtaken ones are \
                   counted late and not followed",
        ..LINK
    },
    Row {
        kind: Kind::WireStuckLow,
        name: "wire-stuck-low",
        meaning: "the wire into the display is held low: a break that does not end",
        injected: "zero bytes at line rate, on the boards each with a framing error, in place of all \
                   that the sensor says",
        signs: &LINE,
        seen_within_ms: COUNTED_MS,
        also: &[Sign::Fading(Hold::Stale), FADED],
        expected: "line errors counted; as link-down once the last λ is too old",
        watch_s: PAST_STATUS_S,
        ..LINK
    },
];
