//! The display board's hardware: pins, clocks, timers and DMA; nothing that computes.
//!
//! | what | where |
//! | --- | --- |
//! | output tick, encoder latch | TIM3, 2 or 4 kHz |
//! | hand encoder | TIM4, PD12 PD13 |
//! | four DAC81416 | SPI1: SCK D13 (PA5), SDO D12 (PA6), SDI D11 (PA7); chip selects D10 D9 D8 D7 (PD14 PD15 PF12 PF13); DMA2 stream 3 |
//! | LDAC, of all chips | D16 (PC6), TIM3 channel 1, the falling edge updates |
//! | CLR, of all chips | D6 (PE9), held high by TIM1 channel 1 for as long as ticks come; pulled low |
//! | ALMOUT, of all chips | D3 (PE13), pulled high, low is an alarm |
//! | emergency stop | D4 (PF14), pulled high, closed to ground until pressed |
//! | peer | USART2, PD5 PD6, DMA1 streams 6 and 5 |
//! | console | USART3, PD8 PD9, DMA1 streams 3 and 1 |
//! | link LED | LD1 (PB0) |

use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::Peri;
use embassy_stm32::bind_interrupts;
use embassy_stm32::gpio::{AnyPin, Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::spi::{self, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::Timer;
use firmware_display::dac81416;
use nucleo::encoder::Encoder;
use nucleo::serial::{self, Serial};
use nucleo::supervision::Vitals;
use protocol::Trip;
use static_cell::StaticCell;

use crate::chain::{Chain, FrameHandler};
use crate::clear::ClearGuard;
use crate::converters::Converters;
use crate::inputs::Inputs;
use crate::load::Load;
use crate::ticks::{TickHandler, Ticks};

bind_interrupts!(struct Irqs {
    DMA2_STREAM3 => FrameHandler;
    TIM3 => TickHandler;
});

/// A frame of 27 bytes in 5.1 µs; the DAC81416 takes up to 50 MHz, SPI1 gives up to 45.
const SPI_CLOCK: Hertz = Hertz(dac81416::MAX_CLOCK_HZ);
/// Bytes of each port's ring. On a line without a gap half of it passes before anyone is told, 2.8 ms:
/// with that a Stop is obeyed within 5 ms.
const RING_BYTES: usize = 512;

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
    /// The tick that everything here goes by, and the hand's position at each of them.
    pub ticks: Ticks,
    /// The actuators' converters, and LDAC and CLR.
    pub converters: Converters,
    /// Emergency stop and alarm.
    pub inputs: Inputs,
    /// Why the display is to stay stopped, if a reset found it so or is a reason itself.
    pub trip: Option<Trip>,
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
        let trip = nucleo::trip::after(started.0);
        let p = nucleo::clock::start();
        let vitals = Vitals::new(p.IWDG, p.PB0, started);

        let timer = Timer::new(p.TIM3);
        let load = Load::new(p.PC6, timer.get_clock_frequency().0);
        let ticks = Ticks::new(timer, Encoder::new(p.TIM4, p.PD12, p.PD13));

        let mut configuration = spi::Config::default();
        configuration.mode = MODE_1;
        configuration.frequency = SPI_CLOCK;
        // What no chip says is all ones, which answers nothing.
        configuration.miso_pull = Pull::Up;
        let select = |pin: Peri<'static, AnyPin>| Output::new(pin, Level::High, Speed::VeryHigh);
        let converters = Converters::new(
            Chain::new(
                Spi::new_blocking(p.SPI1, p.PA5, p.PA7, p.PA6, configuration),
                p.DMA2_CH3,
                [
                    select(p.PD14.into()),
                    select(p.PD15.into()),
                    select(p.PF12.into()),
                    select(p.PF13.into()),
                ],
            ),
            load,
            ClearGuard::new(Timer::new(p.TIM1), p.PE9),
        );

        static PEER: StaticCell<[u8; RING_BYTES]> = StaticCell::new();
        static CONSOLE: StaticCell<[u8; RING_BYTES]> = StaticCell::new();
        let (ring, other) = (PEER.init([0; RING_BYTES]), CONSOLE.init([0; RING_BYTES]));
        let peer = serial::peer(p.USART2, p.PD6, p.PD5, p.DMA1_CH6, p.DMA1_CH5, ring);
        let console = serial::console(p.USART3, p.PD9, p.PD8, p.DMA1_CH3, p.DMA1_CH1, other);

        interrupt::UART5.set_priority(Priority::P6);
        Self {
            output: OUTPUT.start(interrupt::UART5),
            ticks,
            converters,
            inputs: Inputs::new(p.PF14, p.PE13),
            trip,
            peer,
            console,
            vitals,
        }
    }
}
