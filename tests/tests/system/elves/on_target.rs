//! The programs of tests for a board, on an emulated one with their jumper wires.

use std::sync::LazyLock;

use hil_sim_boards::jig::Jumper;
use hil_sim_boards::semihosted::{self, Said};
use tests::elves;

/// Each program and its tests, in their order. A board with a probe runs the same.
const SENSOR: (&str, &[&str]) = (
    "firmware-sensor-on_target",
    &[
        "the_clock_tree_is_what_it_is_set_to",
        "processor_and_timers_agree_on_a_microsecond",
        "a_sample_comes_every_millisecond_of_the_cycle_counter",
        "after_scans_were_lost_a_sample_ends_where_dma_tells_of_it",
        "a_scan_is_in_memory_twelve_microseconds_after_its_trigger",
        "the_encoder_counts_every_edge_both_ways",
        "the_trigger_latches_the_position_that_there_was",
        "the_arms_drive_is_a_pulse_of_its_duty_twenty_thousand_times_a_second",
        "the_serial_port_hears_what_it_says_at_its_speed",
        "most_of_the_stack_was_never_used",
    ],
);
const DISPLAY: (&str, &[&str]) = (
    "firmware-display-on_target",
    &[
        "without_converters_the_start_says_which_register_is_wrong",
        "the_bus_gets_back_what_it_says",
        "clr_is_low_until_it_is_held_off_and_falls_two_milliseconds_later",
        "clr_stays_high_for_as_long_as_it_is_held_off",
        "clr_that_has_fallen_unseen_stays_low_until_it_was_seen",
        "the_tick_comes_as_often_as_it_is_asked_to",
        "ldac_falls_at_its_time_behind_the_tick",
        "an_open_emergency_stop_is_a_pressed_one_and_an_open_alarm_is_none",
    ],
);
const RESTARTS: (&str, &[&str]) = (
    "firmware-display-restarts",
    &[
        "the_watchdog_restarts_a_board_that_does_not_feed_it",
        "a_stack_that_is_full_is_a_fault_that_is_told_of_after_the_restart",
        "a_panic_is_told_of_after_the_restart",
        "a_trip_outlives_a_reset_by_software",
        "the_watchdogs_restarts_are_counted_and_no_others",
    ],
);

fn run(program: &str, jumpers: &[Jumper]) -> Said {
    semihosted::run_with(&elves::on_target(program), "PACKAGE --test TEST", jumpers)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// The tests that the log names, in their order.
fn begun(said: &Said) -> Vec<String> {
    said.log
        .iter()
        .filter_map(|line| line.split_once(") running `")?.1.strip_suffix("`..."))
        .map(str::to_owned)
        .collect()
}

/// What the tests of restarts say.
static RESTARTED: LazyLock<Said> = LazyLock::new(|| run(RESTARTS.0, &Jumper::ALL));

fn every_test_passes(tests: &[&str], said: &Said) {
    assert!(said.is_done, "{said:#?}");
    assert_eq!(begun(said), tests, "{said:#?}");
    let passed = said.log.iter().filter(|line| *line == "all tests passed!");
    assert_eq!(passed.count(), 1, "{said:#?}");
}

#[test]
fn the_sensor_boards_tests_pass_on_the_emulated_board() {
    every_test_passes(SENSOR.1, &run(SENSOR.0, &Jumper::ALL));
}

#[test]
fn the_display_boards_tests_pass_on_the_emulated_board() {
    every_test_passes(DISPLAY.1, &run(DISPLAY.0, &Jumper::ALL));
}

#[test]
fn the_tests_of_restarts_pass_on_the_emulated_board() {
    every_test_passes(RESTARTS.1, &RESTARTED);
}

#[test]
fn below_its_ram_the_emulated_board_does_not_fault_as_a_chip_should() {
    let stack = RESTARTED
        .log
        .iter()
        .find_map(|line| line.split_once("fault, CFSR ")?.1.split_once(", stack 0x"))
        .and_then(|(_, stack)| u32::from_str_radix(stack, 16).ok());
    // If this fails, the emulator is another one: the page on these tests has to say so.
    assert!(
        stack.is_some_and(|stack| stack < 0x1FFF_0000),
        "{:#?}",
        *RESTARTED
    );
}

#[test]
fn a_jumper_that_is_left_out_fails_the_test_that_needs_it() {
    for (jumper, program, test) in [
        (Jumper::EncoderA, SENSOR.0, SENSOR.1[5]),
        (Jumper::EncoderB, SENSOR.0, SENSOR.1[5]),
        (Jumper::Pulse, SENSOR.0, SENSOR.1[7]),
        (Jumper::Serial, SENSOR.0, SENSOR.1[8]),
        (Jumper::Spi, DISPLAY.0, DISPLAY.1[1]),
        (Jumper::Pulse, DISPLAY.0, DISPLAY.1[2]),
        (Jumper::Load, DISPLAY.0, DISPLAY.1[6]),
    ] {
        let others: Vec<Jumper> = Jumper::ALL
            .into_iter()
            .filter(|other| *other != jumper)
            .collect();
        let said = run(program, &others);
        assert!(!said.is_done, "{jumper:?}: {said:#?}");
        let last = begun(&said).pop();
        assert_eq!(last.as_deref(), Some(test), "{jumper:?}: {said:#?}");
    }
}
