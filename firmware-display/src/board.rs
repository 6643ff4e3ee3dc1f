//! The display board's hardware: pins, clocks, timers and DMA; nothing that computes.
//!
//! | what | where |
//! | --- | --- |
//! | output tick, encoder latch | TIM3, 2 kHz |
//! | hand encoder | TIM4, PD12 PD13 |
//! | four DAC81416 | SPI1: SCK D13 (PA5), SDI D11 (PA7); chip selects D10 D9 D8 D7 (PD14 PD15 PF12 PF13); DMA2 stream 3 |
//! | LDAC, of all chips | D5 (PE11), the falling edge updates |
//! | CLR, of all chips | D6 (PE9), held high by TIM1 channel 1 for as long as ticks come |
//! | peer | USART2, PD5 PD6, DMA1 streams 6 and 5 |
//! | console | USART3, PD8 PD9, DMA1 streams 3 and 1 |
//! | link LED | LD1 (PB0) |

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::Peri;
use embassy_stm32::bind_interrupts;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, OutputType, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::typelevel::{self, Handler};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::{Mms, Ocm};
use embassy_stm32::peripherals::{TIM1, TIM3};
use embassy_stm32::spi::{self, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use firmware_display::dac81416;
use firmware_display::{ACTUATORS, TICK_RATE_HZ};
use nucleo::care::Vitals;
use nucleo::encoder::Encoder;
use nucleo::serial::{self, Serial};

use crate::chain::{Chain, Fault, FrameHandler};

bind_interrupts!(struct Irqs {
    DMA2_STREAM3 => FrameHandler;
    TIM3 => TickHandler;
});

/// 27 bytes a chip in 10.3 µs; the DAC81416 takes up to 50 MHz.
const SPI_CLOCK: Hertz = Hertz(dac81416::MAX_CLOCK_HZ);
/// CLR falls this long after the last tick that was served: four ticks.
const HOLD_OFF_US: u16 = (4 * 1_000_000 / TICK_RATE_HZ) as u16;

/// Runs the output task above everything else, on the vector of a peripheral that is not used.
static OUTPUT: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
#[allow(
    unsafe_code,
    reason = "the executor's interrupt hook is unsafe to call from elsewhere"
)]
unsafe fn UART5() {
    // SAFETY: this is the handler of the interrupt that OUTPUT was started with.
    unsafe { OUTPUT.on_interrupt() }
}

/// Everything on the board, ready and not yet running.
pub struct Board {
    /// Spawns tasks that preempt all others.
    pub output: SendSpawner,
    /// The 2 kHz that everything here goes by, and the hand's position at each of them.
    pub ticks: Ticks,
    /// The actuators' converters.
    pub dacs: Dacs,
    /// The port to the other board.
    pub peer: Serial,
    /// The console port.
    pub console: Serial,
    /// What keeps the board alive.
    pub vitals: Vitals,
}

impl Board {
    /// Sets the hardware up. To be called once.
    pub fn take() -> Self {
        let started = nucleo::reset::cause();
        let p = embassy_stm32::init(nucleo::clock::configuration());
        let vitals = Vitals::new(p.IWDG, p.PB0, started);

        let timer = Timer::new(p.TIM3);
        timer.set_frequency(Hertz(TICK_RATE_HZ), RoundTo::Slower);
        timer.set_master_mode(Mms::UPDATE);
        let ticks = Ticks {
            timer,
            encoder: Encoder::new(p.TIM4, p.PD12, p.PD13),
            seen: 0,
        };

        let mut configuration = spi::Config::default();
        configuration.mode = MODE_1;
        configuration.frequency = SPI_CLOCK;
        let select = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::High, Speed::VeryHigh);
        let mut clear_pin = Flex::new(p.PE9);
        clear_pin.set_as_af_unchecked(1, AfType::output(OutputType::PushPull, Speed::Low));
        let dacs = Dacs {
            chain: Chain::new(
                Spi::new_blocking_txonly(p.SPI1, p.PA5, p.PA7, configuration),
                p.DMA2_CH3,
                [
                    select(p.PD14.into()),
                    select(p.PD15.into()),
                    select(p.PF12.into()),
                    select(p.PF13.into()),
                ],
                Output::new(p.PE11, Level::High, Speed::VeryHigh),
            ),
            clear: ClearGuard::new(Timer::new(p.TIM1), clear_pin),
        };

        let peer = serial::peer(p.USART2, p.PD6, p.PD5, p.DMA1_CH6, p.DMA1_CH5);
        let console = serial::console(p.USART3, p.PD9, p.PD8, p.DMA1_CH3, p.DMA1_CH1);

        interrupt::UART5.set_priority(Priority::P6);
        Self {
            output: OUTPUT.start(interrupt::UART5),
            ticks,
            dacs,
            peer,
            console,
            vitals,
        }
    }
}

/// Ticks of TIM3 since the start, wrapping.
static TICKS: AtomicU32 = AtomicU32::new(0);
static TICKED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Counts TIM3's ticks and wakes the output task.
pub struct TickHandler;

impl Handler<typelevel::TIM3> for TickHandler {
    #[allow(unsafe_code, reason = "the trait's signature")]
    unsafe fn on_interrupt() {
        pac::TIM3.sr().write(|w| w.0 = !1);
        TICKS.store(
            TICKS.load(Ordering::Relaxed).wrapping_add(1),
            Ordering::Relaxed,
        );
        TICKED.signal(());
    }
}

/// The output tick and the hand's encoder, latched by it.
pub struct Ticks {
    timer: Timer<'static, TIM3>,
    encoder: Encoder,
    seen: u32,
}

impl Ticks {
    /// Starts the tick.
    pub fn start(&mut self) {
        self.timer.enable_update_interrupt(true);
        interrupt::TIM3.set_priority(Priority::P5);
        interrupt::TIM3.unpend();
        #[allow(
            unsafe_code,
            reason = "unmasking an interrupt whose handler is bound above"
        )]
        // SAFETY: no critical section relies on this interrupt being masked.
        unsafe {
            interrupt::TIM3.enable();
        }
        self.timer.start();
    }

    /// Waits for the next tick. Returns the hand encoder at it, and the ticks missed since the last call.
    pub async fn next(&mut self) -> (u16, u32) {
        TICKED.wait().await;
        let ticks = TICKS.load(Ordering::Relaxed);
        let missed = ticks.wrapping_sub(self.seen).saturating_sub(1);
        self.seen = ticks;
        (self.encoder.latched(), missed)
    }
}

/// The four converters.
pub struct Dacs {
    chain: Chain,
    clear: ClearGuard,
}

impl Dacs {
    /// Brings all chips from power-up to streaming, at 0 V. Their channels are powered down until
    /// their words stand, so CLR, under which no word is taken, can be released before.
    pub fn start(&mut self) -> Result<(), spi::Error> {
        self.clear.start();
        let written = dac81416::start_up().try_for_each(|write| {
            self.clear.hold_off();
            self.chain.write(&write)
        });
        self.chain.open();
        written
    }

    /// Starts to load every channel; all of them change on one LDAC edge.
    pub fn update(&mut self, words: &[u16; ACTUATORS]) {
        self.chain.send(words);
    }

    /// How the last update went, to be asked before the next. CLR is kept off for four more ticks,
    /// unless it went wrong: outputs that can't be changed go to 0 V.
    pub fn finish(&mut self) -> Result<Clear, Fault> {
        self.chain.finish()?;
        Ok(self.clear.hold_off())
    }
}

/// What CLR did since it was held off last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clear {
    /// It stayed high.
    Held,
    /// It fell: the chips are at 0 V and took no words.
    Fell,
}

/// CLR is low, and the outputs at 0 V, unless this timer runs: its channel is high from count 1 on,
/// and it stops by itself at the end of its only pulse. Software can only hold the fall off, tick by
/// tick.
struct ClearGuard {
    timer: Timer<'static, TIM1>,
    _pin: Flex<'static>,
}

impl ClearGuard {
    fn new(timer: Timer<'static, TIM1>, pin: Flex<'static>) -> Self {
        let r = pac::TIM1;
        let clock_hz = timer.get_clock_frequency().0;
        r.psc().write_value((clock_hz / 1_000_000 - 1) as u16);
        r.arr().modify(|w| w.set_arr(HOLD_OFF_US));
        r.ccr(0).modify(|w| w.set_ccr(1));
        r.ccmr_output(0).modify(|w| w.set_ocm(0, Ocm::PWM_MODE2));
        r.ccer().modify(|w| w.set_cce(0, true));
        r.cr1().modify(|w| w.set_opm(true));
        // Loads the prescaler; the counter stays at 0 and CLR low.
        r.egr().write(|w| w.set_ug(true));
        Self { timer, _pin: pin }
    }

    fn start(&mut self) {
        self.timer.set_moe(true);
        self.hold_off();
    }

    fn hold_off(&mut self) -> Clear {
        let r = pac::TIM1;
        r.cnt().write(|w| w.set_cnt(1));
        let mut control = r.cr1().read();
        let clear = if control.cen() {
            Clear::Held
        } else {
            Clear::Fell
        };
        control.set_cen(true);
        r.cr1().write_value(control);
        clear
    }
}
