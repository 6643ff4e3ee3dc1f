//! The display board's own set-up, tried on a board: its tick, SPI, LDAC's edge, CLR, inputs. See
//! `docs/src/how-to/on-target.md`. On a host this is an empty program.
#![cfg_attr(target_os = "none", no_std, no_main)]
#![cfg_attr(
    target_os = "none",
    allow(unsafe_code, reason = "the entry that defmt-test makes")
)]
#![cfg_attr(
    target_os = "none",
    allow(
        dead_code,
        reason = "the board as the firmware has it, of which a part is tried"
    )
)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
#[path = "../src/board.rs"]
mod board;
#[cfg(target_os = "none")]
#[path = "../src/bus.rs"]
mod bus;
#[cfg(target_os = "none")]
#[path = "../src/chain.rs"]
mod chain;
#[cfg(target_os = "none")]
#[path = "../src/clear.rs"]
mod clear;
#[cfg(target_os = "none")]
#[path = "../../tests/plain-board/src/console.rs"]
mod console;
#[cfg(target_os = "none")]
#[path = "../src/converters.rs"]
mod converters;
#[cfg(target_os = "none")]
#[path = "../src/crash.rs"]
mod crash;
#[cfg(target_os = "none")]
#[path = "../src/inputs.rs"]
mod inputs;
#[cfg(target_os = "none")]
#[path = "../../tests/on-target/jig.rs"]
mod jig;
#[cfg(target_os = "none")]
#[path = "../src/load.rs"]
mod load;
#[cfg(target_os = "none")]
#[path = "../src/ticks.rs"]
mod ticks;

#[cfg(target_os = "none")]
use defmt_rtt as _;

#[cfg(target_os = "none")]
#[defmt_test::tests]
mod tests {
    use defmt::{assert, assert_eq};
    use embassy_futures::block_on;
    use firmware_display::dac81416::CHIPS;
    use firmware_display::{ACTUATORS, ConverterFault, Transfer};
    use protocol::UpdateRate;

    use crate::board::Board;
    use crate::jig::{self, COUNTS_PER_US, CYCLES_PER_US, Edges, cycles, feed, wait_us};
    use crate::load;

    /// Of the instants at which a tick is answered: what interrupts may add. The tick itself goes by hardware.
    const JITTER_CYCLES: u32 = 5 * CYCLES_PER_US;
    /// Of LDAC's edge, in counts of TIM2: a tenth of a microsecond.
    const NEAR_COUNTS: u32 = 8;
    const HOLD_OFF_US: u32 = 2_000;
    const ZERO_VOLT: [u16; ACTUATORS] = [0x8000; ACTUATORS];

    pub struct Bench {
        board: Board,
        started: Result<(), ConverterFault>,
    }

    #[init]
    fn init() -> Bench {
        jig::end_if_failed();
        jig::begin();
        let mut board = Board::take();
        jig::start();
        let started = board.converters.start();
        Bench { board, started }
    }

    #[teardown]
    fn teardown() {
        jig::end();
        // Whoever reads the log has time to.
        wait_us(20_000);
    }

    #[test]
    fn without_converters_the_start_says_which_register_is_wrong(bench: &mut Bench) {
        // The answer to the first read is what is sent meanwhile, if SDO is looped, and ones, if it is open.
        assert!(matches!(
            bench.started,
            Err(ConverterFault::Register { chip: 0, .. })
        ));
    }

    #[test]
    fn the_bus_gets_back_what_it_says(bench: &mut Bench) {
        for chip in 0..CHIPS {
            for frame in [[0xA5, 0x3C, 0x0F], [0x00, 0x00, 0x00], [0xFF, 0x01, 0x80]] {
                let answer = bench.board.converters.exchange(chip, frame);
                defmt::println!("chip {}: said {}, heard {}", chip, frame, answer.ok());
                assert!(answer == Ok(frame));
            }
        }
    }

    #[test]
    fn clr_is_low_until_it_is_held_off_and_falls_two_milliseconds_later(bench: &mut Bench) {
        let converters = &mut bench.board.converters;
        jig::capture(Edges::Pulse);
        wait_us(5_000);
        assert!(converters.is_clear());
        assert!(jig::first(0).is_none());
        for _ in 0..5 {
            jig::forget();
            converters.hold_off(true);
            assert!(!converters.is_clear());
            let Some(rise) = jig::first(100) else {
                defmt::panic!("CLR does not rise on the wire from D6 to D36");
            };
            let Some(fall) = jig::second(HOLD_OFF_US + 100) else {
                defmt::panic!("CLR does not fall");
            };
            let width = fall.wrapping_sub(rise) / COUNTS_PER_US;
            defmt::println!("CLR is high for {} us", width);
            // It counts whole microseconds, of which the first has begun.
            assert!(width.abs_diff(HOLD_OFF_US) <= 2);
            assert!(converters.is_clear());
            feed();
        }
    }

    #[test]
    fn clr_stays_high_for_as_long_as_it_is_held_off(bench: &mut Bench) {
        let converters = &mut bench.board.converters;
        jig::capture(Edges::Pulse);
        converters.hold_off(true);
        for _ in 0..100 {
            wait_us(500);
            converters.hold_off(false);
            assert!(!converters.is_clear());
        }
        assert!(jig::second(0).is_none());
        let begun = cycles();
        assert!(jig::second(HOLD_OFF_US + 100).is_some());
        let us = cycles().wrapping_sub(begun) / CYCLES_PER_US;
        assert!(us.abs_diff(HOLD_OFF_US) <= 5);
    }

    #[test]
    fn clr_that_has_fallen_unseen_stays_low_until_it_was_seen(bench: &mut Bench) {
        let converters = &mut bench.board.converters;
        for late_us in [0, 10, 500] {
            converters.hold_off(true);
            wait_us(HOLD_OFF_US + late_us);
            converters.hold_off(false);
            assert!(converters.is_clear());
            feed();
        }
    }

    #[test]
    fn the_tick_comes_as_often_as_it_is_asked_to(bench: &mut Bench) {
        const TICKS: u32 = 500;
        let ticks = &mut bench.board.ticks;
        ticks.start();
        for rate in [UpdateRate::Hz4000, UpdateRate::Hz2000] {
            ticks.set_rate(rate);
            let period = CYCLES_PER_US * 1_000_000 / rate.hz();
            // The period under way keeps its length.
            for _ in 0..2 {
                block_on(ticks.next());
            }
            let begun = cycles();
            let (mut before, mut shortest, mut longest) = (begun, u32::MAX, 0);
            for _ in 0..TICKS {
                let (_, missed) = block_on(ticks.next());
                let now = cycles();
                assert_eq!(missed, 0);
                let taken = now.wrapping_sub(before);
                before = now;
                shortest = shortest.min(taken);
                longest = longest.max(taken);
                feed();
            }
            let mean = before.wrapping_sub(begun) / TICKS;
            defmt::println!(
                "a tick every {} cycles, from {} to {}",
                mean,
                shortest,
                longest
            );
            assert!(mean.abs_diff(period) <= JITTER_CYCLES / TICKS + 1);
            assert!(longest - shortest <= JITTER_CYCLES);
        }
    }

    #[test]
    fn ldac_falls_at_its_time_behind_the_tick(bench: &mut Bench) {
        let Board {
            ticks, converters, ..
        } = &mut bench.board;
        jig::capture(Edges::LoadAfterTick);
        block_on(ticks.next());
        converters.finish();
        let expected = load::OFFSET_US * COUNTS_PER_US;
        let (mut shortest, mut longest) = (u32::MAX, 0);
        for _ in 0..200 {
            block_on(ticks.next());
            jig::forget();
            converters.update(&ZERO_VOLT, None);
            let Some(edge) = jig::second(300) else {
                defmt::panic!("LDAC does not fall on the wire from D16 to D35");
            };
            // No tick has come since.
            let counts = edge.wrapping_sub(jig::tick());
            shortest = shortest.min(counts);
            longest = longest.max(counts);
            block_on(ticks.next());
            assert!(converters.finish().0 == Transfer::Done);
            feed();
        }
        defmt::println!(
            "LDAC falls {} to {} counts behind the tick, {} by the book",
            shortest,
            longest,
            expected
        );
        assert!(shortest.abs_diff(expected) <= NEAR_COUNTS);
        assert!(longest.abs_diff(expected) <= NEAR_COUNTS);
    }

    #[test]
    fn an_open_emergency_stop_is_a_pressed_one_and_an_open_alarm_is_none(bench: &mut Bench) {
        assert!(bench.board.inputs.stop_is_open());
        assert!(!bench.board.inputs.alarm());
    }
}
