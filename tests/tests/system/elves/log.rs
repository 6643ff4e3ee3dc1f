//! What the boards say of themselves: log lines by defmt, counters by Status.

use protocol::{PortCounters, ResetCause, RoleCounters, Status};
use tests::{elves, stack};

use super::PLAIN;
use super::bit_for_bit::RUBBED;

/// Time after the clock's start by which a board has set up its peripherals, in s.
const START_UP_S: f64 = 0.1;
/// Counters in a status are those of the last 50 ms period.
const CARE_S: f64 = 0.05;

fn lines(board: &str) -> Vec<&'static str> {
    let log = PLAIN.recording.log.iter();
    log.filter(|(_, from, _)| *from == board)
        .map(|(_, _, line)| line.as_str())
        .collect()
}

fn sensor() -> Status {
    PLAIN.recording.sensor_status.unwrap()
}

fn display() -> Status {
    PLAIN.recording.display_status.unwrap()
}

/// Whether `count` is what `rate_hz` makes of a board's time, start-up and the status' age allowed for.
fn assert_rate(count: u32, rate_hz: f64, status: &Status) {
    let uptime_s = status.uptime_us as f64 * 1e-6;
    let least = rate_hz * (uptime_s - START_UP_S - CARE_S);
    let most = rate_hz * uptime_s + 1.0;
    assert!(
        (least..=most).contains(&f64::from(count)),
        "{count} is not in {least} to {most}"
    );
}

#[test]
fn both_boards_log_that_they_started_and_why() {
    for (board, status) in [("sensor", sensor()), ("display", display())] {
        let [major, minor, patch] = elves::both().sensor.hello.version;
        let lines = lines(board);
        assert_eq!(
            lines,
            [
                format!("info {board} {major}.{minor}.{patch} started"),
                format!("info reset by {:?}, watchdog resets 0", status.reset),
            ]
        );
    }
    // Within the first tenth of a second, sensor and display.
    let last_ns = PLAIN.recording.log.iter().map(|&(at_ns, ..)| at_ns).max();
    assert!(last_ns.unwrap() as f64 * 1e-9 <= START_UP_S);
}

#[test]
fn nothing_was_reset_cleared_or_garbled() {
    let facts = &PLAIN.facts;
    assert_eq!(
        (facts.resets, facts.clears, facts.dac_frame_errors),
        (0, 0, 0)
    );
    for status in [sensor(), display()] {
        assert_eq!(status.reset, ResetCause::Power);
        assert_eq!(status.watchdog_resets, 0);
    }
}

#[test]
fn both_say_how_much_of_their_stack_was_never_used() {
    // What memory.x leaves it.
    const STACK_BYTES: u32 = 96 << 10;
    let recording = &RUBBED.recording;
    for (status, firmware) in [
        (recording.sensor_status, &elves::both().sensor),
        (recording.display_status, &elves::both().display),
    ] {
        let status = status.unwrap();
        let used = STACK_BYTES.checked_sub(status.stack_free_bytes).unwrap();
        let bound = stack::bound(&firmware.elf).unwrap();
        println!(
            "{used} bytes used, of {} at most: {bound:#?}",
            bound.total_bytes()
        );
        assert_eq!(bound.unknown, [""; 0]);
        assert!(
            (used..STACK_BYTES).contains(&bound.total_bytes()),
            "{bound:#?}"
        );
        // No task runs in a kilobyte; half of it is more than any needs.
        assert!((1_024..STACK_BYTES / 2).contains(&used), "{used} used");
    }
}

#[test]
fn statuses_come_once_a_second() {
    // The last one of 2.2 s is the second; they are looked after every 50 ms.
    for status in [sensor(), display()] {
        let uptime_s = status.uptime_us as f64 * 1e-6;
        assert!(
            (2.0..=2.0 + 2.0 * CARE_S).contains(&uptime_s),
            "{uptime_s} s"
        );
    }
}

#[test]
fn the_sensor_counts_samples_estimates_and_motions_at_their_rates_and_no_fault() {
    let status = sensor();
    let RoleCounters::Sensor(counters) = status.role else {
        panic!("{status:?}");
    };
    assert_rate(counters.samples, 1_000.0, &status);
    assert_rate(counters.estimates, 100.0, &status);
    assert_rate(counters.motions, 500.0, &status);
    assert_eq!(
        (
            counters.adc_overruns,
            counters.dma_overruns,
            counters.deadline_misses
        ),
        (0, 0, 0),
        "{counters:?}"
    );
}

#[test]
fn the_display_counts_ticks_updates_and_estimates_at_their_rates_and_no_fault() {
    let status = display();
    let RoleCounters::Display(counters) = status.role else {
        panic!("{status:?}");
    };
    assert_rate(counters.ticks, 2_000.0, &status);
    assert!(counters.updates <= counters.ticks, "{counters:?}");
    let outputs = PLAIN.recording.outputs.len() as u32;
    assert!(
        (1..=outputs).contains(&counters.updates),
        "{counters:?}, {outputs} outputs"
    );
    let valid = PLAIN
        .recording
        .estimates
        .iter()
        .filter(|r| r.estimate.valid);
    let valid = valid.count() as u32;
    assert!(
        (1..=valid).contains(&counters.estimates),
        "{counters:?}, {valid} valid"
    );
    assert_eq!(
        (
            counters.deadline_misses,
            counters.refused_estimates,
            counters.fades,
            counters.spi_errors
        ),
        (0, 0, 0, 0),
        "{counters:?}"
    );
}

#[test]
fn a_console_without_a_host_hears_nothing_and_says_no_frame() {
    for status in [sensor(), display()] {
        assert_eq!(status.console, PortCounters::default());
    }
}
