//! Whether the board's clock begins at zero and never steps back, what the chip's timers make of an update
//! generation while counter and compare registers are equal, and how the flash is read. See
//! `nucleo::clock::start`.
//!
//! It speaks to whoever debugs it: to the emulator in the tests, to `probe-rs` at a real board:
//!
//! ```sh
//! cargo run --release --target thumbv7em-none-eabihf -p firmware-sensor --example clock
//! ```
//!
//! On a computer this is an empty program.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
#[path = "../../tests/plain-board/src/console.rs"]
mod console;

#[cfg(target_os = "none")]
mod board {
    use core::fmt::Write as _;

    use defmt_rtt as _;
    use embassy_stm32::pac;
    use embassy_stm32::pac::timer::vals::Urs;
    use embassy_time::{Duration, Instant};
    use panic_probe as _;

    use crate::console::{Console, exit};

    /// Six half periods of the time driver.
    const WATCHED: Duration = Duration::from_millis(200);

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let _peripherals = nucleo::clock::start();
        let (began, mut before) = (Instant::now(), Instant::now());
        let (mut steps, mut furthest_us) = (0u32, 0);
        while before < began + WATCHED {
            let now = Instant::now();
            if let Some(back) = before
                .checked_duration_since(now)
                .filter(|back| *back > Duration::MIN)
            {
                steps += 1;
                furthest_us = back.as_micros().max(furthest_us);
            }
            before = now;
        }
        let flags = flags_of_an_update_generation();
        let said = writeln!(
            Console,
            "began at {} us, stepped back {steps} times, by {furthest_us} us at most\n\
             an update generation at 0 sets {flags:#06x}\n\
             flash: {:#06x}",
            began.as_micros(),
            pac::FLASH.acr().read().0,
        );
        exit(said.is_ok());
    }

    /// The flags that a timer of the time driver's kind has once it is set up as the driver does it.
    fn flags_of_an_update_generation() -> u32 {
        let timer = pac::TIM2;
        pac::RCC.apb1enr().modify(|w| w.set_tim2en(true));
        pac::RCC.apb1rstr().modify(|w| w.set_tim2rst(true));
        pac::RCC.apb1rstr().modify(|w| w.set_tim2rst(false));
        timer.psc().write_value(83);
        timer.arr().write_value(u16::MAX.into());
        timer.cr1().modify(|w| w.set_urs(Urs::COUNTER_ONLY));
        timer.egr().write(|w| w.set_ug(true));
        timer.sr().read().0
    }
}
