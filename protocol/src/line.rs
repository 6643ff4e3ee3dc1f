//! What the consoles' lines of both boards have in common: cells of a fixed width as long as the numbers
//! are usual ones, so that the lines stand in columns of a terminal 80 characters wide.
//!
//! Whole numbers only: to print a float takes more flash than the rest of a console.

use core::fmt::Write;

use crate::console::Line;
use crate::hello::Hello;
use crate::latest::Latest;
use crate::status::{PortCounters, Status};

/// Characters in a row of a terminal.
pub const WIDTH: usize = 80;

/// How every help text begins.
pub const HELP: [&str; 3] = [
    "One line a second. As soon as a program says Hello, this port speaks frames",
    "only, and text again when the program has been silent for 5 s.",
    "`host-bridge monitor` is such a program and shows far more.",
];

/// The first line after a start: who it is, why it started, and how often the watchdog had to start it.
pub fn banner(hello: &Hello, role: &str, status: &Status) -> Line {
    let mut line = Line::new();
    let [major, minor, patch] = hello.version;
    let protocol = hello.protocol_version();
    put(
        &mut line,
        format_args!("ridgelink {role} {major}.{minor}.{patch}, protocol {protocol}"),
    );
    put(
        &mut line,
        format_args!(", started by {}", status.reset.name()),
    );
    if status.watchdog_resets > 0 {
        put(
            &mut line,
            format_args!(", watchdog {}", status.watchdog_resets),
        );
    }
    put(&mut line, format_args!(": ? for help"));
    line
}

/// λ in mm, and whether the sensor stands by it.
pub fn wavelength(line: &mut Line, latest: &Latest) {
    let found = latest
        .estimate()
        .and_then(|estimate| Some((estimate.wavelength_mm?, estimate.valid)));
    match found {
        Some((wavelength_mm, valid)) => {
            // Saturates where it is beyond what an integer holds.
            let wavelength_um = (wavelength_mm * 1e3 + 0.5) as u32;
            let word = if valid { "valid" } else { "unsure" };
            let (mm, um) = (wavelength_um / 1_000, wavelength_um % 1_000);
            put(line, format_args!("lambda {mm}.{um:03} mm {word:<6}"));
        }
        None => put(line, format_args!("lambda none           ")),
    }
}

/// Velocity v in mm/s, from µm/s.
pub fn velocity(line: &mut Line, velocity_um_s: Option<i32>) {
    let Some(velocity_um_s) = velocity_um_s else {
        return put(line, format_args!(" v      - mm/s"));
    };
    let tenths = (velocity_um_s.unsigned_abs() + 50) / 100;
    let sign = if velocity_um_s < 0 && tenths > 0 {
        "-"
    } else {
        ""
    };
    let (mm_s, tenth) = (tenths / 10, tenths % 10);
    let padding = 4_usize.saturating_sub(sign.len() + digits(mm_s));
    put(
        line,
        format_args!(" v {:padding$}{sign}{mm_s}.{tenth} mm/s", ""),
    );
}

/// Time since the other board was last heard.
pub fn age(line: &mut Line, age_ms: Option<u64>) {
    match age_ms {
        Some(age_ms) => put(line, format_args!("  age {age_ms:>3} ms")),
        None => put(line, format_args!("  age   - ms")),
    }
}

/// What went wrong on the way from the other board, and how often the board was not in time.
pub fn counters(line: &mut Line, peer: &PortCounters, missed: u32) {
    let bad = peer
        .corrupt
        .wrapping_add(peer.overlong)
        .wrapping_add(peer.malformed)
        .wrapping_add(peer.foreign);
    let lost = peer.lost;
    put(line, format_args!("  lost {lost} bad {bad} miss {missed}"));
}

/// Takes back what was put since the line was `before` long, if it leaves less than `needed` of [`WIDTH`].
pub fn make_room(line: &mut Line, before: usize, needed: usize) {
    if line.len() + needed > WIDTH {
        line.truncate(before);
    }
}

/// Puts words at the end; what does not fit is cut off.
pub fn put(line: &mut Line, words: core::fmt::Arguments<'_>) {
    let _ = line.write_fmt(words);
}

fn digits(number: u32) -> usize {
    number.checked_ilog10().unwrap_or(0) as usize + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Contact, Estimate, GAUGES, GaugeHealth, Message, Range, ResetCause, Role, RoleCounters,
        SensorCounters,
    };

    fn latest(wavelength_mm: Option<f32>, valid: bool) -> Latest {
        let mut latest = Latest::new();
        let estimate = Estimate {
            sequence: 1,
            instant_us: 5,
            wavelength_mm,
            valid,
            confidence: 1.0,
            amplitude_lsb: 1.0,
            counted_mm: None,
            range: Range::T1,
            contact: Contact::Slip,
            velocity_um_s: 0,
            lag_um: None,
            gauges_used: 0,
            health: [GaugeHealth::Good; GAUGES],
        };
        latest.said(&Message::Estimate(estimate));
        latest
    }

    #[test]
    fn a_wavelength_has_three_decimals_and_says_whether_it_is_stood_by() {
        for (wavelength_mm, valid, words) in [
            (Some(2.0), true, "lambda 2.000 mm valid "),
            (Some(1.0004), true, "lambda 1.000 mm valid "),
            (Some(1.0006), true, "lambda 1.001 mm valid "),
            (Some(6.05), false, "lambda 6.050 mm unsure"),
            (Some(12.5), false, "lambda 12.500 mm unsure"),
            (Some(1e30), false, "lambda 4294967.295 mm unsure"),
            (None, false, "lambda none           "),
        ] {
            let mut line = Line::new();
            wavelength(&mut line, &latest(wavelength_mm, valid));
            assert_eq!(line, words);
        }
        let mut line = Line::new();
        wavelength(&mut line, &Latest::new());
        assert_eq!(line, "lambda none           ");
    }

    #[test]
    fn a_velocity_is_rounded_to_tenths_and_keeps_its_place() {
        for (velocity_um_s, words) in [
            (Some(0), " v    0.0 mm/s"),
            (Some(49), " v    0.0 mm/s"),
            (Some(-49), " v    0.0 mm/s"),
            (Some(-50), " v   -0.1 mm/s"),
            (Some(70_000), " v   70.0 mm/s"),
            (Some(-70_049), " v  -70.0 mm/s"),
            (Some(1_234_567), " v 1234.6 mm/s"),
            (Some(i32::MIN), " v -2147483.6 mm/s"),
            (None, " v      - mm/s"),
        ] {
            let mut line = Line::new();
            velocity(&mut line, velocity_um_s);
            assert_eq!(line, words);
        }
    }

    #[test]
    fn an_age_is_in_milliseconds() {
        for (age_ms, words) in [
            (Some(0), "  age   0 ms"),
            (Some(10), "  age  10 ms"),
            (Some(4_321), "  age 4321 ms"),
            (None, "  age   - ms"),
        ] {
            let mut line = Line::new();
            age(&mut line, age_ms);
            assert_eq!(line, words);
        }
    }

    #[test]
    fn frames_that_came_to_nothing_are_added_up() {
        let mut line = Line::new();
        let peer = PortCounters {
            received: 9,
            lost: 1,
            corrupt: 2,
            overlong: 10,
            malformed: 100,
            foreign: 1_000,
            late: 5,
            unheralded: 6,
            ..PortCounters::new()
        };
        counters(&mut line, &peer, 7);
        assert_eq!(line, "  lost 1 bad 1112 miss 7");
    }

    #[test]
    fn room_is_made_only_where_it_is_needed() {
        for (needed, left) in [(76, "four"), (77, "fo")] {
            let mut line = Line::new();
            put(&mut line, format_args!("four"));
            make_room(&mut line, 2, needed);
            assert_eq!(line, left);
        }
    }

    #[test]
    fn the_banner_says_who_it_is_and_why_it_started() {
        let status = Status {
            uptime_us: 0,
            reset: ResetCause::Watchdog,
            watchdog_resets: 3,
            stack_free_bytes: 0,
            peer: PortCounters::new(),
            console: PortCounters::new(),
            role: RoleCounters::Sensor(SensorCounters::ZERO),
        };
        let hello = Hello::new(Role::Display, "test", [0, 1, 0]);
        assert_eq!(
            banner(&hello, "display", &status),
            "ridgelink display 0.1.0, protocol 7, started by watchdog, watchdog 3: ? for help"
        );
        let status = Status {
            reset: ResetCause::Pin,
            watchdog_resets: 0,
            ..status
        };
        assert_eq!(
            banner(&hello, "display", &status),
            "ridgelink display 0.1.0, protocol 7, started by reset pin: ? for help"
        );
    }
}
