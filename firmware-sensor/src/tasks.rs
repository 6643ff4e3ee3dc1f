//! The sensor board's tasks and what they pass to each other.

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
use firmware_sensor::Sensor;
use nucleo::ports::{Ports, Side};
use protocol::{
    Configuration, ConfigurationReport, Hello, Message, Motion, ResetCause, RoleCounters,
    SensorConfiguration, SensorCounters, Setting, Status,
};
use static_cell::StaticCell;

use crate::board::{ArmDrive, Board, Sampler, ScansLost};

/// Time between two samples: the sampling task's deadline.
const SAMPLE_PERIOD: Duration = Duration::from_hz(firmware_sensor::SAMPLE_RATE_HZ as u64);
const CARE_PERIOD: Duration = Duration::from_millis(50);
const STATUS_PERIOD: Duration = Duration::from_secs(1);

/// From the sampling task to the ports; full only if the thread is held up for 40 ms.
static OUTBOX: Channel<CriticalSectionRawMutex, Message, 4> = Channel::new();
/// From the ports to the sampling task: the latest counts.
static MOTION: Signal<CriticalSectionRawMutex, Motion> = Signal::new();
static CONFIGURE: Signal<CriticalSectionRawMutex, SensorConfiguration> = Signal::new();
/// The configuration in force, whichever port it came from.
static CONFIGURATION: Mutex<CriticalSectionRawMutex, Cell<SensorConfiguration>> =
    Mutex::new(Cell::new(SensorConfiguration::DEFAULT));
/// What the sampling task has counted so far.
static COUNTERS: Mutex<CriticalSectionRawMutex, Cell<SensorCounters>> =
    Mutex::new(Cell::new(SensorCounters::ZERO));

/// Starts every task.
pub fn start(spawner: Spawner, board: Board, hello: Hello) {
    static PORTS: StaticCell<Ports> = StaticCell::new();
    let ports: &'static Ports = PORTS.init(Ports::new(hello));
    let Board {
        sampling,
        sampler,
        arm,
        peer,
        console,
        watchdog,
        link_led,
        started,
    } = board;
    defmt::info!(
        "sensor {}.{}.{} started",
        hello.version[0],
        hello.version[1],
        hello.version[2]
    );
    let tasks = (
        sample(sampler, arm),
        listen(ports, Side::Peer, peer.0),
        speak(ports, Side::Peer, peer.1),
        listen(ports, Side::Console, console.0),
        speak(ports, Side::Console, console.1),
        report(ports),
        care(ports, watchdog, link_led, started),
    );
    let (
        Ok(sample),
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
    sampling.spawn(sample);
    for task in [hear_peer, hear_host] {
        spawner.spawn(task);
    }
    for task in [tell_peer, tell_host] {
        spawner.spawn(task);
    }
    spawner.spawn(report);
    spawner.spawn(care);
}

/// Samples, estimates, drives the arm. Deadline: one sample period, 1 ms. Missed, DMA goes on for
/// one more period and nothing is lost; missed twice, scans are lost and counted, and the filters
/// run on with what comes next.
#[embassy_executor::task]
async fn sample(mut sampler: Sampler, mut arm: ArmDrive) {
    let mut sensor = Sensor::new(SensorConfiguration::default());
    let mut counters = SensorCounters::default();
    arm.enable();
    sampler.start();
    loop {
        let (scans, encoder) = match sampler.next().await {
            Ok(sample) => sample,
            Err(lost) => {
                let count = match lost {
                    ScansLost::Converter => &mut counters.adc_overruns,
                    ScansLost::Ring => &mut counters.dma_overruns,
                };
                *count = count.wrapping_add(1);
                continue;
            }
        };
        let begun = Instant::now();
        if let Some(configuration) = CONFIGURE.try_take() {
            sensor.configure(configuration);
        }
        if let Some(motion) = MOTION.try_take() {
            sensor.on_motion(&motion);
            counters.motions = counters.motions.wrapping_add(1);
        }
        let output = sensor.step(begun.as_micros(), &scans, encoder);
        arm.set(output.drive);
        counters.samples = counters.samples.wrapping_add(1);
        if let Some(estimate) = output.estimate {
            let taken = OUTBOX.try_send(Message::Estimate(estimate)).is_ok();
            counters.estimates = counters.estimates.wrapping_add(u32::from(taken));
        }
        if let Some(gauges) = output.gauges {
            // A block that finds no room shows as a gap in `first_sample`.
            let _ = OUTBOX.try_send(Message::Gauges(gauges));
        }
        counters.deadline_misses = counters
            .deadline_misses
            .wrapping_add(u32::from(begun.elapsed() > SAMPLE_PERIOD));
        COUNTERS.lock(|shared| shared.set(counters));
    }
}

/// Puts what the sampling task made on both ports. Deadline: 10 ms, the next estimate.
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
            Message::Motion(motion) => MOTION.signal(motion),
            Message::Configure(asked) => {
                let refused = match asked {
                    Configuration::Sensor(asked) => match asked.check() {
                        Ok(()) => {
                            CONFIGURATION.lock(|current| current.set(asked));
                            CONFIGURE.signal(asked);
                            None
                        }
                        Err(setting) => Some(setting),
                    },
                    Configuration::Display(_) => Some(Setting::Role),
                };
                let configuration = Configuration::Sensor(CONFIGURATION.lock(Cell::get));
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

/// Greets, sends the counters, and feeds the watchdog as long as samples come. Deadline: 400 ms, the
/// watchdog's.
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
    let mut samples_before = None;
    defmt::info!(
        "reset by {}, watchdog resets {}",
        defmt::Debug2Format(&reset),
        watchdog_resets
    );
    loop {
        let counters = COUNTERS.lock(Cell::get);
        if samples_before != Some(counters.samples) {
            watchdog.pet();
        }
        samples_before = Some(counters.samples);
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
                role: RoleCounters::Sensor(counters),
            }));
        }
        ticker.next().await;
    }
}
