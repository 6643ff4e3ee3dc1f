//! The sensor board's tasks and what they pass to each other.

use core::cell::Cell;

use embassy_executor::Spawner;
use embassy_stm32::usart::RingBufferedUartRx;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant};
use firmware_sensor::{Sensor, line};
use nucleo::console::ConsoleOutput;
use nucleo::ports::{OUTBOX, Ports, Side, report, speak};
use nucleo::spawn::once;
use nucleo::supervision::supervise;
use protocol::{
    Configuration, ConfigurationReport, Hello, Message, Motion, Refusal, RoleCounters,
    SensorConfiguration, SensorCounters, Setting,
};
use static_cell::StaticCell;

use crate::board::{ArmDrive, Board, Sampler, ScansLost};

/// Time between two samples: the sampling task's deadline.
const SAMPLE_PERIOD: Duration = Duration::from_hz(firmware_sensor::SAMPLE_RATE_HZ as u64);

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
        vitals,
    } = board;
    let [major, minor, patch] = hello.version;
    defmt::info!("sensor {}.{}.{} started", major, minor, patch);
    sampling.spawn(once(sample(sampler, arm)));
    for (side, serial) in [(Side::Peer, peer), (Side::Console, console)] {
        spawner.spawn(once(listen(ports, side, serial.receiver)));
        spawner.spawn(once(speak(ports, side, serial.transmitter)));
    }
    spawner.spawn(once(report(ports)));
    let counters = || RoleCounters::Sensor(COUNTERS.lock(Cell::get));
    let voice = ConsoleOutput {
        hello,
        line: line::line,
        help: &line::HELP,
        stop: || line::NOT_STOPPING,
    };
    spawner.spawn(once(supervise(ports, vitals, counters, voice)));
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
        // Saturating: on the emulator the clock was seen to step back where the time driver's half period
        // ends, and a board must not stop for that.
        let took = Instant::now().saturating_duration_since(begun);
        counters.deadline_misses = counters
            .deadline_misses
            .wrapping_add(u32::from(took > SAMPLE_PERIOD));
        COUNTERS.lock(|shared| shared.set(counters));
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
                        Err(refusal) => Some(refusal),
                    },
                    Configuration::Display(_) => Some(Refusal {
                        setting: Setting::Role,
                        index: 0,
                        low: 0,
                        high: 0,
                    }),
                };
                let configuration = Configuration::Sensor(CONFIGURATION.lock(Cell::get));
                let answer = ConfigurationReport {
                    refused,
                    hash: configuration.hash(),
                    configuration,
                };
                // Full only if the thread is held up: the host asks again.
                let _ = OUTBOX.try_send(Message::Configuration(answer));
            }
            _ => {}
        })
        .await
}
