//! What the sensor board's console says to a person, a line a second.

use protocol::line::{HELP as HEAD, age, counters, put, velocity, wavelength};
use protocol::{GaugeHealth, Latest, Line, RoleCounters, Status};

/// What the columns of [`line`] mean, and the keys.
pub const HELP: [&str; 11] = [
    HEAD[0],
    HEAD[1],
    HEAD[2],
    "lambda  wavelength of the surface, and whether the estimator stands by it",
    "v       velocity of the arm, positive towards larger x",
    "age     time since the last motion of the display board",
    "lost    frames of the display board that never came",
    "bad     frames of it that were corrupt, or of another version",
    "miss    samples that were not done in time",
    "gauges  ok, or what is wrong with which of the gauges 0 to 4",
    "keys:   ? this help     (! stops the stimulus on the display board's console only)",
];

/// The answer to a key that asks for a stop: the sensor board has nothing to stop.
pub const NOT_STOPPING: &str =
    "NOT stopped: type ! on the display board's console, or open its emergency stop";

/// The sensor in a line.
pub fn line(latest: &Latest, status: &Status) -> Line {
    let mut line = Line::new();
    wavelength(&mut line, latest);
    let estimate = latest.estimate();
    velocity(&mut line, estimate.map(|estimate| estimate.velocity_um_s));
    age(&mut line, latest.motion_age_ms(status.uptime_us));
    if let RoleCounters::Sensor(sensor) = &status.role {
        counters(&mut line, &status.peer, sensor.deadline_misses);
    }
    if let Some(estimate) = estimate {
        gauges(&mut line, &estimate.health);
    }
    line
}

/// What is wrong with which gauge.
fn gauges(line: &mut Line, health: &[GaugeHealth]) {
    put(line, format_args!("  gauges"));
    let mut before = "";
    for (gauge, health) in health.iter().enumerate() {
        if *health != GaugeHealth::Good {
            put(line, format_args!("{before} {gauge} {}", health.name()));
            before = ",";
        }
    }
    if before.is_empty() {
        put(line, format_args!(" ok"));
    }
}
