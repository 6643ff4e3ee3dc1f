//! The display board's tasks and what they pass to each other.

use core::cell::{Cell, RefCell};

use embassy_executor::Spawner;
use embassy_stm32::usart::RingBufferedUartRx;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use firmware_display::{Display, Settings};
use nucleo::care::care;
use nucleo::ports::{OUTBOX, Ports, Side, report, speak};
use nucleo::spawn::once;
use protocol::{
    DisplayConfiguration, DisplayCounters, Estimate, Hello, Message, RoleCounters, Stop,
};
use static_cell::StaticCell;

use crate::board::{Board, Clear, Dacs, Ticks};
use crate::chain::Fault;

/// From the ports to the output task: the latest counts.
static ESTIMATE: Signal<CriticalSectionRawMutex, Estimate> = Signal::new();
static STOP: Signal<CriticalSectionRawMutex, Stop> = Signal::new();
static CONFIGURE: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// What is in force, whichever port it came from.
static SETTINGS: Mutex<CriticalSectionRawMutex, RefCell<Settings>> =
    Mutex::new(RefCell::new(Settings::DEFAULT));
/// What the output task has counted so far.
static COUNTERS: Mutex<CriticalSectionRawMutex, Cell<DisplayCounters>> =
    Mutex::new(Cell::new(DisplayCounters::ZERO));

/// Starts every task.
pub fn start(spawner: Spawner, board: Board, hello: Hello) {
    static PORTS: StaticCell<Ports> = StaticCell::new();
    let ports: &'static Ports = PORTS.init(Ports::new(hello));
    let Board {
        output,
        ticks,
        dacs,
        peer,
        console,
        vitals,
    } = board;
    let [major, minor, patch] = hello.version;
    defmt::info!("display {}.{}.{} started", major, minor, patch);
    output.spawn(once(drive(ticks, dacs)));
    for (side, serial) in [(Side::Peer, peer), (Side::Console, console)] {
        spawner.spawn(once(listen(ports, side, serial.receiver)));
        spawner.spawn(once(speak(ports, side, serial.transmitter)));
    }
    spawner.spawn(once(report(ports)));
    spawner.spawn(once(care(ports, vitals, || {
        RoleCounters::Display(COUNTERS.lock(Cell::get))
    })));
}

/// Reads the hand, moves the phase, starts fifty voltages on their way. Deadline: one tick, 500 µs, for
/// them to arrive. Missed, they are given up, the next output carries the travel of both ticks, and the
/// miss is counted; missed four times in a row, the hardware lets CLR fall and all outputs go to 0 V.
#[embassy_executor::task]
async fn drive(mut ticks: Ticks, mut dacs: Dacs) {
    let mut display = Display::new(DisplayConfiguration::default());
    let mut deadline_misses = 0u32;
    let mut spi_errors = u32::from(dacs.start().is_err());
    ticks.start();
    loop {
        let (encoder, missed) = ticks.next().await;
        deadline_misses = deadline_misses.wrapping_add(missed);
        match dacs.finish() {
            Ok(Clear::Held) => {}
            Ok(Clear::Fell) => display.resend(),
            Err(Fault::Transfer) => {
                spi_errors = spi_errors.wrapping_add(1);
                display.resend();
            }
            Err(Fault::Stall) => {
                deadline_misses = deadline_misses.wrapping_add(1);
                display.resend();
            }
        }
        if STOP.try_take().is_some() {
            display.stop();
        }
        if CONFIGURE.try_take().is_some() {
            SETTINGS.lock(|settings| display.configure(*settings.borrow().configuration()));
        }
        if let Some(estimate) = ESTIMATE.try_take() {
            display.on_estimate(&estimate);
        }
        if display.tick(encoder) {
            dacs.update(display.words());
        }
        if let Some(motion) = display.motion(Instant::now().as_micros()) {
            // A motion that finds no room shows as a gap in its sequence.
            let _ = OUTBOX.try_send(Message::Motion(motion));
        }
        let counters = DisplayCounters {
            deadline_misses,
            spi_errors,
            ..display.counters()
        };
        COUNTERS.lock(|shared| shared.set(counters));
    }
}

/// Hears a port. See [`Ports::listen`].
#[embassy_executor::task(pool_size = 2)]
async fn listen(ports: &'static Ports, side: Side, uart: RingBufferedUartRx<'static>) {
    ports
        .listen(side, uart, |message| match message {
            Message::Estimate(estimate) => ESTIMATE.signal(estimate),
            Message::Stop(stop) => STOP.signal(stop),
            Message::Actuators(block) => {
                let refused = SETTINGS.lock(|settings| settings.borrow_mut().on_actuators(&block));
                if let Some(answer) = refused {
                    let _ = OUTBOX.try_send(Message::Configuration(answer));
                }
            }
            Message::Configure(asked) => {
                let answer = SETTINGS.lock(|settings| settings.borrow_mut().on_configure(&asked));
                if answer.refused.is_none() {
                    CONFIGURE.signal(());
                }
                // Full only if the thread is held up: the host asks again.
                let _ = OUTBOX.try_send(Message::Configuration(answer));
            }
            _ => {}
        })
        .await
}
