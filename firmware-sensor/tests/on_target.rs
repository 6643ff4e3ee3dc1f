//! The sensor board's own set-up, tried on a board: its clocks, the scan's rate, encoder, drive, serial port, stack.
//! See `docs/src/how-to/on-target.md`. On a host this is an empty program.
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
#[path = "../../tests/plain-board/src/console.rs"]
mod console;

#[cfg(target_os = "none")]
#[path = "../../tests/on-target/jig.rs"]
mod jig;

#[cfg(target_os = "none")]
use {defmt_rtt as _, panic_probe as _};

#[cfg(target_os = "none")]
#[defmt_test::tests]
mod tests {
    use defmt::{assert, assert_eq};
    use embassy_futures::block_on;
    use embassy_futures::select::{Either, select};
    use embassy_stm32::pac;
    use embassy_time::Instant;
    use firmware_sensor::{Drive, SAMPLE_RATE_HZ, SCAN_RATE_HZ, SCANS_PER_SAMPLE};
    use nucleo::serial::{BAUD, Serial};
    use nucleo::stack::StackWatch;
    use protocol::CHANNELS;

    use crate::board::{ArmDrive, Board, Sampler};
    use crate::jig::{self, COUNTS_PER_US, CYCLES_PER_US, Edges, cycles, feed, wait_us};

    /// Of the sample's instants, from the shortest to the longest between two: what interrupts and the executor
    /// may add. The scans themselves go by hardware.
    const JITTER_CYCLES: u32 = 5 * CYCLES_PER_US;
    /// A scan of six channels takes 11.4 µs; DMA fetches the last word.
    const SCAN_US: [u32; 2] = [11, 13];
    const STACK_BYTES: u32 = 96 << 10;

    pub struct Bench {
        sampler: Sampler,
        arm: ArmDrive,
        peer: Serial,
    }

    impl Bench {
        /// The encoder's position at the last scan of the next sample; samples that were lost meanwhile are left out.
        fn position(&mut self) -> u16 {
            feed();
            loop {
                if let Ok((_, position)) = block_on(self.sampler.next()) {
                    return position;
                }
            }
        }
    }

    #[init]
    fn init() -> Bench {
        jig::end_if_failed();
        jig::begin();
        let board = Board::take();
        jig::start();
        let Board {
            mut sampler,
            mut arm,
            peer,
            ..
        } = board;
        sampler.start();
        arm.enable();
        Bench { sampler, arm, peer }
    }

    #[teardown]
    fn teardown() {
        jig::end();
        // Whoever reads the log has time to.
        wait_us(20_000);
    }

    #[test]
    fn the_clock_tree_is_what_it_is_set_to() {
        // RM0090, 6.3.1 to 6.3.3: the external clock is ready and bypassed, and the PLL makes 8 MHz / 4 × 168 / 2.
        let control = pac::RCC.cr().read().0;
        assert_eq!(control >> 16 & 0b111, 0b110 | 1);
        let pll = pac::RCC.pllcfgr().read().0;
        assert_eq!(pll & 0x3F, 4);
        assert_eq!(pll >> 6 & 0x1FF, 168);
        assert_eq!(pll >> 16 & 0b11, 0);
        assert_eq!(pll >> 22 & 1, 1);
        // It is the system's clock; AHB not divided, APB1 by 4, APB2 by 2.
        let buses = pac::RCC.cfgr().read().0;
        assert_eq!(buses >> 2 & 0b11, 0b10);
        assert_eq!(buses >> 4 & 0xF, 0);
        assert_eq!(buses >> 10 & 0b111, 0b101);
        assert_eq!(buses >> 13 & 0b111, 0b100);
        // The converters' own prescaler, 13.13.16: 84 MHz / 4, of 36 MHz at most.
        assert_eq!(pac::ADC123_COMMON.ccr().read().0 >> 16 & 0b11, 0b01);
    }

    #[test]
    fn processor_and_timers_agree_on_a_microsecond() {
        for _ in 0..5 {
            let (cycles_before, counts_before, before) =
                (cycles(), pac::TIM2.cnt().read(), Instant::now());
            wait_us(50_000);
            let cycles_taken = cycles().wrapping_sub(cycles_before);
            let counts = pac::TIM2.cnt().read().wrapping_sub(counts_before);
            let us = before.elapsed().as_micros() as u32;
            assert!(cycles_taken.abs_diff(counts * CYCLES_PER_US / COUNTS_PER_US) < 200);
            assert!(us.abs_diff(cycles_taken / CYCLES_PER_US) <= 2);
        }
    }

    #[test]
    fn a_sample_comes_every_millisecond_of_the_cycle_counter(bench: &mut Bench) {
        const SAMPLES: u32 = 500;
        let period = CYCLES_PER_US * 1_000_000 / SAMPLE_RATE_HZ;
        bench.position();
        let begun = cycles();
        let (mut before, mut shortest, mut longest) = (begun, u32::MAX, 0);
        for _ in 0..SAMPLES {
            feed();
            assert!(block_on(bench.sampler.next()).is_ok());
            let now = cycles();
            let taken = now.wrapping_sub(before);
            before = now;
            shortest = shortest.min(taken);
            longest = longest.max(taken);
        }
        let mean = before.wrapping_sub(begun) / SAMPLES;
        defmt::println!(
            "a sample every {} cycles, from {} to {}",
            mean,
            shortest,
            longest
        );
        assert!(mean.abs_diff(period) <= JITTER_CYCLES / SAMPLES + 1);
        assert!(longest - shortest <= JITTER_CYCLES);
    }

    #[test]
    fn after_scans_were_lost_a_sample_ends_where_dma_tells_of_it(bench: &mut Bench) {
        const WORDS: u32 = SCANS_PER_SAMPLE as u32 * CHANNELS as u32;
        // Longer than the ring holds, and by four different parts of a sample.
        for held_us in [3_050, 3_300, 3_550, 3_800] {
            bench.position();
            wait_us(held_us);
            assert!(block_on(bench.sampler.next()).is_err());
            for _ in 0..20 {
                feed();
                assert!(block_on(bench.sampler.next()).is_ok());
                let left = u32::from(pac::DMA2.st(0).ndtr().read().ndt());
                assert_eq!(left % WORDS, 0);
            }
        }
    }

    #[test]
    fn a_scan_is_in_memory_twelve_microseconds_after_its_trigger(bench: &mut Bench) {
        let left = || u32::from(pac::DMA2.st(0).ndtr().read().ndt());
        for _ in 0..20 {
            bench.position();
            let trigger = pac::TIM3;
            let mut last = trigger.cnt().read().cnt();
            loop {
                let now = trigger.cnt().read().cnt();
                if now < last {
                    break;
                }
                last = now;
            }
            // The first channel takes 1.9 µs; the ring's length is a multiple of a scan's.
            let (before, begun) = (left(), cycles());
            let mut remaining = left();
            while remaining == before || remaining % CHANNELS as u32 != 0 {
                assert!(cycles().wrapping_sub(begun) < 100 * CYCLES_PER_US);
                remaining = left();
            }
            let counts = u32::from(trigger.cnt().read().cnt());
            assert!(counts >= SCAN_US[0] * COUNTS_PER_US);
            assert!(counts <= SCAN_US[1] * COUNTS_PER_US);
            let reload = u32::from(trigger.arr().read().arr()) + 1;
            assert_eq!(reload, COUNTS_PER_US * 1_000_000 / SCAN_RATE_HZ);
        }
    }

    #[test]
    fn the_encoder_counts_every_edge_both_ways(bench: &mut Bench) {
        let begun = bench.position();
        let mut expected = begun;
        for steps in [1, 4, 97, -1, -50, -400, 349, 20_000, -20_000] {
            jig::turn(steps);
            expected = expected.wrapping_add(steps as u16);
            // The sample under way was begun before.
            bench.position();
            bench.position();
            assert_eq!(bench.position(), expected);
        }
        assert_eq!(expected, begun);
    }

    #[test]
    fn the_trigger_latches_the_position_that_there_was(bench: &mut Bench) {
        let counter = pac::TIM4;
        let latched = || counter.ccr(2).read().ccr();
        let now = || counter.cnt().read().cnt();
        for _ in 0..20 {
            bench.position();
            jig::await_update();
            let before = latched();
            assert_eq!(now(), before);
            jig::turn(3);
            assert_eq!(now(), before.wrapping_add(3));
            assert_eq!(latched(), before);
            jig::await_update();
            assert_eq!(latched(), before.wrapping_add(3));
        }
    }

    #[test]
    fn the_arms_drive_is_a_pulse_of_its_duty_twenty_thousand_times_a_second(bench: &mut Bench) {
        // Counts of the capture, and of the duty: 84 of both in a microsecond.
        const PERIOD: u32 = Drive::FULL as u32;
        const NEAR: u32 = 4;
        jig::capture(Edges::Pulse);
        for duty in [42, PERIOD / 4, PERIOD / 2, PERIOD - 42] {
            for forward in [true, false] {
                bench.arm.set(Drive {
                    duty: duty as u16,
                    forward,
                });
                wait_us(200);
                let mut rises = [0; 3];
                for rise in &mut rises {
                    jig::forget();
                    let Some(at) = jig::first(200) else {
                        defmt::panic!("no pulse on the wire from D6 to D36");
                    };
                    *rise = at;
                }
                jig::forget();
                let Some(fall) = jig::second(200) else {
                    defmt::panic!("no end of a pulse on the wire from D6 to D36");
                };
                for pair in rises.windows(2) {
                    assert!(pair[1].wrapping_sub(pair[0]).abs_diff(PERIOD) <= NEAR);
                }
                let width = fall.wrapping_sub(rises[2]) % PERIOD;
                defmt::println!("duty {}: high for {} of {}", duty, width, PERIOD);
                assert!(width.abs_diff(duty) <= NEAR);
                let direction = pac::GPIOF.idr().read().idr(13);
                assert_eq!(direction == pac::gpio::vals::Idr::HIGH, forward);
            }
        }
        // Renewed by nobody, it ends after 256 periods, and ends low.
        for duty in [0, Drive::FULL / 2, Drive::FULL] {
            bench.arm.set(Drive {
                duty,
                forward: true,
            });
            wait_us(12_900);
            jig::forget();
            assert!(jig::second(500).is_none());
            assert!(pac::GPIOE.idr().read().idr(9) == pac::gpio::vals::Idr::LOW);
        }
        bench.arm.set(Drive::default());
    }

    #[test]
    fn the_serial_port_hears_what_it_says_at_its_speed(bench: &mut Bench) {
        const BYTES: usize = 256;
        let sent: [u8; BYTES] = core::array::from_fn(|n| (n as u8).wrapping_mul(73));
        let us = (BYTES * 10) as u32 * 1_000 / (BAUD / 1_000);
        for _ in 0..5 {
            feed();
            let mut heard = [0; BYTES];
            let mut count = 0;
            let begun = cycles();
            assert!(block_on(bench.peer.transmitter.write(&sent)).is_ok());
            while count < BYTES {
                let read = bench.peer.receiver.read(&mut heard[count..]);
                match block_on(select(read, jig::elapsed(20_000))) {
                    Either::First(Ok(more)) => count += more,
                    Either::First(Err(_)) => defmt::panic!("USART2 received with an error"),
                    Either::Second(()) => {
                        defmt::panic!("{} of {} bytes came back", count, BYTES)
                    }
                }
            }
            let taken = cycles().wrapping_sub(begun) / CYCLES_PER_US;
            defmt::println!("{} bytes in {} us, {} by the book", BYTES, taken, us);
            assert!(heard == sent);
            // The divider is 0.9 % off; the end of the last byte is told a byte later.
            assert!(taken * 100 > us * 98 && taken * 100 < us * 103);
        }
    }

    #[test]
    fn most_of_the_stack_was_never_used() {
        let mut watch = StackWatch::default();
        for _ in 0..200 {
            watch.look();
        }
        feed();
        let free = watch.free_bytes();
        defmt::println!("{} of {} bytes of stack free", free, STACK_BYTES);
        assert!(free > STACK_BYTES / 2 && free < STACK_BYTES);
    }
}
