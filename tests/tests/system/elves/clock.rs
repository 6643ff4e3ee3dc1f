//! The boards' clock, watched by a program that does nothing else.

use hil_sim_boards::semihosted;
use tests::elves;

/// What the emulator's timers make of an update generation while they stand still at 0: no update, as
/// asked for, but a match of all four channels. The manual leaves that open.
const MATCHES: u32 = 0b1_1110;

fn said() -> [String; 3] {
    let said = semihosted::run(&elves::example("clock"), "firmware-sensor --example clock")
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(said.is_done, "{}", said.console);
    let lines: Vec<String> = said.console.lines().map(str::to_owned).collect();
    lines.try_into().unwrap_or_else(|lines| panic!("{lines:?}"))
}

#[test]
fn the_flash_is_read_ahead_and_cached() {
    // RM0090, 3.9.1: PRFTEN, ICEN and DCEN, and five wait states.
    assert_eq!(said()[2], "flash: 0x0705");
}

#[test]
fn it_begins_at_zero_and_never_steps_back_though_the_driver_s_timer_begins_with_a_match() {
    let [watched, flags, _] = said();
    let began_us: u64 = watched
        .strip_prefix("began at ")
        .and_then(|rest| rest.split_once(" us, stepped back 0 times, "))
        .unwrap_or_else(|| panic!("{watched}"))
        .0
        .parse()
        .unwrap();
    assert!(began_us < 1_000, "{watched}");
    // If this fails, the emulator is another one: see whether `nucleo::clock::start` is still needed here.
    assert_eq!(
        flags,
        format!("an update generation at 0 sets {MATCHES:#06x}")
    );
}
