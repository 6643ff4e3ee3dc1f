//! The rows themselves, by what breaks.

mod converters;
mod estimates;
mod link;
mod operator;
mod power;
mod processor;
mod sensor;

use std::sync::LazyLock;

use super::{Class, Lasts, Needs, Row};
use crate::scene::fault::Kind;

/// All kinds, in the order in which they are listed.
pub fn rows() -> &'static [Row] {
    static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
        [
            &power::ROWS[..],
            &link::ROWS[..],
            &estimates::ROWS[..],
            &operator::ROWS[..],
            &converters::ROWS[..],
            &processor::ROWS[..],
            &sensor::ROWS[..],
        ]
        .concat()
    });
    &ROWS
}

/// All outputs at 0 V (the display's goal for any fault).
const SOON: Option<f64> = Some(20.0);
/// Until the counters have come: once a second.
const PAST_STATUS_S: f64 = 1.1;
/// Until an estimate is too old (0.5 s), the stimulus has faded, and a fault of 0.7 s has ended.
const PAST_STALE_S: f64 = 0.9;
const STALE_S: f64 = 0.7;

const BASE: Row = Row {
    kind: Kind::Nothing,
    name: "",
    meaning: "",
    injected: "",
    lasts: Lasts::Once,
    keys: &[],
    needs: Needs::Boards,
    safe_within_ms: None,
    is_to_be_seen: true,
    class: Class::Stops,
    resets: 0,
    expected: "",
    watch_s: 0.25,
};
const LINK: Row = Row {
    needs: Needs::Nothing,
    class: Class::Fades,
    lasts: Lasts::For(STALE_S),
    watch_s: PAST_STALE_S,
    ..BASE
};
const DANGEROUS: Row = Row {
    safe_within_ms: SOON,
    ..BASE
};
