//! What the display board's console says to a person, a line a second.

use protocol::line::{HELP as HEAD, age, counters, put, velocity, wavelength};
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
    "keys:   ? this help     ! stop the stimulus until the reset button or power",
];

/// The answer to a key that asks for a stop.
pub const STOPPING: &str = "stopping: 0 V until the reset button or power";

/// The display in a line.
pub fn line(latest: &Latest, status: &Status) -> Line {
    let mut line = Line::new();
    wavelength(&mut line, latest);
    velocity(
        &mut line,
        latest.motion().map(|motion| motion.velocity_um_s),
    );
    age(&mut line, latest.estimate_age_ms(status.uptime_us));
    if let RoleCounters::Display(display) = &status.role {
        counters(&mut line, &status.peer, display.deadline_misses);
        put(&mut line, format_args!("  {}", display.state));
    }
    line
}
