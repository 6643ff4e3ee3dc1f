//! What the consoles' lines of both boards have in common: cells of a fixed width as long as the numbers
//! are usual ones, so that the lines stand in columns of a terminal 80 characters wide.
//!
//! Whole numbers only: to print a float takes more flash than the rest of a console.

use core::fmt::Write;

use crate::console::Line;
use crate::hello::Hello;
use crate::latest::Latest;
use crate::status::{PortCounters, Status};

/// How every help text begins.
pub const HELP: [&str; 3] = [
    "Ridgelink says how it is once a second. As soon as a program says Hello, this port",
    "speaks frames only, and text again when the program has been silent for 5 s.",
    "`host-bridge monitor` is such a program and shows far more.",
];

/// The first line after a start.
pub fn banner(hello: &Hello, role: &str, status: &Status) -> Line {
    let mut line = Line::new();
    let [major, minor, patch] = hello.version;
    put(
        &mut line,
        format_args!(
            "ridgelink {role} {major}.{minor}.{patch}, protocol {}, started by {}, watchdog resets {}: ? for help",
            hello.protocol_version(),
            status.reset.name(),
            status.watchdog_resets
        ),
    );
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
        return put(line, format_args!("  v      - mm/s"));
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
        format_args!("  v {:padding$}{sign}{mm_s}.{tenth} mm/s", ""),
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

/// Puts words at the end; what does not fit is cut off.
pub fn put(line: &mut Line, words: core::fmt::Arguments<'_>) {
    let _ = line.write_fmt(words);
}

fn digits(number: u32) -> usize {
    number.checked_ilog10().unwrap_or(0) as usize + 1
}
