//! Two fake boards that talk as real ones do: a hand that rubs to and fro over a surface of 2 mm, an arm
//! that follows, gauges that stream while they are asked for.

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use protocol::{
    Configuration, ConfigurationReport, Contact, DisplayConfiguration, DisplayCounters,
    DisplayState, Estimate, GAUGES, GaugeHealth, GaugeSample, Gauges, Message, Motion,
    PortCounters, Question, Refusal, ResetCause, Role, RoleCounters, Safety, SensorConfiguration,
    SensorCounters, Setting, Status, Stop, Trip,
};

use crate::fake_board::FakeBoard;

/// The surface's wavelength in mm.
pub const WAVELENGTH_MM: f32 = 2.0;
/// The hand's greatest velocity in mm/s, and how often it goes to and fro, in Hz.
pub const FASTEST_MM_S: f64 = 70.0;
/// Strokes to and fro a second.
pub const STROKES_HZ: f64 = 0.83;
/// Between two steps.
const STEP: Duration = Duration::from_millis(2);
/// A sample is so many sixteenths of an ADC step; mid-rail.
const MID_RAIL: f64 = 32_768.0;

/// Two fake boards.
pub struct FakeBench {
    /// The sensor board.
    pub sensor: FakeBoard,
    /// The display board.
    pub display: FakeBoard,
    /// The sensor's settings.
    pub sensing: SensorConfiguration,
    /// The display's settings.
    pub displaying: DisplayConfiguration,
    /// The supervisor's state.
    pub state: DisplayState,
    /// What the display was told to stop by, if it was.
    pub stopped: Option<Stop>,
    elapsed_ms: u64,
    streams_until_ms: u64,
}

impl FakeBench {
    /// Two boards that nobody has touched yet.
    pub fn new() -> Self {
        let board = |role| {
            let board = FakeBoard::new(role);
            // A monitor that a busy machine holds up loses nothing by that.
            board.lose_nothing();
            board
        };
        Self {
            sensor: board(Role::Sensor),
            display: board(Role::Display),
            sensing: SensorConfiguration::DEFAULT,
            displaying: DisplayConfiguration::DEFAULT,
            state: DisplayState::Driving,
            stopped: None,
            elapsed_ms: 0,
            streams_until_ms: 0,
        }
    }

    /// Whether the gauges are streamed for somebody.
    pub fn streams(&self) -> bool {
        self.elapsed_ms < self.streams_until_ms
    }

    /// What the boards say in the next 2 ms, and their answers to what they have heard.
    pub fn step(&mut self) {
        self.answer();
        let (ms, seconds) = (self.elapsed_ms, self.elapsed_ms as f64 / 1e3);
        let instant_us = ms * 1_000;
        let omega = TAU * STROKES_HZ;
        let position_mm = |seconds: f64| FASTEST_MM_S / omega * (1.0 - (omega * seconds).cos());
        let velocity_um_s = (FASTEST_MM_S * 1e3 * (omega * seconds).sin()) as i32;
        let sequence = |every_ms: u64| u32::try_from(ms / every_ms).unwrap_or(u32::MAX);
        self.display.say(Message::Motion(Motion {
            sequence: sequence(2),
            instant_us,
            // In counts of 5 µm.
            position_um: (position_mm(seconds) * 200.0) as i64 * 5,
            velocity_um_s,
        }));
        if ms.is_multiple_of(10) {
            self.sensor
                .say(Message::Estimate(estimate(sequence(10), velocity_um_s)));
        }
        if ms.is_multiple_of(8) && ms < self.streams_until_ms {
            let samples = std::array::from_fn(|sample| GaugeSample {
                codes: codes(position_mm(seconds + sample as f64 * 1e-3)),
                travel_um: 70,
            });
            self.sensor.say(Message::Gauges(Gauges {
                first_sample: sequence(1),
                instant_us,
                position_um: 0,
                samples,
            }));
        }
        if ms.is_multiple_of(1_000) {
            self.report();
        }
        self.elapsed_ms += 2;
    }

    fn report(&self) {
        let status = |role| Status {
            uptime_us: self.elapsed_ms * 1_000,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            stack_free_bytes: 0,
            peer: PortCounters {
                sent: 4_711,
                ..PortCounters::new()
            },
            console: PortCounters::new(),
            role,
        };
        let sensor = RoleCounters::Sensor(SensorCounters::ZERO);
        self.sensor.say(Message::Status(status(sensor)));
        let display = RoleCounters::Display(DisplayCounters {
            state: self.state,
            ..DisplayCounters::ZERO
        });
        self.display.say(Message::Status(status(display)));
    }

    /// The supervisor's state is another.
    pub fn turn(&mut self, state: DisplayState) {
        self.state = state;
        self.display.say(Message::Safety(Safety {
            instant_us: self.elapsed_ms * 1_000,
            state,
        }));
    }

    fn answer(&mut self) {
        for heard in self.sensor.take_heard() {
            if let Message::StreamGauges(asked) = heard {
                let until_ms = self.elapsed_ms + u64::from(asked.for_ms);
                self.streams_until_ms = self.streams_until_ms.max(until_ms);
            }
            if let Message::Question(Question::Configuration) = heard {
                let report = report(None, Configuration::Sensor(self.sensing));
                self.sensor.say(report);
            }
            if let Message::Configure(asked) = heard {
                let in_force = Configuration::Sensor(self.sensing);
                let mut refused = asked.check_replaces(in_force.hash()).err();
                match asked.configuration {
                    _ if refused.is_some() => {}
                    Configuration::Sensor(asked) => match asked.check() {
                        Ok(()) => self.sensing = asked,
                        Err(refusal) => refused = Some(refusal),
                    },
                    Configuration::Display(_) => refused = Some(OTHER_BOARD),
                }
                let report = report(refused, Configuration::Sensor(self.sensing));
                self.sensor.say(report);
            }
        }
        for heard in self.display.take_heard() {
            match heard {
                Message::Question(Question::Configuration) => {
                    let report = report(None, Configuration::Display(self.displaying));
                    self.display.say(report);
                }
                Message::Configure(asked) => {
                    let in_force = Configuration::Display(self.displaying);
                    let mut refused = asked.check_replaces(in_force.hash()).err();
                    match asked.configuration {
                        _ if refused.is_some() => {}
                        Configuration::Display(asked) => match asked.check() {
                            Ok(()) => self.displaying = asked,
                            Err(refusal) => refused = Some(refusal),
                        },
                        Configuration::Sensor(_) => refused = Some(OTHER_BOARD),
                    }
                    let report = report(refused, Configuration::Display(self.displaying));
                    self.display.say(report);
                }
                // The board itself answers.
                Message::Stop(stop) => {
                    self.stopped = Some(stop);
                    self.state = DisplayState::Stopped(Trip::Operator);
                }
                _ => {}
            }
        }
    }
}

impl Default for FakeBench {
    fn default() -> Self {
        Self::new()
    }
}

const OTHER_BOARD: Refusal = Refusal {
    setting: Setting::Role,
    index: 0,
    low: 0,
    high: 0,
};

fn report(refused: Option<Refusal>, configuration: Configuration) -> Message {
    Message::Configuration(ConfigurationReport::of(configuration, refused))
}

/// λ wanders by a few thousandths, the paper's count by what a count of whole crossings does.
fn estimate(sequence: u32, velocity_um_s: i32) -> Estimate {
    let wander = f32::from((sequence % 13) as i16 - 6) * 0.001;
    let slow = velocity_um_s.abs() < 15_000;
    let counted = [1.6, 2.0, 2.4][(sequence / 8 % 3) as usize];
    let mut health = [GaugeHealth::Good; GAUGES];
    health[4] = GaugeHealth::Hum;
    Estimate {
        sequence,
        instant_us: u64::from(sequence) * 10_000,
        wavelength_mm: Some(WAVELENGTH_MM + wander),
        valid: !slow,
        confidence: if slow { 0.41 } else { 0.97 },
        amplitude_lsb: 103.0,
        counted_mm: (!slow).then_some(counted),
        range: if slow {
            protocol::Range::T2
        } else {
            protocol::Range::T1
        },
        contact: Contact::Slip,
        velocity_um_s: velocity_um_s / 100 * 99,
        lag_um: None,
        gauges_used: 0b0_1111,
        health,
    }
}

fn codes(position_mm: f64) -> [u16; protocol::CHANNELS] {
    std::array::from_fn(|gauge| {
        let phase = TAU * position_mm / f64::from(WAVELENGTH_MM) + gauge as f64;
        let lsb = [100.0, 80.0, 120.0, 60.0, 30.0, 0.0][gauge];
        (MID_RAIL + 16.0 * lsb * phase.sin()) as u16
    })
}

/// A bench that goes on by itself. Dropping it pulls both cables.
pub struct Running {
    bench: Arc<Mutex<FakeBench>>,
    ended: Arc<AtomicBool>,
    steps: Option<JoinHandle<()>>,
}

impl Running {
    /// Has a bench go on in real time.
    pub fn new(bench: FakeBench) -> Self {
        let bench = Arc::new(Mutex::new(bench));
        let ended = Arc::new(AtomicBool::new(false));
        let (theirs, their_end) = (Arc::clone(&bench), Arc::clone(&ended));
        let steps = thread::spawn(move || {
            let mut next = Instant::now();
            while !their_end.load(Ordering::Acquire) {
                locked(&theirs).step();
                next += STEP;
                thread::park_timeout(next.saturating_duration_since(Instant::now()));
            }
        });
        Self {
            bench,
            ended,
            steps: Some(steps),
        }
    }

    /// The bench at this moment.
    pub fn bench(&self) -> MutexGuard<'_, FakeBench> {
        locked(&self.bench)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Release);
        if let Some(steps) = self.steps.take() {
            let _ = steps.join();
        }
    }
}

fn locked(bench: &Mutex<FakeBench>) -> MutexGuard<'_, FakeBench> {
    bench.lock().unwrap_or_else(PoisonError::into_inner)
}
