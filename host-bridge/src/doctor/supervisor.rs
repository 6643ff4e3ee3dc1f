//! What to do when the display's supervisor keeps the stimulus at 0 V.

use protocol::{DisplayState, Hold, Trip};

/// What to do about a state; none if there is nothing to be done.
pub const fn advice(state: DisplayState) -> Option<&'static str> {
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
            let advice = advice(state).unwrap_or_else(|| panic!("{state}: no advice"));
            assert!(advice.len() <= 120 && !advice.contains('\n'), "{advice}");
        }
        assert_eq!(advice(DisplayState::Ready), None);
        assert_eq!(advice(DisplayState::Driving), None);
    }

    #[test]
    fn a_stop_ends_with_the_reset_button() {
        for trip in Trip::ALL {
            assert!(of_trip(trip).contains("reset"), "{}", trip.name());
        }
    }
}
