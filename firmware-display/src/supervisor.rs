//! Whether the actuators may be driven: five states, six kinds of events, and nothing else.
//!
//! ```text
//!            Started           Fresh            Hold
//!     Boot ──────────> Ready ─────────> Driving ────> Fading(Hold)
//!                       ^ ^                │ Cleared      │ Silent, Cleared
//!                       │ └────────────────┘              │
//!                       └─────────────────────────────────┘
//!
//!     any ── Trip ──> Stopped(Trip), for good
//! ```

use protocol::{DisplayState, Hold, Trip};

use crate::fade::Aim;

/// What the supervisor is told, in this order in each tick: Started, Cleared, Trip, Hold or Fresh (which does not
/// come with Cleared), Silent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The converters were started and hold what they were given.
    Started,
    /// CLR fell by itself: the outputs are at 0 V.
    Cleared,
    /// Something that no link and no hand can make good.
    Trip(Trip),
    /// A reason not to drive, for as long as it is told.
    Hold(Hold),
    /// No reason not to drive, and a fresh estimate to be trusted.
    Fresh,
    /// The stimulus has come to 0 V.
    Silent,
}

/// The state after `event`. [`DisplayState::Stopped`] has no way out, and no event but
/// [`Event::Fresh`], in [`DisplayState::Ready`], leads to [`DisplayState::Driving`].
pub const fn next(state: DisplayState, event: Event) -> DisplayState {
    use DisplayState::{Boot, Driving, Fading, Ready, Stopped};
    match (state, event) {
        (Stopped(_), _) => state,
        (_, Event::Trip(trip)) => Stopped(trip),
        (Boot, Event::Started) => Ready,
        (Ready, Event::Fresh) => Driving,
        // A stale λ may fade out slowly; whatever else comes up meanwhile may not.
        (Driving | Fading(Hold::Stale), Event::Hold(hold)) => Fading(hold),
        (Driving | Fading(_), Event::Cleared) | (Fading(_), Event::Silent) => Ready,
        _ => state,
    }
}

/// Where the stimulus' gain is to go in a state.
pub const fn aim(state: DisplayState) -> Aim {
    match state {
        DisplayState::Boot | DisplayState::Ready | DisplayState::Stopped(_) => Aim::Off,
        DisplayState::Driving => Aim::In,
        DisplayState::Fading(Hold::Stale) => Aim::Out,
        DisplayState::Fading(_) => Aim::Quickly,
    }
}

/// Whether CLR may be held off in a state. Where it may not, the outputs are at 0 V whatever the
/// converters hold.
pub const fn releases(state: DisplayState) -> bool {
    !matches!(state, DisplayState::Boot | DisplayState::Stopped(_))
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use DisplayState::{Boot, Driving, Fading, Ready, Stopped};

    use super::*;

    fn states() -> Vec<DisplayState> {
        let mut states = std::vec![Boot, Ready, Driving];
        states.extend(Hold::ALL.map(Fading));
        states.extend(Trip::ALL.map(Stopped));
        states
    }

    fn events() -> Vec<Event> {
        let mut events = std::vec![Event::Started, Event::Cleared, Event::Fresh, Event::Silent];
        events.extend(Hold::ALL.map(Event::Hold));
        events.extend(Trip::ALL.map(Event::Trip));
        events
    }

    /// Each row a state; each column an event: Started, Cleared, Trip, Hold, Fresh, Silent. `.` is the
    /// same state, `h` Fading with the event's hold, `t` Stopped with the event's trip.
    const TABLE: [(&str, &str); 6] = [
        ("boot            ", "R . t . . ."),
        ("ready           ", ". . t . D ."),
        ("driving         ", ". R t h . ."),
        ("fading, stale   ", ". R t h . R"),
        ("fading otherwise", ". R t . . R"),
        ("stopped         ", ". . . . . ."),
    ];

    fn by_the_table(state: DisplayState, event: Event) -> DisplayState {
        let row = match state {
            Boot => 0,
            Ready => 1,
            Driving => 2,
            Fading(Hold::Stale) => 3,
            Fading(_) => 4,
            Stopped(_) => 5,
        };
        let column = match event {
            Event::Started => 0,
            Event::Cleared => 1,
            Event::Trip(_) => 2,
            Event::Hold(_) => 3,
            Event::Fresh => 4,
            Event::Silent => 5,
        };
        match (TABLE[row].1.split(' ').nth(column).unwrap(), event) {
            (".", _) => state,
            ("R", _) => Ready,
            ("D", _) => Driving,
            ("h", Event::Hold(hold)) => Fading(hold),
            ("t", Event::Trip(trip)) => Stopped(trip),
            (entry, _) => panic!("{entry} at {state:?}, {event:?}"),
        }
    }

    #[test]
    fn every_state_answers_every_event_as_the_table_says() {
        let mut answers = 0;
        for state in states() {
            for event in events() {
                let expected = by_the_table(state, event);
                assert_eq!(next(state, event), expected, "{state:?}, {event:?}");
                answers += 1;
            }
        }
        assert_eq!(answers, (3 + 6 + 14) * (4 + 6 + 14));
    }

    /// SplitMix64 (Steele et al. 2014).
    struct Dice(u64);

    impl Dice {
        fn roll(&mut self, sides: usize) -> usize {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) % sides as u64) as usize
        }
    }

    #[test]
    fn hundreds_of_thousands_of_random_events_break_no_promise() {
        let events = events();
        let mut dice = Dice(4);
        let (mut drives, mut fades) = (0, 0);
        // 4 000 lives of 100 events; trips are rare enough for other things to happen before.
        for _ in 0..4_000 {
            let mut state = Boot;
            let mut first_trip = None;
            for _ in 0..100 {
                let event = match events[dice.roll(events.len())] {
                    Event::Trip(_) if dice.roll(20) > 0 => Event::Fresh,
                    event => event,
                };
                let after = next(state, event);
                if let Event::Trip(trip) = event {
                    first_trip = first_trip.or(Some(trip));
                }
                // The first trip is the one that is told, for good, and nothing else stops.
                assert_eq!(first_trip.map(Stopped), Some(after).filter(is_stopped));
                // Driving begins with a fresh estimate alone, and only out of 0 V.
                if after == Driving && state != Driving {
                    assert_eq!((state, event), (Ready, Event::Fresh));
                    drives += 1;
                }
                // A hold ends it at once.
                if matches!(event, Event::Hold(_)) {
                    assert_ne!(after, Driving);
                }
                // Fading ends in 0 V alone.
                if matches!(state, Fading(_)) && !matches!(after, Fading(_) | Stopped(_)) {
                    assert_eq!(after, Ready);
                    assert!(matches!(event, Event::Silent | Event::Cleared));
                    fades += 1;
                }
                // The gain is off, or on its way there, whenever the state is not Driving.
                assert_eq!(aim(after) == Aim::In, after == Driving);
                assert!(releases(after) || aim(after) == Aim::Off);
                state = after;
            }
        }
        assert!(drives > 5_000 && fades > 3_000, "{drives} {fades}");
    }

    fn is_stopped(state: &DisplayState) -> bool {
        matches!(state, Stopped(_))
    }
}
