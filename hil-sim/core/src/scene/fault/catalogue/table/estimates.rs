//! What the sensor says, forged.

use protocol::{Hold, Role};

use super::{BASE, FADED, LINK};
use crate::scene::fault::Kind;
use crate::scene::fault::catalogue::{Class, Key, Lasts, Needs, Row, Sign};

const FORGED: Row = Row {
    needs: Needs::Nothing,
    class: Class::Fades,
    lasts: Lasts::For(0.3),
    signs: &[Sign::Fading(Hold::Distrust)],
    also: &[
        FADED,
        Sign::Counted(Role::Display, "refused_estimates"),
        Sign::Counted(Role::Display, "implausible"),
    ],
    // Half a second without one that can't be true, and the way up.
    again_within_ms: Some(600.0),
    watch_s: 1.0,
    ..BASE
};

pub(super) static ROWS: [Row; 5] = [
    Row {
        kind: Kind::EstimateOutOfRange,
        name: "estimate-out-of-range",
        meaning: "estimates with a λ that no surface has",
        injected: "wavelength_mm in each estimate on the wire, valid, with a right CRC",
        keys: &[Key {
            name: "wavelength_mm",
            meaning: "λ in mm, 0 to 1 000 000",
            default: 1_000.0,
            low: 0.0,
            high: 1e6,
            whole: false,
            drawn: None,
        }],
        expected: "none is followed; fades out after five in half a second; drives again half a second \
                   after the last",
        ..FORGED
    },
    Row {
        kind: Kind::EstimateNan,
        name: "estimate-nan",
        meaning: "estimates that are not numbers",
        injected: "λ, confidence and amplitude of each estimate on the wire are NaN, valid, with a \
                   right CRC",
        expected: "as estimate-out-of-range",
        ..FORGED
    },
    Row {
        kind: Kind::EstimateJumping,
        name: "estimate-jumping",
        meaning: "estimates that jump to and fro",
        injected: "λ of each estimate on the wire times factor and by factor in turn, with a right CRC",
        keys: &[Key {
            name: "factor",
            meaning: "factor, 1.6 to 100",
            default: 3.0,
            low: 1.6,
            high: 100.0,
            whole: false,
            drawn: None,
        }],
        expected: "none is followed, since none is confirmed by the next; as estimate-out-of-range",
        ..FORGED
    },
    Row {
        kind: Kind::EstimateContradictory,
        name: "estimate-contradictory",
        meaning: "estimates that contradict themselves",
        injected: "each estimate on the wire is called valid and has no λ, and no gauge took part, with \
                   a right CRC",
        expected: "as estimate-out-of-range",
        ..FORGED
    },
    Row {
        kind: Kind::SensorSilent,
        name: "sensor-silent",
        meaning: "the sensor says all but estimates",
        injected: "estimates are taken out of what the sensor says, and its frames numbered anew",
        expected: "as link-down",
        ..LINK
    },
];
