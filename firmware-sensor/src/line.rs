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
    "keys:   ? this help     (! stops, on the display board's console only)",
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

#[cfg(test)]
mod tests {
    use protocol::{
        Contact, Estimate, GAUGES, Message, Motion, PortCounters, Range, ResetCause, SensorCounters,
    };

    use super::*;

    fn status(uptime_us: u64) -> Status {
        Status {
            uptime_us,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: RoleCounters::Sensor(SensorCounters::ZERO),
        }
    }

    fn latest(wavelength_mm: f32, velocity_um_s: i32, health: [GaugeHealth; GAUGES]) -> Latest {
        let mut latest = Latest::new();
        latest.said(&Message::Estimate(Estimate {
            sequence: 1,
            instant_us: 77,
            wavelength_mm: Some(wavelength_mm),
            valid: true,
            confidence: 1.0,
            amplitude_lsb: 100.0,
            counted_mm: None,
            range: Range::T1,
            contact: Contact::Slip,
            velocity_um_s,
            lag_um: None,
            gauges_used: 1,
            health,
        }));
        latest.heard(
            2_998_000,
            &Message::Motion(Motion {
                sequence: 1,
                instant_us: 5,
                position_um: 0,
                velocity_um_s: 1,
            }),
        );
        latest
    }

    #[test]
    fn a_line_is_as_the_readme_shows_it() {
        let latest = latest(2.001, 70_000, [GaugeHealth::Good; GAUGES]);
        assert_eq!(
            line(&latest, &status(3_000_000)),
            "lambda 2.001 mm valid  v   70.0 mm/s  age   2 ms  lost 0 bad 0 miss 0  gauges ok"
        );
    }

    #[test]
    fn gauges_in_trouble_are_named() {
        let mut health = [GaugeHealth::Good; GAUGES];
        health[1] = GaugeHealth::Dead;
        health[4] = GaugeHealth::Hum;
        let line = line(&latest(2.001, 70_000, health), &status(3_000_000));
        assert!(line.ends_with("  gauges 1 dead, 4 hum"), "{line}");
    }

    #[test]
    fn a_line_before_anything_came_says_so() {
        assert_eq!(
            line(&Latest::new(), &status(1_000_000)),
            "lambda none            v      - mm/s  age   - ms  lost 0 bad 0 miss 0"
        );
    }

    #[test]
    fn the_longest_line_fits() {
        let latest = latest(f32::MAX, i32::MIN, [GaugeHealth::Saturated; GAUGES]);
        let mut status = status(u64::MAX);
        status.peer.lost = u32::MAX;
        status.peer.corrupt = u32::MAX;
        status.role = RoleCounters::Sensor(SensorCounters {
            deadline_misses: u32::MAX,
            ..SensorCounters::ZERO
        });
        let line = line(&latest, &status);
        assert!(line.ends_with("4 saturated"), "{line}");
    }

    #[test]
    fn the_help_fits_on_a_terminal() {
        for line in HELP.into_iter().chain([NOT_STOPPING]) {
            assert!(line.len() <= 80, "{line}");
            assert!(
                line.bytes().all(|byte| matches!(byte, b' '..=b'~')),
                "{line}"
            );
        }
    }
}
