//! The two serial ports of a board: USART2 to the other board, USART3 to the ST-LINK's console.

use core::cell::RefCell;

use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Error, UartTx};
use embassy_sync::blocking_mutex::ThreadModeMutex;
use embassy_sync::blocking_mutex::raw::{CriticalSectionRawMutex, ThreadModeRawMutex};
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use protocol::port::Port;
use protocol::receiver::Peer;
use protocol::{Console, Hello, Key, Latest, Message, PortCounters};

use crate::serial::Receiver;
use crate::side::Side;
use crate::stop;

/// Most bytes handed to a transmitter's DMA at once.
const BURST_BYTES: usize = 256;

/// What tasks of any priority want said on both ports; full only if the thread is held up for 8 ms.
pub static OUTBOX: Channel<CriticalSectionRawMutex, Message, 4> = Channel::new();

/// Says what a host asked for, if that leaves two places in the [`OUTBOX`] for what tasks with a deadline say (an estimate,
/// and a texture that still waits): else the host asks again.
pub fn reply(message: Message) {
    if OUTBOX.free_capacity() > 2 {
        let _ = OUTBOX.try_send(message);
    }
}

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

/// Both ports, shared by the tasks of the thread-mode executor, and what went through them last.
pub struct Ports {
    ends: ThreadModeMutex<RefCell<Ends>>,
    filled: [Signal<ThreadModeRawMutex, ()>; 2],
}

struct Ends {
    peer: Port,
    console: Console,
    latest: Latest,
}

impl Ends {
    fn port(&mut self, side: Side) -> (&mut Port, &mut Latest) {
        let port = match side {
            Side::Peer => &mut self.peer,
            Side::Console => self.console.port(),
        };
        (port, &mut self.latest)
    }
}

impl Ports {
    /// Two ports that introduce themselves with `hello`.
    pub fn new(hello: Hello) -> Self {
        Self {
            ends: ThreadModeMutex::new(RefCell::new(Ends {
                peer: Port::new(hello),
                console: Console::new(hello),
                latest: Latest::new(),
            })),
            filled: [Signal::new(), Signal::new()],
        }
    }

    fn with<R>(&self, side: Side, act: impl FnOnce(&mut Port, &mut Latest) -> R) -> R {
        let (result, filled) = self.ends.lock(|ends| {
            let ends = &mut *ends.borrow_mut();
            let (port, latest) = ends.port(side);
            let result = act(port, latest);
            (result, port.has_bytes())
        });
        if filled {
            self.filled[side as usize].signal(());
        }
        result
    }

    fn with_console<R>(&self, act: impl FnOnce(&mut Console) -> R) -> R {
        let (result, filled) = self.ends.lock(|ends| {
            let console = &mut ends.borrow_mut().console;
            let result = act(console);
            (result, console.port().has_bytes())
        });
        if filled {
            self.filled[Side::Console as usize].signal(());
        }
        result
    }

    /// Says `message` to whoever listens on either port.
    pub fn post(&self, message: &Message) {
        self.with(Side::Peer, |port, latest| {
            latest.said(message);
            port.post(message);
        });
        self.post_on(Side::Console, message);
    }

    /// Says `message` to whoever listens on one port.
    pub fn post_on(&self, side: Side, message: &Message) {
        self.with(side, |port, _| port.post(message));
    }

    /// Says a line to whoever reads the console, if it is a person.
    pub fn say(&self, line: &str) {
        self.with_console(|console| console.say(line));
    }

    /// Whether the console speaks text.
    pub fn speaks_text(&self) -> bool {
        self.with_console(|console| console.is_text())
    }

    /// Sends a Hello on each port where one is due; to be called at least every 100 ms. Returns what a
    /// person typed on the console.
    pub fn poll(&self) -> Option<Key> {
        let now_us = Instant::now().as_micros();
        self.with(Side::Peer, |port, _| port.poll(now_us));
        self.with_console(|console| console.poll(now_us))
    }

    /// The latest that was said or heard of surface and hand.
    pub fn latest(&self) -> Latest {
        self.ends.lock(|ends| ends.borrow().latest)
    }

    /// Whether the other end of a port has introduced itself and is understood.
    pub fn is_known(&self, side: Side) -> bool {
        self.with(side, |port, _| matches!(port.peer(), Peer::Known(_)))
    }

    /// What a port has counted.
    pub fn counters(&self, side: Side) -> PortCounters {
        self.with(side, |port, _| port.counters())
    }

    /// Receives for ever: hands each message that is not the link's own to `handle`, and the Hello of who asks for a
    /// greeting. That runs while the port is borrowed and so must not post, only pass on. No deadline: the
    /// ring behind the port holds some milliseconds, and what is lost when it overruns is counted.
    pub async fn listen(
        &self,
        side: Side,
        mut uart: Receiver,
        mut handle: impl FnMut(Message),
    ) -> ! {
        let mut bytes = [0; 128];
        loop {
            match uart.read(&mut bytes).await {
                Ok(count) => {
                    let now_us = Instant::now().as_micros();
                    self.with(side, |port, latest| {
                        port.receive(now_us, &bytes[..count], |message| {
                            latest.heard(now_us, &message);
                            stop::on(side, &message);
                            handle(message);
                        });
                        if port.take_asked()
                            && let Peer::Known(hello) = port.peer()
                        {
                            handle(Message::Hello(hello));
                        }
                    });
                }
                Err(Error::Overrun) => self.with(side, |port, _| port.on_overrun()),
                Err(_) => self.with(side, |port, _| port.on_line_error()),
            }
        }
    }

    /// Sends for ever what is posted. No deadline: a queue that fills up drops whole frames, counted.
    pub async fn speak(&self, side: Side, mut uart: UartTx<'static, Async>) -> ! {
        let mut bytes = [0; BURST_BYTES];
        loop {
            let count = self.with(side, |port, _| port.take(&mut bytes));
            if count == 0 {
                self.filled[side as usize].wait().await;
            } else if uart.write(&bytes[..count]).await.is_err() {
                self.with(side, |port, _| port.on_line_error());
            }
        }
    }
}
