//! The sensor board's tasks and what they pass to each other.

use core::cell::Cell;

use embassy_executor::Spawner;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer};
use firmware_sensor::arm::SILENCE_MS;
use firmware_sensor::capabilities::CAPABILITIES;
use firmware_sensor::{Drive, Sensor, Settings, line};
use nucleo::answer::answer;
use nucleo::console::ConsoleOutput;
use nucleo::ports::{OUTBOX, Ports, reply, report, speak};
use nucleo::serial::Receiver;
use nucleo::side::Side;
use nucleo::spawn::once;
use nucleo::stop;
use nucleo::supervision::supervise;
use protocol::{
    Arm, ArmState, Hello, Message, Motion, Question, RoleCounters, SensorConfiguration,
    SensorCounters, Stop, StreamGauges, Trip,
};
use static_cell::StaticCell;

use crate::board::{ARM_PWM_PERIOD, ArmDrive, Board, Sampler, ScansLost};

/// Time between two samples: the sampling task's deadline.
const SAMPLE_PERIOD: Duration = Duration::from_hz(firmware_sensor::SAMPLE_RATE_HZ as u64);
/// Time without a sample after which the arm rests, as after the same time without a motion.
const SILENCE: Duration = Duration::from_millis(SILENCE_MS as u64);

/// From the ports to the sampling task: the latest counts.
static MOTION: Signal<CriticalSectionRawMutex, Motion> = Signal::new();
static CONFIGURE: Signal<CriticalSectionRawMutex, SensorConfiguration> = Signal::new();
static STOP: Signal<CriticalSectionRawMutex, Stop> = Signal::new();
/// The longest time that anybody has asked for since the last sample, in ms.
static STREAM_MS: Mutex<CriticalSectionRawMutex, Cell<u16>> = Mutex::new(Cell::new(0));
/// What is in force, whichever port it came from.
static SETTINGS: Mutex<CriticalSectionRawMutex, Cell<Settings>> =
    Mutex::new(Cell::new(Settings::DEFAULT));
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
        trip,
        configuration,
        peer,
        console,
        vitals,
    } = board;
    let settings = Settings::restarted(configuration);
    SETTINGS.lock(|shared| shared.set(settings));
    let [major, minor, patch] = hello.version;
    defmt::info!("sensor {}.{}.{} started", major, minor, patch);
    sampling.spawn(once(sample(sampler, arm, *settings.configuration(), trip)));
    for (side, serial) in [(Side::Peer, peer), (Side::Console, console)] {
        spawner.spawn(once(listen(ports, side, serial.receiver)));
        spawner.spawn(once(speak(ports, side, serial.transmitter)));
    }
    spawner.spawn(once(report(ports)));
    spawner.spawn(once(answer(ports)));
    let counters = || RoleCounters::Sensor(COUNTERS.lock(Cell::get));
    let voice = ConsoleOutput {
        hello,
        line: line::line,
        help: &line::HELP,
        stop: |stop| {
            STOP.signal(stop);
            line::STOPPING
        },
    };
    spawner.spawn(once(supervise(ports, vitals, counters, voice)));
}

/// Samples, estimates, drives the arm. Deadline: one sample period, 1 ms. Missed, DMA goes on for
/// one more period and nothing is lost; missed twice, scans are lost and counted, and the filters
/// run on with what comes next. A Stop takes the drive off when it is heard, whether scans come or not.
#[embassy_executor::task]
async fn sample(
    mut sampler: Sampler,
    mut arm: ArmDrive,
    configuration: SensorConfiguration,
    persisted: Option<Trip>,
) {
    let mut sensor = Sensor::new(configuration);
    let mut counters = SensorCounters::default();
    let mut announced = Announced::default();
    if let Some(trip) = persisted {
        sensor.stop(trip);
    }
    arm.enable();
    // One that was stopped before its restart says so, whether scans come or not.
    Timer::after(ARM_PWM_PERIOD).await;
    announced.tell(sensor.arm());
    sampler.start();
    let mut served = Instant::now();
    loop {
        let sampled = match select(STOP.wait(), sampler.next()).await {
            // Said again, it changes nothing.
            Either::First(_) if sensor.arm().trip().is_some() => continue,
            Either::First(stop) => {
                let trip = stop.reason.trip();
                sensor.stop(trip);
                arm.set(Drive::default());
                nucleo::trip::latch(trip);
                Timer::after(ARM_PWM_PERIOD).await;
                announced.tell(sensor.arm());
                counters.stopped = Some(trip);
                COUNTERS.lock(|shared| shared.set(counters));
                continue;
            }
            Either::Second(sampled) => sampled,
        };
        announced.tell(sensor.arm());
        let (scans, encoder) = match sampled {
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
        if begun - served > SILENCE {
            // What the hand did and said meanwhile is not to be caught up with.
            MOTION.reset();
            sensor.pause();
        }
        served = begun;
        if let Some(configuration) = CONFIGURE.try_take() {
            sensor.configure(configuration);
        }
        if let Some(motion) = MOTION.try_take() {
            let taken = sensor.on_motion(&motion);
            counters.motions = counters.motions.wrapping_add(u32::from(taken));
        }
        sensor.stream_gauges(&StreamGauges {
            for_ms: STREAM_MS.lock(Cell::take),
        });
        let output = sensor.step(begun.as_micros(), &scans, encoder);
        arm.set(output.drive);
        counters.samples = counters.samples.wrapping_add(1);
        let stopped = sensor.arm().trip();
        if let Some(trip) = stopped
            && counters.stopped.is_none()
        {
            nucleo::trip::latch(trip);
        }
        counters.stopped = stopped;
        if let Some(estimate) = output.estimate {
            let taken = OUTBOX.try_send(Message::Estimate(estimate)).is_ok();
            counters.estimates = counters.estimates.wrapping_add(u32::from(taken));
        }
        if let Some(texture) = output.texture {
            // The next one says as much.
            let _ = OUTBOX.try_send(Message::Texture(texture));
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

/// What was said of the arm.
#[derive(Default)]
struct Announced {
    told: ArmState,
    is_off: bool,
}

impl Announced {
    /// A period of the PWM, or more, after the last commands went to the pins: says that a stopped arm's drive is
    /// off, and tells of each change as soon as there is room for the message.
    fn tell(&mut self, state: ArmState) {
        if let Some(trip) = state.trip()
            && !core::mem::replace(&mut self.is_off, true)
        {
            stop::OFF.signal(trip);
        }
        if state != self.told {
            let instant_us = Instant::now().as_micros();
            let arm = Message::Arm(Arm { instant_us, state });
            if OUTBOX.try_send(arm).is_ok() {
                self.told = state;
            }
        }
    }
}

/// Hears a port. See [`Ports::listen`].
#[embassy_executor::task(pool_size = 2)]
async fn listen(ports: &'static Ports, side: Side, uart: Receiver) {
    ports
        .listen(side, uart, |message| match message {
            Message::Motion(motion) => MOTION.signal(motion),
            Message::Stop(stop) => STOP.signal(stop),
            Message::StreamGauges(asked) => {
                STREAM_MS.lock(|longest| longest.set(longest.get().max(asked.for_ms)));
            }
            Message::Configure(asked) => {
                let (answer, settings) = SETTINGS.lock(|shared| {
                    let mut settings = shared.get();
                    let answer = settings.on_configure(&asked);
                    shared.set(settings);
                    (answer, settings)
                });
                if answer.refused.is_none() {
                    nucleo::kept_configuration::keep(&answer);
                    CONFIGURE.signal(*settings.configuration());
                }
                reply(Message::Configuration(answer));
            }
            Message::Question(question) => {
                let answer = match question {
                    Question::Configuration => {
                        Message::Configuration(SETTINGS.lock(Cell::get).report())
                    }
                    Question::Capabilities => Message::Capabilities(CAPABILITIES),
                };
                reply(answer);
            }
            _ => {}
        })
        .await
}
