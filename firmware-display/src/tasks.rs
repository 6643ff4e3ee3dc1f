//! The display board's tasks and what they pass to each other.

use core::cell::Cell;

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::usart::{RingBufferedUartRx, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Ticker};
use firmware_display::Display;
use nucleo::ports::{Ports, Side};
use protocol::{
    Configuration, ConfigurationReport, DisplayConfiguration, DisplayCounters, Estimate, Hello,
    Message, ResetCause, RoleCounters, Setting, Status, Stop,
};
use static_cell::StaticCell;

use crate::board::{Board, Clear, Dacs, Ticks};
use crate::chain::Fault;

const CARE_PERIOD: Duration = Duration::from_millis(50);
const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// From the output task to the ports; full only if the thread is held up for 8 ms.
static OUTBOX: Channel<CriticalSectionRawMutex, Message, 4> = Channel::new();
/// From the ports to the output task: the latest counts.
static ESTIMATE: Signal<CriticalSectionRawMutex, Estimate> = Signal::new();
static STOP: Signal<CriticalSectionRawMutex, Stop> = Signal::new();
static CONFIGURE: Signal<CriticalSectionRawMutex, DisplayConfiguration> = Signal::new();
/// The configuration in force, whichever port it came from.
static CONFIGURATION: Mutex<CriticalSectionRawMutex, Cell<DisplayConfiguration>> =
    Mutex::new(Cell::new(DisplayConfiguration::DEFAULT));
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
        watchdog,
        link_led,
        started,
    } = board;
    defmt::info!(
        "display {}.{}.{} started",
        hello.version[0],
        hello.version[1],
        hello.version[2]
    );
    let tasks = (
        drive(ticks, dacs),
        listen(ports, Side::Peer, peer.0),
        speak(ports, Side::Peer, peer.1),
        listen(ports, Side::Console, console.0),
        speak(ports, Side::Console, console.1),
        report(ports),
        care(ports, watchdog, link_led, started),
    );
    let (
        Ok(drive),
        Ok(hear_peer),
        Ok(tell_peer),
        Ok(hear_host),
        Ok(tell_host),
        Ok(report),
        Ok(care),
    ) = tasks
    else {
        defmt::panic!("each task is spawned once");
    };
    output.spawn(drive);
    for task in [hear_peer, hear_host] {
        spawner.spawn(task);
    }
    for task in [tell_peer, tell_host] {
        spawner.spawn(task);
    }
    spawner.spawn(report);
    spawner.spawn(care);
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
        if let Some(configuration) = CONFIGURE.try_take() {
            display.configure(configuration);
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

/// Puts what the output task made on both ports. Deadline: 2 ms, the next motion.
#[embassy_executor::task]
async fn report(ports: &'static Ports) {
    loop {
        let message = OUTBOX.receive().await;
        ports.post(&message);
    }
}

/// Hears a port. See [`Ports::listen`].
#[embassy_executor::task(pool_size = 2)]
async fn listen(ports: &'static Ports, side: Side, uart: RingBufferedUartRx<'static>) {
    ports
        .listen(side, uart, |message| match message {
            Message::Estimate(estimate) => ESTIMATE.signal(estimate),
            Message::Stop(stop) => STOP.signal(stop),
            Message::Configure(asked) => {
                let refused = match asked {
                    Configuration::Display(asked) => match asked.check() {
                        Ok(()) => {
                            CONFIGURATION.lock(|current| current.set(asked));
                            CONFIGURE.signal(asked);
                            None
                        }
                        Err(setting) => Some(setting),
                    },
                    Configuration::Sensor(_) => Some(Setting::Role),
                };
                let configuration = Configuration::Display(CONFIGURATION.lock(Cell::get));
                let answer = ConfigurationReport {
                    refused,
                    configuration,
                };
                // Full only if the thread is held up: the host asks again.
                let _ = OUTBOX.try_send(Message::Configuration(answer));
            }
            _ => {}
        })
        .await
}

/// Talks on a port. See [`Ports::speak`].
#[embassy_executor::task(pool_size = 2)]
async fn speak(ports: &'static Ports, side: Side, uart: UartTx<'static, Async>) {
    ports.speak(side, uart).await
}

/// Greets, sends the counters, and feeds the watchdog as long as ticks are served. Deadline: 400 ms,
/// the watchdog's.
#[embassy_executor::task]
async fn care(
    ports: &'static Ports,
    mut watchdog: IndependentWatchdog<'static, IWDG>,
    mut link_led: Output<'static>,
    started: (ResetCause, u32),
) {
    let (reset, watchdog_resets) = started;
    let mut ticker = Ticker::every(CARE_PERIOD);
    let mut next_status = Instant::now() + STATUS_PERIOD;
    let mut ticks_before = None;
    defmt::info!(
        "reset by {}, watchdog resets {}",
        defmt::Debug2Format(&reset),
        watchdog_resets
    );
    loop {
        let counters = COUNTERS.lock(Cell::get);
        if ticks_before != Some(counters.ticks) {
            watchdog.pet();
        }
        ticks_before = Some(counters.ticks);
        ports.poll();
        link_led.set_level(if ports.is_known(Side::Peer) {
            Level::High
        } else {
            Level::Low
        });
        if Instant::now() >= next_status {
            next_status += STATUS_PERIOD;
            ports.post(&Message::Status(Status {
                uptime_us: Instant::now().as_micros(),
                reset,
                watchdog_resets,
                peer: ports.counters(Side::Peer),
                console: ports.counters(Side::Console),
                role: RoleCounters::Display(counters),
            }));
        }
        ticker.next().await;
    }
}
