//! Which of the counters, by the table `counters.csv`, and which states of the display's supervisor tell of something
//! wrong, of what, and what to do about it.

use std::sync::LazyLock;

use protocol::{DisplayState, Hold, PortCounters, RoleCounters, Trip};
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

/// What to do about a state; none if there is nothing to be done.
pub const fn supervisor_advice(state: DisplayState) -> Option<&'static str> {
    match state {
        DisplayState::Ready | DisplayState::Driving => None,
        DisplayState::Boot => Some(
            "the converters do not start: see their supply and SPI1 (SCK D13, SDI D11, SDO D12, CS D10 to D7)",
        ),
        DisplayState::Fading(hold) => Some(of_hold(hold)),
        DisplayState::Stopped(trip) => Some(of_trip(trip)),
    }
}

const fn of_hold(hold: Hold) -> &'static str {
    match hold {
        Hold::Stale => {
            "the sensor board has to be on, linked (PD5, PD6 crossed, ground) and on a surface that moves"
        }
        Hold::Distrust => "see the sensor's gauges and what else sends estimates to this board",
        Hold::Flood => {
            "let only one program or board send estimates: see relay, replay and the peer link"
        }
        Hold::Contradiction => {
            "see the hand's encoder (PD12, PD13): the arm moves and the hand does not"
        }
        Hold::Unheard => "reset the board and read its log: its firmware is held up",
        Hold::FullDrive => "rest the hand for a second",
    }
}

const fn of_trip(trip: Trip) -> &'static str {
    match trip {
        Trip::Operator | Trip::Host => "press the display board's reset button when it may go on",
        Trip::EmergencyStop => {
            "release the emergency stop, or see its wire (D4 to ground, normally closed), then press reset"
        }
        Trip::HandEncoder => "see the hand's encoder and its wires (PD12, PD13), then press reset",
        Trip::Converter => {
            "see the converters' supply, heat, ALMOUT (D3) and SPI1 (D7 to D13), then press reset"
        }
        Trip::Transfer => "see SPI1's wires (SCK D13, SDI D11) and LDAC (D16), then press reset",
        Trip::Limit | Trip::Memory | Trip::Panic | Trip::Fault | Trip::StackOverflow => {
            "keep the log (`host-bridge monitor` with its ELF), report it, then press reset"
        }
        Trip::Watchdog => "the firmware hung: keep the log, report it, then press reset",
        Trip::ArmEncoder => {
            "see the arm's encoder and its wires (PD12, PD13), then press the sensor board's reset button"
        }
        Trip::ArmStall => {
            "see what blocks the arm, its drive (supply, PWM D6) and encoder (PD12, PD13), then reset the sensor board"
        }
    }
}

/// What to do about an arm that was stopped.
pub const fn arm_advice(trip: Trip) -> &'static str {
    match trip {
        Trip::ArmEncoder | Trip::ArmStall => of_trip(trip),
        _ => "press the sensor board's reset button when the arm may move again",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_that_keeps_the_stimulus_away_has_advice_of_a_line() {
        let holds = Hold::ALL.map(DisplayState::Fading);
        let trips = Trip::ALL.map(DisplayState::Stopped);
        for state in holds.into_iter().chain(trips).chain([DisplayState::Boot]) {
            let advice = supervisor_advice(state).unwrap_or_else(|| panic!("{state}: no advice"));
            assert!(advice.len() <= 120 && !advice.contains('\n'), "{advice}");
        }
        assert_eq!(supervisor_advice(DisplayState::Ready), None);
        assert_eq!(supervisor_advice(DisplayState::Driving), None);
    }

    #[test]
    fn a_stop_ends_with_the_reset_button() {
        for trip in Trip::ALL {
            assert!(of_trip(trip).contains("reset"), "{}", trip.name());
        }
    }
}
