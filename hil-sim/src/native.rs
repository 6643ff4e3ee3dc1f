//! The engine that runs the firmware's libraries on the host, without any board.
//!
//! What the boards' timers do is done here in steps of 250 µs: each step an ADC scan, every second step
//! an output tick, every fourth the sensor's millisecond. A computation takes no time, and the words of
//! a tick are at the actuators at its instant. Every message is framed, sent byte by byte at 921 600
//! baud through the scene's weather, and decoded by the receiver at its first step after a byte's arrival.
//!
//! The hash is XXH3-64 over, in the order of their beginnings, each frame sent (`S` or `D` for the
//! board, the instant of its first bit in ns, its bytes) and each set of words (`W`, the instant, 50
//! words); all numbers little-endian.

use std::hash::Hasher;
use std::time::Instant;

use firmware_display::Display;
use firmware_sensor::{Drive, SCANS_PER_SAMPLE, Scan, Sensor};
use protocol::{
    CHANNELS, Estimate, Event, Hello, MAX_FRAME, Message, PortCounters, Receiver, ResetCause, Role,
    RoleCounters, Sender, SensorCounters, Status,
};
use twox_hash::XxHash3_64;

use crate::arm::Arm;
use crate::motion::encoder;
use crate::recording::{
    ACTUATORS, Engine, EstimateRecord, OutputRecord, Recording, ScanRecord, TickRecord,
};
use crate::scene::{Scene, SceneError};
use crate::weather::{BYTE_NS, Weather};
use crate::world::World;

const STEP_NS: u64 = 1_000_000_000 / firmware_sensor::SCAN_RATE_HZ as u64;
const STEPS_PER_TICK: u64 = (firmware_sensor::SCAN_RATE_HZ / firmware_display::TICK_RATE_HZ) as u64;
const STEPS_PER_STATUS: u64 = firmware_sensor::SCAN_RATE_HZ as u64;
/// What a host calls itself in a Hello.
const CHIP: &str = "host";
const VERSION: [u8; 3] = [
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
];

const fn number(text: &str) -> u8 {
    match u8::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("a version's part is above 255"),
    }
}

/// Runs a scene.
pub fn run(scene: &Scene) -> Result<Recording, SceneError> {
    let mut pair = Pair::new(scene)?;
    let steps = (scene.duration_s * f64::from(firmware_sensor::SCAN_RATE_HZ)).round() as u64;
    let started = Instant::now();
    for step in 0..steps {
        pair.step(step);
    }
    let wall_s = started.elapsed().as_secs_f64();
    Ok(pair.into_recording(scene.duration_s, wall_s))
}

/// Both boards, the wires between them, and the world around them.
struct Pair {
    world: World,
    arm: Arm,
    sensor: Sensor,
    scans: [Scan; SCANS_PER_SAMPLE],
    drive: Drive,
    sensor_counters: SensorCounters,
    display: Display,
    sensor_port: Port,
    display_port: Port,
    tape: Tape,
}

impl Pair {
    fn new(scene: &Scene) -> Result<Self, SceneError> {
        let port = |role, mark, direction| Port {
            sender: Sender::new(Hello::new(role, CHIP, VERSION)),
            receiver: Receiver::new(),
            wire: Weather::new(&scene.link, scene.seed, direction),
            free_ns: 0,
            mark,
        };
        Ok(Self {
            world: World::new(scene)?,
            arm: Arm::new(&scene.arm, &scene.motion),
            sensor: Sensor::new(scene.sensor_configuration()),
            scans: [[0; CHANNELS]; SCANS_PER_SAMPLE],
            drive: Drive::default(),
            sensor_counters: SensorCounters::default(),
            display: Display::new(scene.display_configuration()),
            sensor_port: port(Role::Sensor, b'S', 0),
            display_port: port(Role::Display, b'D', 1),
            tape: Tape::new(scene.duration_s),
        })
    }

    fn step(&mut self, step: u64) {
        let now_ns = step * STEP_NS;
        let t_s = step as f64 / f64::from(firmware_sensor::SCAN_RATE_HZ);
        self.hear(now_ns);
        self.sensor_port.greet(now_ns, &mut self.tape.hash);
        self.display_port.greet(now_ns, &mut self.tape.hash);
        self.scan(step, now_ns, t_s);
        if step.is_multiple_of(STEPS_PER_TICK) {
            self.tick(now_ns, t_s);
        }
        if step > 0 && step.is_multiple_of(STEPS_PER_STATUS) {
            let (sensor, display) = self.statuses(now_ns);
            self.sensor_port
                .send(now_ns, &Message::Status(sensor), &mut self.tape.hash);
            self.display_port
                .send(now_ns, &Message::Status(display), &mut self.tape.hash);
        }
    }

    /// Hands on all that has arrived at either board.
    fn hear(&mut self, now_ns: u64) {
        let Self {
            sensor,
            display,
            sensor_port,
            display_port,
            sensor_counters,
            tape,
            ..
        } = self;
        sensor_port.hear(&mut display_port.wire, now_ns, |_, message| {
            if let Message::Motion(motion) = message
                && sensor.on_motion(&motion)
            {
                sensor_counters.motions = sensor_counters.motions.wrapping_add(1);
            }
        });
        display_port.hear(
            &mut sensor_port.wire,
            now_ns,
            |due_ns, message| match message {
                Message::Estimate(estimate) => {
                    tape.received(&estimate, due_ns);
                    display.on_estimate(&estimate);
                }
                Message::Stop(_) => display.stop(),
                _ => {}
            },
        );
    }

    /// An ADC scan and, with every fourth, the sensor's millisecond.
    fn scan(&mut self, step: u64, now_ns: u64, t_s: f64) {
        let position_mm = self.arm.position_mm(t_s);
        let codes = self.world.codes(t_s, position_mm);
        let encoder = encoder(position_mm);
        self.tape.scans.push(ScanRecord {
            at_ns: now_ns,
            codes,
            encoder,
            position_mm,
        });
        let place = (step % SCANS_PER_SAMPLE as u64) as usize;
        self.scans[place] = codes;
        if place + 1 < SCANS_PER_SAMPLE {
            return;
        }
        let output = self.sensor.step(now_ns / 1_000, &self.scans, encoder);
        self.sensor_counters.samples = self.sensor_counters.samples.wrapping_add(1);
        if output.drive != self.drive {
            self.drive = output.drive;
            self.arm.command(t_s, self.command_mm_s());
        }
        if let Some(estimate) = output.estimate {
            self.tape.estimates.push(EstimateRecord {
                made_ns: now_ns,
                received_ns: None,
                estimate,
            });
            let sent =
                self.sensor_port
                    .send(now_ns, &Message::Estimate(estimate), &mut self.tape.hash);
            self.sensor_counters.estimates =
                self.sensor_counters.estimates.wrapping_add(u32::from(sent));
        }
        if let Some(gauges) = output.gauges {
            self.sensor_port
                .send(now_ns, &Message::Gauges(gauges), &mut self.tape.hash);
        }
    }

    /// The display's output tick.
    fn tick(&mut self, now_ns: u64, t_s: f64) {
        let position_mm = self.world.hand_position_mm(t_s);
        let encoder = encoder(position_mm);
        self.tape.ticks.push(TickRecord {
            at_ns: now_ns,
            encoder,
            position_mm,
        });
        if self.display.tick(encoder) {
            self.tape.output(now_ns, self.display.words());
        }
        if let Some(motion) = self.display.motion(now_ns / 1_000) {
            self.display_port
                .send(now_ns, &Message::Motion(motion), &mut self.tape.hash);
        }
    }

    /// The velocity that the drive's PWM asks for.
    fn command_mm_s(&self) -> f64 {
        let full_mm_s = f64::from(self.sensor.configuration().arm_full_scale_um_s) / 1_000.0;
        let speed_mm_s = full_mm_s * f64::from(self.drive.duty) / f64::from(Drive::FULL);
        if self.drive.forward {
            speed_mm_s
        } else {
            -speed_mm_s
        }
    }

    fn statuses(&self, now_ns: u64) -> (Status, Status) {
        let status = |port: &Port, role| Status {
            uptime_us: now_ns / 1_000,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            peer: port.counters(),
            console: PortCounters::default(),
            role,
        };
        (
            status(
                &self.sensor_port,
                RoleCounters::Sensor(self.sensor_counters),
            ),
            status(
                &self.display_port,
                RoleCounters::Display(self.display.counters()),
            ),
        )
    }

    fn into_recording(self, duration_s: f64, wall_s: f64) -> Recording {
        let (sensor, display) = self.statuses((duration_s * 1e9).round() as u64);
        Recording {
            engine: Engine::Native,
            duration_s,
            warm_up_s: 0.0,
            wall_s,
            hash: self.tape.hash.finish(),
            scans: self.tape.scans,
            ticks: self.tape.ticks,
            estimates: self.tape.estimates,
            outputs: self.tape.outputs,
            sensor_status: Some(sensor),
            display_status: Some(display),
            log: Vec::new(),
        }
    }
}

/// A board's port towards the other board, and the wire that leads away from it.
struct Port {
    sender: Sender,
    receiver: Receiver,
    wire: Weather,
    /// When the wire has carried all that was sent so far.
    free_ns: u64,
    /// The board's mark in the hash.
    mark: u8,
}

impl Port {
    /// Says Hello if it is time to.
    fn greet(&mut self, now_ns: u64, hash: &mut XxHash3_64) {
        if let Some(hello) = self.sender.hello_due(now_ns / 1_000) {
            self.send(now_ns, &hello, hash);
        }
    }

    /// Puts a message on the wire behind what is there already. False if the peer is not greeted yet.
    fn send(&mut self, now_ns: u64, message: &Message, hash: &mut XxHash3_64) -> bool {
        let mut out = [0; MAX_FRAME];
        let Some(frame) = self.sender.encode(message, &mut out) else {
            return false;
        };
        let start_ns = self.free_ns.max(now_ns);
        hash.write(&[self.mark]);
        hash.write(&start_ns.to_le_bytes());
        hash.write(frame);
        self.free_ns = start_ns;
        for &byte in frame {
            self.free_ns += BYTE_NS;
            self.wire.push(self.free_ns, byte);
        }
        true
    }

    /// Takes what has arrived over the peer's `wire`, and hands on each message with its last byte's
    /// arrival.
    fn hear(&mut self, wire: &mut Weather, now_ns: u64, mut handle: impl FnMut(u64, Message)) {
        let Self {
            sender, receiver, ..
        } = self;
        let mut bytes = [0; 64];
        let mut length = 0;
        while let Some((due_ns, byte)) = wire.pop(now_ns) {
            bytes[length] = byte;
            length += 1;
            let more =
                length < bytes.len() && wire.next_due().is_some_and(|due_ns| due_ns <= now_ns);
            // A frame's end closes a portion, so that its instant is known.
            if byte != 0 && more {
                continue;
            }
            receiver.receive(&bytes[..length], |event| match event {
                Event::Message(message) => handle(due_ns, message),
                Event::Greeted(hello) => sender.on_greeting(hello.asks != 0),
                Event::Foreign(_) => sender.on_foreign(),
                Event::Unheralded => sender.on_unheralded(),
            });
            length = 0;
        }
    }

    fn counters(&self) -> PortCounters {
        PortCounters {
            sent: self.sender.sent(),
            ..self.receiver.counters()
        }
    }
}

/// What is written down while the pair runs.
struct Tape {
    hash: XxHash3_64,
    scans: Vec<ScanRecord>,
    ticks: Vec<TickRecord>,
    estimates: Vec<EstimateRecord>,
    outputs: Vec<OutputRecord>,
}

impl Tape {
    /// An empty tape with room for `duration_s`.
    fn new(duration_s: f64) -> Self {
        let room = |rate_hz: u32| (duration_s * f64::from(rate_hz)).ceil() as usize + 1;
        Self {
            hash: XxHash3_64::new(),
            scans: Vec::with_capacity(room(firmware_sensor::SCAN_RATE_HZ)),
            ticks: Vec::with_capacity(room(firmware_display::TICK_RATE_HZ)),
            estimates: Vec::with_capacity(room(firmware_sensor::ESTIMATE_RATE_HZ)),
            outputs: Vec::with_capacity(room(firmware_display::TICK_RATE_HZ)),
        }
    }

    fn output(&mut self, at_ns: u64, words: &[u16; ACTUATORS]) {
        let mut bytes = [0; 2 * ACTUATORS];
        for (place, word) in bytes.chunks_exact_mut(2).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        self.hash.write(b"W");
        self.hash.write(&at_ns.to_le_bytes());
        self.hash.write(&bytes);
        self.outputs.push(OutputRecord {
            at_ns,
            words: *words,
            skew_ns: 0,
        });
    }

    fn received(&mut self, estimate: &Estimate, due_ns: u64) {
        // The sensor counts its estimates from its start, as the tape does.
        if let Some(record) = self.estimates.get_mut(estimate.sequence as usize) {
            record.received_ns = Some(due_ns);
        }
    }
}
