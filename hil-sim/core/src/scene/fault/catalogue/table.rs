//! The rows themselves, by what breaks.

mod converters;
mod estimates;
mod link;
mod operator;
mod power;
mod processor;
mod sensor;

use std::sync::LazyLock;

use protocol::{Hold, Role};

use super::{Class, Lasts, Needs, Row, Sign};
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
/// Until the counters have come: once a second, and their way over the line.
const COUNTED_MS: Option<f64> = Some(1_020.0);
const PAST_STATUS_S: f64 = 1.1;
/// Until an estimate is too old (0.5 s), the stimulus has faded, and a fault of 0.7 s has ended.
const STALE_S: f64 = 0.7;
/// The next estimate comes within 10 ms, and is valid unless the hand has just turned.
const AGAIN_MS: Option<f64> = Some(300.0);
const PAST_STALE_S: f64 = 1.05;
/// A watchdog that is no longer fed has bitten.
const WATCHDOG_MS: Option<f64> = Some(520.0);

/// What a line shows that breaks off in mid-frame, goes on in one, or brings another's bytes.
const LINE: [Sign; 16] = [
    Sign::Counted(Role::Display, "corrupt"),
    Sign::Counted(Role::Display, "overlong"),
    Sign::Counted(Role::Display, "late"),
    Sign::Counted(Role::Display, "duplicated"),
    Sign::Counted(Role::Display, "malformed"),
    Sign::Counted(Role::Display, "dropped"),
    Sign::Counted(Role::Display, "overruns"),
    Sign::Counted(Role::Display, "line_errors"),
    Sign::Counted(Role::Sensor, "corrupt"),
    Sign::Counted(Role::Sensor, "overlong"),
    Sign::Counted(Role::Sensor, "late"),
    Sign::Counted(Role::Sensor, "duplicated"),
    Sign::Counted(Role::Sensor, "malformed"),
    Sign::Counted(Role::Sensor, "dropped"),
    Sign::Counted(Role::Sensor, "overruns"),
    Sign::Counted(Role::Sensor, "line_errors"),
];
const FADED: Sign = Sign::Counted(Role::Display, "fades");

const LINE_WITH_GAPS: [Sign; 18] = with(
    &LINE,
    [
        Sign::Counted(Role::Sensor, "lost"),
        Sign::Counted(Role::Display, "lost"),
    ],
);
const FADED_LINE: [Sign; 17] = with(&LINE, [FADED]);
/// What the display and its line show of its restart.
const RESTARTED: [Sign; 20] = with(
    &LINE,
    [
        Sign::Reset(Role::Display),
        Sign::Greets(Role::Display),
        Sign::Counted(Role::Display, "clears"),
        Sign::Fading(Hold::Unheard),
    ],
);
const BOTH_RESTARTED: [Sign; 22] = with(
    &RESTARTED,
    [Sign::Reset(Role::Sensor), Sign::Greets(Role::Sensor)],
);
/// What the sensor and its line show of its own, and the display of what is missing meanwhile.
const SENSOR_RESTARTED: [Sign; 20] = with(
    &LINE,
    [
        Sign::Reset(Role::Sensor),
        Sign::Greets(Role::Sensor),
        Sign::Fading(Hold::Stale),
        FADED,
    ],
);

/// One list behind the other.
const fn with<const N: usize, const M: usize>(line: &[Sign], more: [Sign; M]) -> [Sign; N] {
    let mut all = [FADED; N];
    let mut place = 0;
    while place < N {
        all[place] = if place < line.len() {
            line[place]
        } else {
            more[place - line.len()]
        };
        place += 1;
    }
    all
}

const BASE: Row = Row {
    kind: Kind::Nothing,
    name: "",
    meaning: "",
    injected: "",
    lasts: Lasts::Once,
    keys: &[],
    needs: Needs::Boards,
    class: Class::Stops,
    safe_within_ms: None,
    trips: &[],
    signs: &[],
    seen_within_ms: None,
    also: &[],
    resets: 0,
    again_within_ms: None,
    silences: &[],
    expected: "",
    watch_s: 0.25,
};
const LINK: Row = Row {
    needs: Needs::Nothing,
    class: Class::Fades,
    lasts: Lasts::For(STALE_S),
    signs: &[Sign::Fading(Hold::Stale)],
    also: &FADED_LINE,
    again_within_ms: AGAIN_MS,
    watch_s: PAST_STALE_S,
    ..BASE
};
const DANGEROUS: Row = Row {
    safe_within_ms: SOON,
    seen_within_ms: SOON,
    ..BASE
};
