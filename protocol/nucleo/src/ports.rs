//! The two serial ports of a board: USART2 to the other board, USART3 to the ST-LINK's console.

use core::cell::RefCell;

use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Error, RingBufferedUartRx, UartTx};
use embassy_sync::blocking_mutex::ThreadModeMutex;
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, ThreadModeRawMutex};
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use protocol::port::Port;
use protocol::receiver::Peer;
use protocol::{Hello, Message, PortCounters};

/// Most bytes handed to a transmitter's DMA at once.
const BURST_BYTES: usize = 256;

/// Which port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The other board.
    Peer,
    /// The ST-LINK's virtual COM port.
    Console,
}

/// What tasks of any priority want said on both ports; full only if the thread is held up for 8 ms.
pub static OUTBOX: Channel<CriticalSectionRawMutex, Message, 4> = Channel::new();

/// Puts what is in the [`OUTBOX`] on both ports. Deadline: 2 ms, the display's next motion.
#[embassy_executor::task]
pub async fn report(ports: &'static Ports) {
    loop {
        let message = OUTBOX.receive().await;
        ports.post(&message);
    }
}

/// Talks on a port. See [`Ports::speak`].
#[embassy_executor::task(pool_size = 2)]
pub async fn speak(ports: &'static Ports, side: Side, uart: UartTx<'static, Async>) {
    ports.speak(side, uart).await
}

/// Both ports, shared by the tasks of the thread-mode executor.
pub struct Ports {
    ports: ThreadModeMutex<RefCell<[Port; 2]>>,
    filled: [Signal<ThreadModeRawMutex, ()>; 2],
}

impl Ports {
    /// Two ports that introduce themselves with `hello`.
    pub fn new(hello: Hello) -> Self {
        Self {
            ports: ThreadModeMutex::new(RefCell::new([Port::new(hello), Port::new(hello)])),
            filled: [Signal::new(), Signal::new()],
        }
    }

    fn with<R>(&self, side: Side, act: impl FnOnce(&mut Port) -> R) -> R {
        let (result, filled) = self.ports.lock(|ports| {
            let port = &mut ports.borrow_mut()[side as usize];
            let result = act(port);
            (result, port.has_bytes())
        });
        if filled {
            self.filled[side as usize].signal(());
        }
        result
    }

    /// Says `message` to whoever listens on either port.
    pub fn post(&self, message: &Message) {
        for side in [Side::Peer, Side::Console] {
            self.with(side, |port| port.post(message));
        }
    }

    /// Sends a Hello on each port where one is due; to be called at least every 100 ms.
    pub fn poll(&self) {
        let now_us = Instant::now().as_micros();
        for side in [Side::Peer, Side::Console] {
            self.with(side, |port| port.poll(now_us));
        }
    }

    /// Whether the other end of a port has introduced itself and is understood.
    pub fn is_known(&self, side: Side) -> bool {
        self.with(side, |port| matches!(port.peer(), Peer::Known(_)))
    }

    /// What a port has counted.
    pub fn counters(&self, side: Side) -> PortCounters {
        self.with(side, |port| port.counters())
    }

    /// Receives for ever: hands each message that is not the link's own to `handle`, which runs while
    /// the port is borrowed and so must not post, only pass on. No deadline: the
    /// ring behind the port holds some milliseconds, and what is lost when it overruns is counted.
    pub async fn listen(
        &self,
        side: Side,
        mut uart: RingBufferedUartRx<'static>,
        mut handle: impl FnMut(Message),
    ) -> ! {
        let mut bytes = [0; 128];
        loop {
            match uart.read(&mut bytes).await {
                Ok(count) => {
                    let now_us = Instant::now().as_micros();
                    self.with(side, |port| {
                        port.receive(now_us, &bytes[..count], &mut handle)
                    });
                }
                Err(Error::Overrun) => self.with(side, Port::on_overrun),
                Err(_) => self.with(side, Port::on_line_error),
            }
        }
    }

    /// Sends for ever what is posted. No deadline: a queue that fills up drops whole frames, counted.
    pub async fn speak(&self, side: Side, mut uart: UartTx<'static, Async>) -> ! {
        let mut bytes = [0; BURST_BYTES];
        loop {
            let count = self.with(side, |port| port.take(&mut bytes));
            if count == 0 {
                self.filled[side as usize].wait().await;
            } else if uart.write(&bytes[..count]).await.is_err() {
                self.with(side, Port::on_line_error);
            }
        }
    }
}
