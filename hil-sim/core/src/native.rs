//! The engine that runs the firmware's libraries on the host, without any board.
//!
//! What the boards' timers do is done here in steps of 250 µs: each step an ADC scan, every second step
//! an output tick, every fourth the sensor's millisecond. A computation takes no time, and the words of
//! a tick are at the actuators at its instant. Every message is framed, sent byte by byte at 921 600
//! baud through the scene's weather, and decoded by the receiver at its first step after a byte's arrival.
//!
//! The hash is taken in the order of their beginnings over each frame sent, with the instant of its
//! first bit, and each set of words, with its instant.

pub mod rendered;

use std::time::Instant;

use crate::link::channel::LinkChannel;
use crate::link::impairments::BYTE_NS;
use crate::plant::arm::Arm;
use crate::plant::fault::clock::Clock;
use crate::plant::fault::encoder::EncoderFaults;
use crate::plant::fault::gauges::GaugeFaults;
use crate::plant::motion::encoder;
use crate::plant::world::World;
use crate::run::decoder::TimedMessage;
use crate::run::digest::Digest;
use crate::run::observer::{RunEvent, RunObserver};
use crate::run::recording::{
    Arrival, Engine, OutputRecord, Ran, Recording, ScanRecord, TickRecord,
};
use crate::scene::fault::Fault;
use crate::scene::fault::catalogue::Needs;
use crate::scene::{Scene, SceneError};
use firmware_display::{Display, Senses};
use firmware_sensor::{Drive, SCANS_PER_SAMPLE, Scan, Sensor};
use protocol::{
    CHANNELS, DisplayState, Hello, MAX_FRAME, Message, Port, PortCounters, ResetCause, Role,
    RoleCounters, Safety, SensorCounters, Status,
};

const STEP_NS: u64 = 1_000_000_000 / firmware_sensor::SCAN_RATE_HZ as u64;
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

/// Runs a scene and writes everything down.
///
/// # Errors
/// If the scene cannot be run.
pub fn run(scene: &Scene) -> Result<Recording, SceneError> {
    let mut recording = Recording::empty(Engine::Native, scene.duration_s);
    let ran = run_before(scene, &mut recording)?;
    recording.end(&ran);
    Ok(recording)
}

/// Runs a scene before an onlooker; nothing else is kept.
///
/// # Errors
/// If the scene cannot be run.
pub fn run_before(scene: &Scene, onlooker: &mut impl RunObserver) -> Result<Ran, SceneError> {
    let mut pair = Pair::new(scene, onlooker)?;
    let steps = (scene.duration_s * f64::from(firmware_sensor::SCAN_RATE_HZ)).round() as u64;
    let started = Instant::now();
    for step in 0..steps {
        pair.step(step);
    }
    let wall_s = started.elapsed().as_secs_f64();
    let (sensor, display) = pair.statuses((scene.duration_s * 1e9).round() as u64);
    Ok(Ran {
        engine: Engine::Native,
        duration_s: scene.duration_s,
        warm_up_s: 0.0,
        wall_s,
        hash: pair.digest.finish(),
        sensor_status: Some(sensor),
        display_status: Some(display),
    })
}

/// Whether this engine can run a scene: it has no boards to break.
///
/// # Errors
/// The first fault that needs a board; its file is the scene's name.
pub fn check(scene: &Scene) -> Result<(), SceneError> {
    let needs_boards = |fault: &Fault| fault.kind.row().needs == Needs::Boards;
    match scene.faults.iter().position(needs_boards) {
        None => Ok(()),
        Some(at) => Err(SceneError::of(
            &scene.name,
            format!("fault[{at}].kind"),
            format!(
                "\"{}\" breaks a board, and this engine has none: give --engine elf",
                scene.faults[at].kind.name()
            ),
        )),
    }
}

/// Both boards, the wires between them, and the world around them.
struct Pair<'o, O> {
    world: World,
    arm: Arm,
    sensor: Sensor,
    scans: [Scan; SCANS_PER_SAMPLE],
    drive: Drive,
    sensor_counters: SensorCounters,
    display: Display,
    /// Scans in an output tick.
    steps_per_tick: u64,
    sensor_end: End,
    display_end: End,
    /// See [`Arrival::has_asked`].
    has_asked: bool,
    /// The sensor board's.
    clock: Clock,
    scan_count: u64,
    gauges: GaugeFaults,
    hand: EncoderFaults,
    arm_encoder: EncoderFaults,
    digest: Digest,
    /// The supervisor's last state.
    state: Option<DisplayState>,
    onlooker: &'o mut O,
}

impl<'o, O: RunObserver> Pair<'o, O> {
    fn new(scene: &Scene, onlooker: &'o mut O) -> Result<Self, SceneError> {
        check(scene)?;
        let end = |role, mark, to| End::new(role, LinkChannel::new(scene, to), mark);
        Ok(Self {
            world: World::new(scene)?,
            arm: Arm::new(&scene.arm, &scene.motion),
            sensor: Sensor::new(scene.sensor_configuration()),
            scans: [[0; CHANNELS]; SCANS_PER_SAMPLE],
            drive: Drive::default(),
            sensor_counters: SensorCounters::default(),
            steps_per_tick: u64::from(
                firmware_sensor::SCAN_RATE_HZ / scene.display_configuration().update_rate.hz(),
            ),
            display: display_of(scene)?,
            sensor_end: end(Role::Sensor, b'S', Role::Display),
            display_end: end(Role::Display, b'D', Role::Sensor),
            has_asked: false,
            clock: Clock::new(&scene.faults),
            scan_count: 0,
            gauges: GaugeFaults::new(&scene.faults),
            hand: EncoderFaults::of_hand(&scene.faults),
            arm_encoder: EncoderFaults::of_arm(&scene.faults),
            digest: Digest::default(),
            state: None,
            onlooker,
        })
    }

    fn step(&mut self, step: u64) {
        let now_ns = step * STEP_NS;
        let t_s = step as f64 / f64::from(firmware_sensor::SCAN_RATE_HZ);
        self.sensor_end.greet(now_ns, &mut self.digest);
        self.display_end.greet(now_ns, &mut self.digest);
        if self.clock.is_true() {
            self.scan(step, now_ns, t_s);
        }
        while !self.clock.is_true() {
            let at_ns = self.clock.true_ns(self.scan_count * STEP_NS);
            if at_ns > now_ns {
                break;
            }
            self.scan(self.scan_count, at_ns, at_ns as f64 * 1e-9);
            self.scan_count += 1;
        }
        if step.is_multiple_of(self.steps_per_tick) {
            self.tick(now_ns, t_s);
            self.display_hears(now_ns);
        }
        self.sensor_hears(now_ns);
        if step > 0 && step.is_multiple_of(STEPS_PER_STATUS) {
            let (sensor, display) = self.statuses(now_ns);
            self.tell(Role::Sensor, now_ns, Message::Status(sensor));
            self.tell(Role::Display, now_ns, Message::Status(display));
        }
    }

    /// Hands on all that has arrived at the sensor.
    fn sensor_hears(&mut self, now_ns: u64) {
        let Self {
            sensor,
            sensor_end,
            display_end,
            sensor_counters,
            ..
        } = self;
        sensor_end.hear(&mut display_end.wire, now_ns, |_, message| match message {
            Message::Motion(motion) => {
                let taken = u32::from(sensor.on_motion(&motion));
                sensor_counters.motions = sensor_counters.motions.wrapping_add(taken);
            }
            Message::Stop(stop) => sensor.stop(stop.reason.trip()),
            _ => {}
        });
    }

    /// Hands on all that has arrived at the display. As on the board, it is heard once a tick's words are on
    /// their way.
    fn display_hears(&mut self, now_ns: u64) {
        let Self {
            display,
            sensor_end,
            display_end,
            has_asked,
            onlooker,
            ..
        } = self;
        display_end.hear(
            &mut sensor_end.wire,
            now_ns,
            |due_ns, message| match message {
                Message::Estimate(estimate) => {
                    onlooker.see(RunEvent::Received(&Arrival {
                        at_ns: due_ns,
                        estimate,
                        has_asked: std::mem::take(has_asked),
                    }));
                    display.on_estimate(&estimate);
                }
                Message::Texture(texture) => display.on_texture(&texture),
                Message::Stop(stop) => display.stop(stop.reason),
                _ => {}
            },
        );
        if display_end.port.take_asked() {
            *has_asked = true;
            display.on_greeting();
        }
    }

    /// An ADC scan and, with every fourth, the sensor's millisecond.
    fn scan(&mut self, step: u64, now_ns: u64, t_s: f64) {
        let position_mm = self.arm.position_mm(t_s);
        let codes = self.world.codes(t_s, position_mm);
        let codes = self.gauges.apply(now_ns, codes);
        let encoder = self.world.arm_encoder(t_s, position_mm);
        let encoder = self.arm_encoder.counts(now_ns, encoder);
        self.onlooker.see(RunEvent::Scan(&ScanRecord {
            at_ns: now_ns,
            codes,
            encoder,
            position_mm,
        }));
        let place = (step % SCANS_PER_SAMPLE as u64) as usize;
        self.scans[place] = codes;
        if place + 1 < SCANS_PER_SAMPLE {
            return;
        }
        let output = self
            .sensor
            .step(step * STEP_NS / 1_000, &self.scans, encoder);
        self.sensor_counters.samples = self.sensor_counters.samples.wrapping_add(1);
        let state = self.sensor.arm();
        if state.trip() != self.sensor_counters.stopped {
            self.sensor_counters.stopped = state.trip();
            let instant_us = now_ns / 1_000;
            self.tell(
                Role::Sensor,
                now_ns,
                Message::Arm(protocol::Arm { instant_us, state }),
            );
        }
        if output.drive != self.drive {
            self.drive = output.drive;
            self.arm.command(t_s, self.command_mm_s());
        }
        if let Some(estimate) = output.estimate {
            self.onlooker.see(RunEvent::Estimate(now_ns, &estimate));
            let sent = self.tell(Role::Sensor, now_ns, Message::Estimate(estimate));
            self.sensor_counters.estimates =
                self.sensor_counters.estimates.wrapping_add(u32::from(sent));
        }
        if let Some(texture) = output.texture {
            self.tell(Role::Sensor, now_ns, Message::Texture(texture));
        }
        if let Some(gauges) = output.gauges {
            self.sensor_end
                .send(now_ns, &Message::Gauges(gauges), &mut self.digest);
        }
    }

    fn tick(&mut self, now_ns: u64, t_s: f64) {
        let position_mm = self.world.hand_position_mm(t_s);
        let encoder = self.hand.counts(now_ns, encoder(position_mm));
        self.onlooker.see(RunEvent::Tick(&TickRecord {
            at_ns: now_ns,
            encoder,
            position_mm,
        }));
        if self.display.tick(encoder, &Senses::default()).send {
            let output = OutputRecord {
                at_ns: now_ns,
                words: *self.display.words(),
                skew_ns: 0,
            };
            self.digest.output(&output);
            self.onlooker.see(RunEvent::Output(&output));
        }
        let state = self.display.state();
        if self.state.replace(state) != Some(state) {
            let instant_us = now_ns / 1_000;
            let safety = Message::Safety(Safety { instant_us, state });
            self.say(Role::Display, now_ns, safety);
        }
        if let Some(motion) = self.display.motion(now_ns / 1_000) {
            self.display_end
                .send(now_ns, &Message::Motion(motion), &mut self.digest);
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
        let status = |end: &End, role| Status {
            uptime_us: now_ns / 1_000,
            reset: ResetCause::Power,
            watchdog_resets: 0,
            stack_free_bytes: 0,
            peer: end.port.counters(),
            console: PortCounters::default(),
            role,
        };
        (
            status(&self.sensor_end, RoleCounters::Sensor(self.sensor_counters)),
            status(
                &self.display_end,
                RoleCounters::Display(self.display.counters()),
            ),
        )
    }

    /// Says a message, and tells of it. False if nobody listens yet.
    fn tell(&mut self, role: Role, now_ns: u64, message: Message) -> bool {
        let end = match role {
            Role::Display => &mut self.display_end,
            _ => &mut self.sensor_end,
        };
        let sent = end.send(now_ns, &message, &mut self.digest);
        self.say(role, now_ns, message);
        sent
    }

    /// Tells what a board says of itself.
    fn say(&mut self, role: Role, at_ns: u64, message: Message) {
        let said = TimedMessage { at_ns, message };
        self.onlooker.see(RunEvent::Said(role, &said));
    }
}

/// A display whose converters have started, set as the scene asks.
fn display_of(scene: &Scene) -> Result<Display, SceneError> {
    let settings = scene
        .display_settings()
        .map_err(|refusal| SceneError::of(&scene.name, "display", refusal.to_string()))?;
    let mut display = Display::new(&settings, None);
    display.started(Ok(()));
    Ok(display)
}

/// A board's port towards the other board, and the wire that leads away from it.
struct End {
    port: Port,
    wire: LinkChannel,
    /// When the wire has carried all that was sent so far.
    free_ns: u64,
    /// The board's mark in the hash.
    mark: u8,
}

impl End {
    fn new(role: Role, wire: LinkChannel, mark: u8) -> Self {
        Self {
            port: Port::new(Hello::new(role, CHIP, VERSION)),
            wire,
            free_ns: 0,
            mark,
        }
    }

    fn greet(&mut self, now_ns: u64, digest: &mut Digest) {
        self.port.poll(now_ns / 1_000);
        self.flush(now_ns, digest);
    }

    /// Says a message. False if nobody listens yet.
    fn send(&mut self, now_ns: u64, message: &Message, digest: &mut Digest) -> bool {
        self.port.post(message);
        self.flush(now_ns, digest)
    }

    /// Puts what the port has to say on the wire, behind what is there already; false if it is nothing.
    fn flush(&mut self, now_ns: u64, digest: &mut Digest) -> bool {
        let mut out = [0; MAX_FRAME];
        let mut said = false;
        loop {
            let count = self.port.take(&mut out);
            if count == 0 {
                return said;
            }
            said = true;
            self.free_ns = self.free_ns.max(now_ns);
            digest.frame(self.mark, self.free_ns, &out[..count]);
            for &byte in &out[..count] {
                self.free_ns += BYTE_NS;
                self.wire.push(self.free_ns, byte);
            }
        }
    }

    /// Takes what has arrived over the peer's `wire`, and hands on each message with its last byte's
    /// arrival.
    fn hear(&mut self, wire: &mut LinkChannel, now_ns: u64, mut handle: impl FnMut(u64, Message)) {
        let mut bytes = [0; 64];
        let mut length = 0;
        while let Some((due_ns, byte)) = wire.pop(now_ns) {
            if wire.is_held_low(due_ns) {
                self.port.on_line_error();
                continue;
            }
            bytes[length] = byte;
            length += 1;
            let more =
                length < bytes.len() && wire.next_due().is_some_and(|due_ns| due_ns <= now_ns);
            // A frame's end closes a portion, so that its instant is known.
            if byte != 0 && more {
                continue;
            }
            let heard = &bytes[..length];
            self.port
                .receive(now_ns / 1_000, heard, |message| handle(due_ns, message));
            length = 0;
        }
    }
}
