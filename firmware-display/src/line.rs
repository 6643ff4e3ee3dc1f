//! What the display board's console says to a person, a line a second.

use protocol::line::{HELP as HEAD, age, counters, make_room, put, velocity, wavelength};
use protocol::{Latest, Line, RoleCounters, Status};

/// What the columns of [`line`] mean, and the keys.
pub const HELP: [&str; 11] = [
    HEAD[0],
    HEAD[1],
    HEAD[2],
    "lambda  wavelength of the surface, and whether the sensor stands by it",
    "v       velocity of the operator's hand, positive towards larger x",
    "age     time since the last estimate of the sensor board",
    "lost    frames of the sensor board that never came",
    "bad     frames of it that were corrupt, or of another version",
    "miss    output ticks that were not served in time",
    "and then what the display does: ready, driving, fading or stopped, and why",
    "keys:   ? this help     ! stop stimulus and arm until the reset button or power",
];

/// The answer to a key that asks for a stop.
pub const STOPPING: &str = "stopping: 0 V until the reset button or power";

/// The display in a line. Where a reason leaves no room for all in a row of a terminal, the counters go first
/// and then the age.
pub fn line(latest: &Latest, status: &Status) -> Line {
    let mut line = Line::new();
    wavelength(&mut line, latest);
    velocity(
        &mut line,
        latest.motion().map(|motion| motion.velocity_um_s),
    );
    let before_age = line.len();
    age(&mut line, latest.estimate_age_ms(status.uptime_us));
    if let RoleCounters::Display(display) = &status.role {
        let before_counters = line.len();
        counters(&mut line, &status.peer, display.deadline_misses);
        if let Some(reason) = display.state.reason() {
            let needed = "  : ".len() + display.state.name().len() + reason.len();
            make_room(&mut line, before_counters, needed);
            make_room(&mut line, before_age, needed);
        }
        put(&mut line, format_args!("  {}", display.state));
    }
    line
}

#[cfg(test)]
mod tests {
    use protocol::{
        Contact, DisplayCounters, DisplayState, Estimate, GAUGES, GaugeHealth, Hold, Message,
        Motion, PortCounters, Range, ResetCause, Trip,
    };

    use protocol::line::WIDTH;

    use super::*;

    fn status(uptime_us: u64, state: DisplayState) -> Status {
        Status {
            uptime_us,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            stack_free_bytes: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: RoleCounters::Display(DisplayCounters {
                state,
                ..DisplayCounters::ZERO
            }),
        }
    }

    fn estimate(wavelength_mm: f32) -> Message {
        Message::Estimate(Estimate {
            sequence: 1,
            instant_us: 77,
            wavelength_mm: Some(wavelength_mm),
            valid: true,
            confidence: 1.0,
            amplitude_lsb: 100.0,
            counted_mm: None,
            range: Range::T1,
            contact: Contact::Slip,
            velocity_um_s: 1,
            lag_um: None,
            gauges_used: 1,
            health: [GaugeHealth::Good; GAUGES],
        })
    }

    fn motion(velocity_um_s: i32) -> Message {
        Message::Motion(Motion {
            sequence: 1,
            instant_us: 2_999_000,
            position_um: 0,
            velocity_um_s,
        })
    }

    #[test]
    fn a_line_is_as_the_readme_shows_it() {
        let mut latest = Latest::new();
        latest.heard(2_992_000, &estimate(2.001));
        latest.said(&motion(-69_960));
        assert_eq!(
            line(&latest, &status(3_000_000, DisplayState::Driving)),
            "lambda 2.001 mm valid  v  -70.0 mm/s  age   8 ms  lost 0 bad 0 miss 0  driving"
        );
    }

    #[test]
    fn a_line_before_anything_came_says_so() {
        let state = DisplayState::Stopped(Trip::EmergencyStop);
        assert_eq!(
            line(&Latest::new(), &status(1_000_000, state)),
            "lambda none            v      - mm/s  age   - ms  stopped: emergency stop"
        );
    }

    #[test]
    fn every_reason_stands_in_a_row_of_a_terminal() {
        let mut latest = Latest::new();
        latest.heard(2_992_000, &estimate(2.001));
        latest.said(&motion(-69_960));
        for state in Hold::ALL
            .map(DisplayState::Fading)
            .into_iter()
            .chain(Trip::ALL.map(DisplayState::Stopped))
        {
            let line = line(&latest, &status(3_000_000, state));
            assert!(line.len() <= WIDTH, "{line}");
            assert!(line.ends_with(state.reason().unwrap_or_default()), "{line}");
        }
        assert_eq!(
            line(
                &latest,
                &status(3_000_000, DisplayState::Fading(Hold::Contradiction))
            ),
            "lambda 2.001 mm valid  v  -70.0 mm/s  fading: the arm moves, the hand does not"
        );
    }

    #[test]
    fn the_longest_line_fits_and_its_words_are_there() {
        let mut latest = Latest::new();
        latest.heard(0, &estimate(f32::MAX));
        latest.said(&motion(i32::MIN));
        let most = u32::MAX;
        for state in Hold::ALL
            .map(DisplayState::Fading)
            .into_iter()
            .chain(Trip::ALL.map(DisplayState::Stopped))
        {
            let mut status = status(u64::MAX, state);
            status.peer.lost = most;
            status.peer.corrupt = most;
            if let RoleCounters::Display(display) = &mut status.role {
                display.deadline_misses = most;
            }
            let line = line(&latest, &status);
            let reason = state.reason().unwrap_or_default();
            assert!(line.ends_with(reason), "{line}");
        }
    }

    #[test]
    fn the_help_fits_on_a_terminal() {
        for line in HELP.into_iter().chain([STOPPING]) {
            assert!(line.len() <= 80, "{line}");
            assert!(
                line.bytes().all(|byte| matches!(byte, b' '..=b'~')),
                "{line}"
            );
        }
    }
}
