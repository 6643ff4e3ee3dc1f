//! What a test on a board has beside the board's own set-up: the processor's cycle counter, a timer that
//! captures edges on jumper wires, two pins that play an encoder, and a mark of how far the run came.
//!
//! | jumper wire | from | to |
//! | --- | --- | --- |
//! | `pulse` | D6 (PE9), TIM1 channel 1: the arm's PWM, or CLR | D36 (PB10), TIM2 channel 3 |
//! | `load` | D16 (PC6), TIM3 channel 1: LDAC | D35 (PB11), TIM2 channel 4 |
//! | `encoder-a`, `encoder-b` | D30 (PD11), D31 (PE2), played by software | D29 (PD12), D28 (PD13), TIM4 |
//! | `serial` | USART2 TX (PD5) | USART2 RX (PD6) |
//! | `spi` | SPI1 MOSI, D11 (PA7) | SPI1 MISO, D12 (PA6) |

use core::future::poll_fn;
use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};
use core::task::Poll;

use cortex_m::peripheral::DWT;
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, Ts};

/// Cycles of the processor in a microsecond.
pub const CYCLES_PER_US: u32 = 168;
/// Counts of TIM2 and TIM3 in a microsecond.
pub const COUNTS_PER_US: u32 = 84;

/// Channels 3 and 4 of TIM2, counted from 0.
const FIRST: usize = 2;
const SECOND: usize = 3;
/// Their pins on port B, and the function that is TIM2.
const FIRST_PIN: usize = 10;
const SECOND_PIN: usize = 11;
const TIM2_FUNCTION: u8 = 1;
/// The pins that play an encoder: A on port D, B on port E.
const A: usize = 11;
const B: usize = 2;

/// Sets up what is here. To be called once, after the board's own set-up.
pub fn start() {
    #[allow(unsafe_code, reason = "the debug unit, which nothing else uses")]
    // SAFETY: only the cycle counter is touched, which nobody else has.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();

    pac::RCC.ahb1enr().modify(|w| {
        w.set_gpioben(true);
        w.set_gpioden(true);
        w.set_gpioeen(true);
    });
    pac::RCC.apb1enr().modify(|w| w.set_tim2en(true));
    // An open jumper is at a level that makes no edge.
    for (pin, pull) in [(FIRST_PIN, Pupdr::PULL_DOWN), (SECOND_PIN, Pupdr::PULL_UP)] {
        pac::GPIOB.pupdr().modify(|w| w.set_pupdr(pin, pull));
        pac::GPIOB
            .afr(pin / 8)
            .modify(|w| w.set_afr(pin % 8, TIM2_FUNCTION));
        pac::GPIOB
            .moder()
            .modify(|w| w.set_moder(pin, Moder::ALTERNATE));
    }
    pac::GPIOD.moder().modify(|w| w.set_moder(A, Moder::OUTPUT));
    pac::GPIOE.moder().modify(|w| w.set_moder(B, Moder::OUTPUT));

    let timer = pac::TIM2;
    timer.arr().write_value(u32::MAX);
    timer.smcr().modify(|w| w.set_ts(Ts::ITR2));
    timer.cr1().modify(|w| w.set_cen(true));
}

/// The processor's cycles, wrapping after 25 s.
pub fn cycles() -> u32 {
    DWT::cycle_count()
}

/// Waits for 100 ms at most, and feeds the watchdog.
pub fn wait_us(us: u32) {
    let begun = cycles();
    while cycles().wrapping_sub(begun) < us * CYCLES_PER_US {}
    feed();
}

/// Is over after `us`. The time driver's own future needs an executor.
pub async fn elapsed(us: u32) {
    let begun = cycles();
    poll_fn(|context| {
        if cycles().wrapping_sub(begun) > us * CYCLES_PER_US {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await
}

/// Feeds the watchdog.
pub fn feed() {
    pac::IWDG
        .kr()
        .write(|w| w.set_key(pac::iwdg::vals::Key::RESET));
}

/// What TIM2 takes the time of.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Edges {
    /// Rises of the wire `pulse`, and its falls.
    Pulse,
    /// TIM3's updates, and falls of the wire `load`.
    LoadAfterTick,
}

/// Makes ready for `edges`; what was captured before is forgotten.
pub fn capture(edges: Edges) {
    let timer = pac::TIM2;
    timer.ccer().write(|_| {});
    let (first, second) = match edges {
        // The same pin for both: straight for the third channel, crosswise for the fourth.
        Edges::Pulse => (CcmrInputCcs::TI4, CcmrInputCcs::TI3),
        Edges::LoadAfterTick => (CcmrInputCcs::TRC, CcmrInputCcs::TI4),
    };
    timer.ccmr_input(1).write(|w| {
        w.set_ccs(FIRST % 2, first);
        w.set_ccs(SECOND % 2, second);
    });
    timer.ccer().write(|w| {
        w.set_cce(FIRST, true);
        w.set_cce(SECOND, true);
        w.set_ccp(SECOND, true);
    });
    forget();
}

/// Forgets the edges that have come.
pub fn forget() {
    pac::TIM2.sr().write(|w| w.0 = 0);
}

/// When the last rise came, or the last update, in counts of TIM2, wrapping. Waits for one for `us` at most, if none
/// has come since [`forget`].
pub fn first(us: u32) -> Option<u32> {
    captured(FIRST, us)
}

/// The same of the last fall.
pub fn second(us: u32) -> Option<u32> {
    captured(SECOND, us)
}

/// When TIM3's last update came, captured with [`Edges::LoadAfterTick`].
pub fn tick() -> u32 {
    pac::TIM2.ccr(FIRST).read()
}

fn captured(channel: usize, us: u32) -> Option<u32> {
    let begun = cycles();
    while !pac::TIM2.sr().read().ccif(channel) {
        if cycles().wrapping_sub(begun) > us * CYCLES_PER_US {
            return None;
        }
    }
    Some(pac::TIM2.ccr(channel).read())
}

/// Waits for TIM3's update, in a period of 250 µs; returns at most 12 µs behind it.
pub fn await_update() {
    let counts = || u32::from(pac::TIM3.cnt().read().cnt());
    while counts() < 100 * COUNTS_PER_US {}
    while counts() > 12 * COUNTS_PER_US {}
}

/// Turns the encoder that is played by `steps` of its edges, forwards if positive.
pub fn turn(steps: i32) {
    for _ in 0..steps.unsigned_abs() {
        let a = pac::GPIOD.odr().read().odr(A) == pac::gpio::vals::Odr::HIGH;
        let b = pac::GPIOE.odr().read().odr(B) == pac::gpio::vals::Odr::HIGH;
        // A leads: 00, 10, 11, 01.
        let moves_a = (a == b) == (steps > 0);
        if moves_a {
            set(pac::GPIOD, A, !a);
        } else {
            set(pac::GPIOE, B, !b);
        }
        // The counter looks at its inputs at every count of its clock, and its wire has to get there.
        cortex_m::asm::delay(CYCLES_PER_US);
    }
}

fn set(port: pac::gpio::Gpio, pin: usize, high: bool) {
    port.bsrr().write(|w| {
        w.set_bs(pin, high);
        w.set_br(pin, !high);
    });
}

/// Marks a run that has begun, as opposed to what RAM holds after power came on.
const BEGUN: u32 = 0x5255_4E21;

#[allow(
    unsafe_code,
    reason = "the section is cortex-m-rt's own, for RAM that is left alone"
)]
#[unsafe(link_section = ".uninit.on_target_run")]
static mut RUN: MaybeUninit<u32> = MaybeUninit::uninit();

/// Notes that the tests begin, with the watchdog running.
pub fn begin() {
    set_mark(BEGUN);
}

/// If the tests that were begun before this start never came to their end, one has failed, has said so, and the
/// watchdog has started the board anew: then the debugger is told, and this does not return.
pub fn end_if_failed() {
    if mark() == BEGUN {
        end();
        crate::console::exit(false);
    }
}

/// Notes that the tests came to their end.
pub fn end() {
    set_mark(0);
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised"
)]
fn mark() -> u32 {
    // SAFETY: every bit pattern is a valid u32, and no reference to the static is ever made.
    unsafe { addr_of!(RUN).cast::<u32>().read_volatile() }
}

#[allow(
    unsafe_code,
    reason = "a static that outlives a reset can't be initialised"
)]
fn set_mark(word: u32) {
    // SAFETY: as above.
    unsafe { addr_of_mut!(RUN).cast::<u32>().write_volatile(word) }
}
