//! What a restart leaves, tried on a board: the watchdog, a stack that is full, a panic, a trip that is kept. The
//! board is restarted four times before the first test speaks. See `docs/src/how-to/on-target.md`. On a host this is
//! an empty program.
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
#[path = "../src/clear.rs"]
mod clear;
#[cfg(target_os = "none")]
#[path = "../../tests/plain-board/src/console.rs"]
mod console;
#[cfg(target_os = "none")]
#[path = "../src/crash.rs"]
mod crash;
#[cfg(target_os = "none")]
#[path = "../../tests/on-target/jig.rs"]
mod jig;

#[cfg(target_os = "none")]
use defmt_rtt as _;

/// The boots, and what is remembered of each.
#[cfg(target_os = "none")]
mod boots {
    use core::hint::black_box;
    use core::mem::MaybeUninit;
    use core::ptr::{addr_of, addr_of_mut};

    use cortex_m::peripheral::SCB;
    use nucleo::supervision::Vitals;
    use protocol::{ResetCause, Trip};

    use crate::jig;

    /// Marks a record, as opposed to what RAM holds after power came on.
    const KEPT: u32 = 0x424F_4F54;
    /// Restarts that are provoked.
    pub const RESTARTS: usize = 4;

    /// What a start found.
    #[derive(Clone, Copy)]
    pub struct Found {
        /// Why the board started.
        pub cause: ResetCause,
        /// Restarts by the watchdog so far.
        pub watchdog_resets: u32,
        /// The trip that was kept.
        pub trip: Option<Trip>,
    }

    /// What the starts found, in their order, and what is measured of them.
    #[derive(Clone, Copy)]
    pub struct Record {
        mark: u32,
        next: usize,
        /// By restart.
        pub found: [Found; RESTARTS],
        /// The watchdog's resets before the first.
        pub watchdog_resets: u32,
        /// Cycles that the watchdog was left unfed until it restarted the board.
        pub unfed_cycles: u32,
    }

    #[allow(
        unsafe_code,
        reason = "the section is cortex-m-rt's own, for RAM that is left alone"
    )]
    #[unsafe(link_section = ".uninit.boots")]
    static mut RECORD: MaybeUninit<Record> = MaybeUninit::uninit();

    /// Starts the board again and again, and comes back at the last start.
    pub fn go_through() -> Record {
        let (cause, watchdog_resets) = nucleo::reset::cause();
        let expected = match next() {
            Some(0..=2) => cause == ResetCause::Watchdog,
            Some(3) => cause == ResetCause::Software,
            _ => false,
        };
        let restart = if expected {
            let found = Found {
                cause,
                watchdog_resets,
                trip: nucleo::trip::after(cause),
            };
            keep(found)
        } else {
            begin(watchdog_resets)
        };
        if restart == RESTARTS {
            return finish();
        }
        // What is kept is forgotten, as by the reset button: the next trip is the first again.
        nucleo::trip::kept_after(ResetCause::Pin);
        let p = nucleo::clock::start();
        let _vitals = Vitals::new(p.IWDG, p.PB0, (cause, watchdog_resets));
        jig::start();
        match restart {
            0 => starve(),
            1 => fill_stack(0),
            2 => panic!("on purpose"),
            _ => {
                nucleo::trip::latch(Trip::Operator);
                SCB::sys_reset()
            }
        }
    }

    /// Waits for the watchdog, and notes how long.
    fn starve() -> ! {
        let begun = jig::cycles();
        loop {
            let unfed_cycles = jig::cycles().wrapping_sub(begun);
            #[allow(unsafe_code, reason = "RAM that a reset leaves alone")]
            // SAFETY: the record has been begun, and no reference to it is ever made.
            unsafe {
                (&raw mut (*record()).unfed_cycles).write_volatile(unfed_cycles);
            }
        }
    }

    /// Calls itself until the stack is full.
    #[allow(
        unconditional_recursion,
        reason = "it ends where the stack does, which is what is tried"
    )]
    #[inline(never)]
    fn fill_stack(depth: u32) -> ! {
        let room = black_box([depth; 64]);
        let deeper = black_box(room[usize::from(depth as u8 % 64)]) + 1;
        fill_stack(black_box(deeper))
    }

    fn record() -> *mut Record {
        addr_of_mut!(RECORD).cast()
    }

    #[allow(unsafe_code, reason = "RAM that a reset leaves alone")]
    fn next() -> Option<usize> {
        // SAFETY: numbers, of which every bit pattern is valid; no reference is ever made.
        let (mark, next) = unsafe {
            (
                addr_of!((*record()).mark).read_volatile(),
                addr_of!((*record()).next).read_volatile(),
            )
        };
        (mark == KEPT).then_some(next)
    }

    #[allow(unsafe_code, reason = "RAM that a reset leaves alone")]
    fn begin(watchdog_resets: u32) -> usize {
        let nothing = Found {
            cause: ResetCause::Pin,
            watchdog_resets: 0,
            trip: None,
        };
        let fresh = Record {
            mark: KEPT,
            next: 0,
            found: [nothing; RESTARTS],
            watchdog_resets,
            unfed_cycles: 0,
        };
        // SAFETY: no reference to the static is ever made.
        unsafe { record().write_volatile(fresh) };
        0
    }

    /// Keeps what a start found; returns how many have been kept.
    #[allow(unsafe_code, reason = "RAM that a reset leaves alone")]
    fn keep(found: Found) -> usize {
        // SAFETY: it has been begun by a start before this one, with values of these types.
        let mut record_now = unsafe { record().read_volatile() };
        record_now.found[record_now.next] = found;
        record_now.next += 1;
        // SAFETY: as above.
        unsafe { record().write_volatile(record_now) };
        record_now.next
    }

    #[allow(unsafe_code, reason = "RAM that a reset leaves alone")]
    fn finish() -> Record {
        // SAFETY: as above.
        let left = unsafe { record().read_volatile() };
        let over = Record { mark: 0, ..left };
        // SAFETY: as above.
        unsafe { record().write_volatile(over) };
        left
    }
}

#[cfg(target_os = "none")]
#[defmt_test::tests]
mod tests {
    use defmt::{assert, assert_eq};
    use nucleo::supervision::Vitals;
    use protocol::{ResetCause, Trip};

    use crate::boots::{self, RESTARTS, Record};
    use crate::jig::{self, CYCLES_PER_US};

    /// 400 ms of a 32 kHz clock that is anywhere between 17 and 47 kHz (STM32F429's data sheet, LSI).
    const UNFED_MS: [u32; 2] = [400 * 32 / 47, 400 * 32 / 17];

    #[init]
    fn init() -> Record {
        jig::end_if_failed();
        let record = boots::go_through();
        jig::begin();
        let p = nucleo::clock::start();
        Vitals::new(
            p.IWDG,
            p.PB0,
            (ResetCause::Software, record.watchdog_resets),
        );
        jig::start();
        record
    }

    #[teardown]
    fn teardown() {
        jig::end();
        // Whoever reads the log has time to.
        jig::wait_us(20_000);
    }

    #[test]
    fn the_watchdog_restarts_a_board_that_does_not_feed_it(record: &mut Record) {
        let ms = record.unfed_cycles / CYCLES_PER_US / 1_000;
        defmt::println!("the watchdog waited for {} ms", ms);
        assert!(ms >= UNFED_MS[0] && ms <= UNFED_MS[1]);
        assert!(record.found[0].cause == ResetCause::Watchdog);
        assert!(record.found[0].trip == Some(Trip::Watchdog));
    }

    #[test]
    fn a_stack_that_is_full_is_a_fault_that_is_told_of_after_the_restart(record: &mut Record) {
        assert!(record.found[1].cause == ResetCause::Watchdog);
        assert!(record.found[1].trip == Some(Trip::StackOverflow));
    }

    #[test]
    fn a_panic_is_told_of_after_the_restart(record: &mut Record) {
        assert!(record.found[2].cause == ResetCause::Watchdog);
        assert!(record.found[2].trip == Some(Trip::Panic));
    }

    #[test]
    fn a_trip_outlives_a_reset_by_software(record: &mut Record) {
        assert!(record.found[3].cause == ResetCause::Software);
        assert!(record.found[3].trip == Some(Trip::Operator));
    }

    #[test]
    fn the_watchdogs_restarts_are_counted_and_no_others(record: &mut Record) {
        let counted: [u32; RESTARTS] = record
            .found
            .map(|found| found.watchdog_resets - record.watchdog_resets);
        assert_eq!(counted, [1, 2, 3, 3]);
    }
}
