//! What the sensor board's console says to a person, a line a second.

use protocol::line::{HELP as HEAD, age, counters, make_room, put, velocity, wavelength};
use protocol::{GAUGES, GaugeHealth, Latest, Line, RoleCounters, Status};

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
    "keys:   ? this help     ! stop arm and stimulus until the reset button or power",
];

/// The answer to a key that asks for a stop.
pub const STOPPING: &str = "stopping: the arm's drive is off until the reset button or power";

/// The sensor in a line. Where gauges in trouble, or an arm that was stopped, leave no room for all in a row of a
/// terminal, the counters go first and then the age.
pub fn line(latest: &Latest, status: &Status) -> Line {
    let mut line = Line::new();
    wavelength(&mut line, latest);
    let estimate = latest.estimate();
    velocity(&mut line, estimate.map(|estimate| estimate.velocity_um_s));
    let before_age = line.len();
    age(&mut line, latest.motion_age_ms(status.uptime_us));
    let before_counters = line.len();
    let mut stopped = None;
    if let RoleCounters::Sensor(sensor) = &status.role {
        counters(&mut line, &status.peer, sensor.deadline_misses);
        stopped = sensor.stopped;
    }
    if let Some(trip) = stopped {
        let before = "  arm stopped: ";
        let needed = before.len() + trip.name().len();
        make_room(&mut line, before_counters, needed);
        make_room(&mut line, before_age, needed);
        put(&mut line, format_args!("{before}{}", trip.name()));
    } else if let Some(estimate) = estimate {
        if estimate.health == [GaugeHealth::Good; GAUGES] {
            put(&mut line, format_args!("  gauges ok"));
        } else {
            let words = trouble(&estimate.health);
            make_room(&mut line, before_counters, words.len());
            make_room(&mut line, before_age, words.len());
            put(&mut line, format_args!("{words}"));
        }
    }
    line
}

/// What is wrong with which gauges: those that have the same, and stand next to each other, are told of at once.
fn trouble(health: &[GaugeHealth; GAUGES]) -> Line {
    let mut line = Line::new();
    put(&mut line, format_args!("  gauges"));
    let mut between = "";
    for (gauge, own) in health.iter().enumerate() {
        if *own == GaugeHealth::Good {
            continue;
        }
        put(&mut line, format_args!("{between} {gauge}"));
        between = "";
        if health.get(gauge + 1) != Some(own) {
            put(&mut line, format_args!(" {}", own.name()));
            between = ",";
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use protocol::{
        Contact, Estimate, Message, Motion, PortCounters, Range, ResetCause, SensorCounters, Trip,
    };

    use protocol::line::WIDTH;

    use super::*;

    fn status(uptime_us: u64) -> Status {
        Status {
            uptime_us,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            stack_free_bytes: 0,
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
    fn an_arm_that_was_stopped_is_told_of_first() {
        for trip in Trip::ALL {
            let mut health = [GaugeHealth::Good; GAUGES];
            health[1] = GaugeHealth::Dead;
            let mut status = status(3_000_000);
            if let RoleCounters::Sensor(sensor) = &mut status.role {
                sensor.stopped = Some(trip);
            }
            let line = line(&latest(2.001, 70_000, health), &status);
            assert!(line.len() <= WIDTH, "{line}");
            assert!(line.ends_with(trip.name()), "{line}");
            assert!(line.contains("  arm stopped: "), "{line}");
        }
    }

    #[test]
    fn gauges_in_trouble_are_named() {
        let mut health = [GaugeHealth::Good; GAUGES];
        health[1] = GaugeHealth::Dead;
        health[4] = GaugeHealth::Hum;
        let words = |health| line(&latest(2.001, 70_000, health), &status(3_000_000));
        assert_eq!(
            words(health),
            "lambda 2.001 mm valid  v   70.0 mm/s  age   2 ms  gauges 1 dead, 4 hum"
        );
        assert_eq!(
            words([GaugeHealth::Dead; GAUGES]),
            "lambda 2.001 mm valid  v   70.0 mm/s  age   2 ms  gauges 0 1 2 3 4 dead"
        );
        health[2] = GaugeHealth::Saturated;
        assert_eq!(
            words(health),
            "lambda 2.001 mm valid  v   70.0 mm/s  gauges 1 dead, 2 saturated, 4 hum"
        );
        health[0] = GaugeHealth::Dead;
        let most = words(health);
        assert!(most.ends_with("  gauges 0 1 dead, 2 saturated, 4 hum"));
        assert!(most.len() <= WIDTH, "{most}");
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
        for line in HELP.into_iter().chain([STOPPING]) {
            assert!(line.len() <= 80, "{line}");
            assert!(
                line.bytes().all(|byte| matches!(byte, b' '..=b'~')),
                "{line}"
            );
        }
    }
}
