//! Which of the counters tell of something wrong, of what, and what to do about it: the table `counters.csv`.

use std::sync::LazyLock;

use protocol::{PortCounters, RoleCounters};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// A counter of something that should not happen.
#[derive(Debug, Deserialize)]
struct Fault {
    place: Place,
    name: String,
    /// Whether it tells of something wrong even if it grows no more.
    at_rest: bool,
    what: String,
    advice: String,
}

/// Whose counter it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Place {
    /// A port towards the other board.
    Peer,
    /// A console, or this computer's end of it.
    Console,
    Sensor,
    Display,
}

static FAULTS: LazyLock<Vec<Fault>> = LazyLock::new(|| {
    let mut rows = csv::Reader::from_reader(include_bytes!("counters.csv").as_slice());
    let faults = rows.deserialize().collect::<Result<_, _>>();
    faults.expect("a table that the tests have read")
});

/// A count that tells of something wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// The counter's name on the wire.
    pub name: &'static str,
    /// What was counted: follows the count.
    pub what: &'static str,
    /// What to do about it.
    pub advice: &'static str,
    /// How many.
    pub count: u32,
    /// How many of them while it was looked at; none if there was only one look.
    pub grown: Option<u32>,
}

/// The counts of `place` that tell of something wrong, from a first and a last look at all its counters.
fn all(place: Place, first: &impl Serialize, last: Option<&impl Serialize>) -> Vec<Count> {
    let (first, last) = (json!(first), last.map(|last| json!(last)));
    let read = |counters: &Value, fault: &Fault| counters[&fault.name].as_u64().unwrap_or(0) as u32;
    let count = |fault: &'static Fault| {
        let began = read(&first, fault);
        let count = last.as_ref().map_or(began, |last| read(last, fault));
        let grown = last.as_ref().map(|_| count.wrapping_sub(began));
        let matters = if fault.at_rest {
            count > 0
        } else {
            grown.is_some_and(|grown| grown > 0)
        };
        matters.then_some(Count {
            name: &fault.name,
            what: &fault.what,
            advice: &fault.advice,
            count,
            grown,
        })
    };
    let faults = FAULTS.iter().filter(|fault| fault.place == place);
    faults.filter_map(count).collect()
}

/// What a board's port towards the other board tells, from its counters at a first and at a last look.
pub fn of_peer(first: &PortCounters, last: Option<&PortCounters>) -> Vec<Count> {
    all(Place::Peer, first, last)
}

/// What a console tells.
pub fn of_console(first: &PortCounters, last: Option<&PortCounters>) -> Vec<Count> {
    all(Place::Console, first, last)
}

/// What this computer's end of a console tells, since the line was opened.
pub fn of_this_end(counters: &PortCounters) -> Vec<Count> {
    // The board may be in mid-frame when the line is opened, and some frames are on their way before its
    // Hello.
    let since_opened = PortCounters {
        corrupt: if counters.corrupt > 1 {
            counters.corrupt
        } else {
            0
        },
        unheralded: 0,
        ..*counters
    };
    all(Place::Console, &PortCounters::new(), Some(&since_opened))
}

/// What the counters of a role tell; nothing if the role changed in between.
pub fn of_role(first: &RoleCounters, last: Option<&RoleCounters>) -> Vec<Count> {
    use RoleCounters::{Display, Sensor};
    match (first, last) {
        (Sensor(first), None) => all(Place::Sensor, first, None::<&()>),
        (Sensor(first), Some(Sensor(last))) => all(Place::Sensor, first, Some(last)),
        (Display(first), None) => all(Place::Display, first, None::<&()>),
        (Display(first), Some(Display(last))) => all(Place::Display, first, Some(last)),
        _ => Vec::new(),
    }
}
