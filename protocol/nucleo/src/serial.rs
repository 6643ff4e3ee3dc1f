//! The two UARTs of a board, with a DMA ring behind each receiver.
//!
//! | port | UART | pins TX, RX | DMA1 streams TX, RX |
//! | --- | --- | --- | --- |
//! | peer | USART2 | PD5, PD6 | 6, 5 |
//! | console | USART3, the ST-LINK's | PD8, PD9 | 3, 1 |

use embassy_stm32::interrupt::typelevel::Interrupt;
use embassy_stm32::interrupt::{self, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{
    DMA1_CH1, DMA1_CH3, DMA1_CH5, DMA1_CH6, PD5, PD6, PD8, PD9, USART2, USART3,
};
use embassy_stm32::usart::{self, Config, Error, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{Peri, bind_interrupts, dma, pac};

bind_interrupts!(struct Irqs {
    USART2 => usart::InterruptHandler<USART2>;
    USART3 => usart::InterruptHandler<USART3>;
    DMA1_STREAM1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_STREAM3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_STREAM5 => dma::InterruptHandler<DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
});

/// Speed of both ports, 8N1.
pub const BAUD: u32 = 921_600;
/// After the tasks that have a deadline, which run at 6: an interrupt of DMA1 or a UART that cannot be ended comes again
/// and again, and what comes over the ports is not to hold up gauges or actuators.
const PRIORITY: Priority = Priority::P7;
/// One UART: its receiver runs already, so that what the other board says before the tasks run is kept.
pub struct Serial {
    /// The receiver.
    pub receiver: Receiver,
    /// The transmitter.
    pub transmitter: UartTx<'static, Async>,
}

/// The port to the other board, which keeps what it hears in `ring`: 92 bytes a millisecond at most, and
/// half of it before anyone is told, if the line has no gap.
pub fn peer(
    uart: Peri<'static, USART2>,
    rx: Peri<'static, PD6>,
    tx: Peri<'static, PD5>,
    tx_dma: Peri<'static, DMA1_CH6>,
    rx_dma: Peri<'static, DMA1_CH5>,
    ring: &'static mut [u8],
) -> Serial {
    yield_to_deadlines::<interrupt::typelevel::USART2>();
    yield_to_deadlines::<interrupt::typelevel::DMA1_STREAM6>();
    yield_to_deadlines::<interrupt::typelevel::DMA1_STREAM5>();
    start(
        Uart::new(uart, rx, tx, tx_dma, rx_dma, Irqs, configuration()),
        5,
        ring,
    )
}

/// The console port, with its `ring`.
pub fn console(
    uart: Peri<'static, USART3>,
    rx: Peri<'static, PD9>,
    tx: Peri<'static, PD8>,
    tx_dma: Peri<'static, DMA1_CH3>,
    rx_dma: Peri<'static, DMA1_CH1>,
    ring: &'static mut [u8],
) -> Serial {
    yield_to_deadlines::<interrupt::typelevel::USART3>();
    yield_to_deadlines::<interrupt::typelevel::DMA1_STREAM3>();
    yield_to_deadlines::<interrupt::typelevel::DMA1_STREAM1>();
    start(
        Uart::new(uart, rx, tx, tx_dma, rx_dma, Irqs, configuration()),
        1,
        ring,
    )
}

fn yield_to_deadlines<I: Interrupt>() {
    I::set_priority(PRIORITY);
}

fn configuration() -> Config {
    let mut configuration = Config::default();
    configuration.baudrate = BAUD;
    configuration
}

fn start(
    uart: Result<Uart<'static, Async>, usart::ConfigError>,
    stream: usize,
    ring: &'static mut [u8],
) -> Serial {
    let Ok(uart) = uart else {
        defmt::panic!("{} baud divides from 42 MHz", BAUD);
    };
    let (transmitter, receiver) = uart.split();
    let length = ring.len();
    let mut uart = receiver.into_ring_buffered(ring);
    uart.start_uart();
    Serial {
        receiver: Receiver {
            uart,
            stream,
            length,
            place: 0,
            written: length,
        },
        transmitter,
    }
}

/// A receiver that gives each byte once. An error ends the DMA, which then begins at the ring's start again, and the
/// driver takes the rest of the ring, which was read before, for new.
pub struct Receiver {
    uart: RingBufferedUartRx<'static>,
    /// Of DMA1.
    stream: usize,
    /// Bytes of the ring.
    length: usize,
    /// Where in the ring the next byte is read.
    place: usize,
    /// Up to where it was written on this way through it.
    written: usize,
}

impl Receiver {
    /// Waits for bytes, and says how many there are.
    ///
    /// # Errors
    /// If bytes were lost, or the line had noise or a framing error. What came before is still to be read.
    pub async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Error> {
        loop {
            let room = bytes.len().min(self.length - self.place);
            let count = match self.uart.read(&mut bytes[..room]).await {
                Ok(count) => count,
                Err(error) => {
                    self.end(error);
                    return Err(error);
                }
            };
            let new = self.written.saturating_sub(self.place).min(count);
            self.place += count;
            if self.place == self.length {
                (self.place, self.written) = (0, self.length);
            }
            if new > 0 {
                return Ok(new);
            }
        }
    }

    fn end(&mut self, error: Error) {
        let stream = pac::DMA1.st(self.stream);
        if stream.cr().read().en() {
            return;
        }
        self.written = self.length - usize::from(stream.ndtr().read().ndt());
        if error == Error::Overrun {
            // The driver leaves all that was not read.
            self.place = self.written % self.length;
        }
    }
}
