//! The current through a finger on a cracked or wet film, as `docs/src/explanation/safety.md` shows it.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use firmware_display::limits::MOST_STANDING_V;
use protocol::DisplayConfiguration;

const PAGE: &str = "../docs/src/explanation/safety.md";
const BEGIN: &str = "<!-- computed: firmware-display/tests/display/finger.rs -->\n";
const END: &str = "<!-- end of the current -->\n";

/// The body in IEC 60601-1's measuring device, in Ω; a wet finger.
const BODY_OHM: f64 = 1_000.0;
/// Between the display's ground and earth, in Ω: the bench guide's.
const TO_EARTH_OHM: f64 = 510_000.0;
/// The largest mean of V that a stroke was seen to make, in V: the same page's table of limits.
const STROKE_MEAN_V: f64 = 1.24;
/// A channel's largest voltage, in V.
const MOST_V: f64 = DisplayConfiguration::DEFAULT.amplitude_mv as f64 / 1e3;

/// Where a current comes from, and what it may be.
struct Case {
    name: &'static str,
    volts: f64,
    limit_ua: f64,
    to_earth: bool,
}

fn cases() -> [Case; 7] {
    let case = |name, volts, limit_ua, to_earth| Case {
        name,
        volts,
        limit_ua,
        to_earth,
    };
    let root = 2_f64.sqrt();
    let limit_v = f64::from(MOST_STANDING_V);
    [
        case(
            "d.c., normal: the worst stroke, to earth",
            STROKE_MEAN_V,
            10.0,
            true,
        ),
        case(
            "d.c., normal: what `limits.rs` lets pass, to earth",
            limit_v,
            10.0,
            true,
        ),
        case(
            "a.c., normal: a full sine, to earth",
            MOST_V / root,
            100.0,
            true,
        ),
        case(
            "a.c., normal: two channels in opposite phase",
            2.0 * MOST_V / root,
            100.0,
            false,
        ),
        case(
            "d.c., single fault: a channel that stands at its end, to earth",
            MOST_V,
            50.0,
            true,
        ),
        case(
            "d.c., single fault: two channels at both ends",
            2.0 * MOST_V,
            50.0,
            false,
        ),
        case(
            "a.c., single fault: two channels in opposite phase",
            2.0 * MOST_V / root,
            500.0,
            false,
        ),
    ]
}

fn table() -> String {
    let mut table =
        "| current through 1 kΩ | V | mA | limit, µA | times too much | kΩ that would do |\n\
                     | --- | ---: | ---: | ---: | ---: | ---: |\n"
            .to_owned();
    for case in cases() {
        let milliamperes = case.volts / BODY_OHM * 1e3;
        let times = milliamperes * 1e3 / case.limit_ua;
        let kilohms = case.volts / case.limit_ua * 1e3 - BODY_OHM / 1e3;
        let (name, volts, limit) = (case.name, case.volts, case.limit_ua);
        let _ = writeln!(
            table,
            "| {name} | {volts:.2} | {milliamperes:.2} | {limit} | {times:.0} | {kilohms:.0} |"
        );
    }
    table
}

#[test]
fn the_page_shows_the_current_through_a_finger_as_it_is_computed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let page = fs::read_to_string(path).expect("the page is there");
    let (_, rest) = page.split_once(BEGIN).expect("the table begins");
    let (shown, _) = rest.split_once(END).expect("the table ends");
    let table = table();
    assert_eq!(shown, table, "the table is to be:\n{table}");
}

#[test]
fn the_resistor_to_earth_keeps_every_current_to_earth_within_its_limit_and_within_the_normal_one_after_a_fault()
 {
    for case in cases().iter().filter(|case| case.to_earth) {
        let current_ua = case.volts / (BODY_OHM + TO_EARTH_OHM) * 1e6;
        assert!(
            current_ua <= case.limit_ua.min(10.0),
            "{}: {current_ua}",
            case.name
        );
    }
}
