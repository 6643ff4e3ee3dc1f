//! The display board alone: its ELF on an emulated board, opposite a scripted sensor.
//!
//! ```text
//! hand(t) ─> encoder ─> display ELF ─> four DAC81416 ─> Recording
//!                          ^  └─ Motion, Status, Safety ─> far end
//!   λ(t), amplitude(t) ─> far end: Hello, Configure, Estimate at 100 Hz, through weather
//! ```
//!
//! The far end speaks through a real [`protocol::Port`]. Its first words, up to the board's answer to the
//! configuration, go through fair weather; every estimate goes through the run's own.

use std::mem;
use std::time::Instant;

use protocol::actuators::{ACTUATOR_BLOCK, ACTUATORS, Actuator, DEFAULT_ACTUATORS};
use protocol::{
    Actuators, Configuration, ConfigurationReport, Configure, Contact, DisplayConfiguration,
    Estimate, GaugeHealth, Hello, MAX_FRAME, Message, Peer, Port, Range, Role, Safety, Status,
    Texture,
};
use rigless::emulator::{Host, Settled};

use super::display::DisplayPins;
use super::lockstep::{BoardHook, Lockstep, QuantumContext};
use super::nucleo::{CONSOLE_UART, Nucleo, PEER_UART};
use super::recorder::WARM_UP_NS;
use super::rtt::Log;
use super::wire::TimedByte;
use super::{ElfError, Firmware, pair, recorder};
use hil_sim_core::link::impairments::{BYTE_NS, Impairments};
use hil_sim_core::plant::fault::encoder::EncoderFaults;
use hil_sim_core::plant::world::World;
use hil_sim_core::run::decoder::MessageDecoder;
use hil_sim_core::run::digest::Digest;
use hil_sim_core::run::recording::{Arrival, Engine, EstimateRecord, Recording, TickRecord};
use hil_sim_core::scene::{Link, Motion, Scene};

/// How often the far end looks at what it has heard and has to say.
const LOOK_NS: u64 = 1_000_000;
const ESTIMATE_NS: u64 = 1_000_000_000 / firmware_sensor::ESTIMATE_RATE_HZ as u64;
/// Estimates to a texture.
const ESTIMATES_PER_TEXTURE: usize = 5;
/// How long the far end waits for an answer before it asks again.
const PATIENCE_NS: u64 = 50_000_000;
/// As in the lockstep of a pair.
const TO_DISPLAY: u64 = 0;
/// Speed below which a sensor has no λ to stand by, in mm/s.
const SLOWEST_MM_S: f64 = 5.0;

/// What the far end's sensor says of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorMessage {
    /// λ in mm.
    pub wavelength_mm: f64,
    /// Amplitude in ADC steps.
    pub amplitude_lsb: f32,
}

impl SensorMessage {
    /// λ on a surface of usual height.
    pub const fn of(wavelength_mm: f64) -> Self {
        Self {
            wavelength_mm,
            amplitude_lsb: 300.0,
        }
    }

    /// What a sensor says that sees this at `instant_us` while its arm moves at `velocity_mm_s`: valid from
    /// 5 mm/s on.
    pub fn estimate(self, sequence: u32, instant_us: u64, velocity_mm_s: f64) -> Estimate {
        let moves = velocity_mm_s.abs() >= SLOWEST_MM_S;
        Estimate {
            sequence,
            instant_us,
            wavelength_mm: moves.then_some(self.wavelength_mm as f32),
            valid: moves,
            confidence: if moves { 0.9 } else { 0.0 },
            amplitude_lsb: if moves { self.amplitude_lsb } else { 0.0 },
            counted_mm: None,
            range: Range::T1,
            contact: if moves {
                Contact::Slip
            } else {
                Contact::Unknown
            },
            velocity_um_s: (velocity_mm_s * 1e3).round() as i32,
            lag_um: None,
            gauges_used: if moves { 0b1_1111 } else { 0 },
            health: [GaugeHealth::Good; protocol::GAUGES],
        }
    }
}

/// λ and amplitude over s since the start.
pub type Surface = Box<dyn Fn(f64) -> SensorMessage + Send>;

/// A run to be made.
pub struct DisplayBench {
    /// What the board is told to be before the first estimate.
    pub configuration: DisplayConfiguration,
    /// How the actuators are described to it.
    pub actuators: [Actuator; ACTUATORS],
    /// Where the hand is. The arm's velocity in the estimates is the hand's.
    pub hand: Motion,
    /// What the estimates say. They are valid while the hand moves at 5 mm/s or more.
    pub surface: Surface,
    /// What else the sensor tells of the surface, 20 times a second while the hand moves: sequence and instant are its
    /// own.
    pub texture: Option<Texture>,
    /// What becomes of the estimates on their way.
    pub link: Link,
    /// All randomness of the link comes from it.
    pub seed: u64,
    /// Virtual time, in s.
    pub duration_s: f64,
}

impl DisplayBench {
    /// A constant λ, a fair link, everything else as the board starts with.
    pub fn new(hand: Motion, wavelength_mm: f64, duration_s: f64) -> Self {
        Self {
            configuration: DisplayConfiguration::DEFAULT,
            actuators: DEFAULT_ACTUATORS,
            hand,
            surface: Box::new(move |_| SensorMessage::of(wavelength_mm)),
            texture: None,
            link: Link::default(),
            seed: 1,
            duration_s,
        }
    }
}

/// What a run leaves behind.
#[derive(Clone, Debug)]
pub struct AloneRun {
    /// Ticks, outputs, estimates with their arrival, the last status, the log. Without scans.
    pub recording: Recording,
    /// When the far end had the board's answer to the configuration, in ns.
    pub configured_ns: u64,
    /// Every status, with the instant at which it was heard, in ns.
    pub statuses: Vec<(u64, Status)>,
    /// Every change of the supervisor's state that was heard.
    pub safety: Vec<Safety>,
    /// Motions heard.
    pub motions: u64,
    /// Instructions retired.
    pub instructions: u64,
    /// Resets after power-up.
    pub resets: usize,
    /// How often CLR fell after it was first released.
    pub clears: u32,
    /// Frames that a converter could not make sense of.
    pub dac_frame_errors: u64,
}

/// Somebody who looks on while the board runs.
pub(super) trait Watcher: Send + 'static {
    /// The run has come to an instant at which the far end is served, each millisecond.
    fn on_look(&mut self, _at_ns: u64, _host: &mut dyn Host) {}

    /// Every access, stop and hit, once the models have settled.
    fn on_settled(&mut self, _settled: &Settled) {}
}

impl Watcher for () {}

/// Runs `firmware` as `alone` says.
///
/// # Errors
/// If the board can't be emulated, stops before the end, or refuses the configuration.
pub fn run(alone: DisplayBench, firmware: &Firmware) -> Result<AloneRun, ElfError> {
    run_before(alone, firmware, ()).map(|(run, ())| run)
}

/// The same, before a watcher, who is given back.
pub(super) fn run_before<W: Watcher>(
    alone: DisplayBench,
    firmware: &Firmware,
    watcher: W,
) -> Result<(AloneRun, W), ElfError> {
    let board = Role::Display.name();
    let scene = Scene {
        motion: alone.hand.clone(),
        duration_s: alone.duration_s,
        ..Scene::constant(2.0, 50.0)
    };
    let pins = DisplayPins::new(World::new(&scene)?, EncoderFaults::of_hand(&[]));
    let update_rate = alone.configuration.update_rate;
    let far = ScriptedSensor::new(alone, Log::find(&firmware.elf), watcher);
    let started = Instant::now();
    let finished = pair::drive(
        Role::Display,
        Nucleo::new(pins, DisplayPins::fit),
        firmware,
        Lockstep::alone(&scene, Role::Display, &firmware.elf, LOOK_NS, far),
        scene.duration_s,
    )?;
    let (left, far) = (finished.records, finished.witness);
    let (warm_up_s, wall_s) = recorder::pace(started, far.warm, Instant::now());
    let wrong = |reason| ElfError::Configuration { board, reason };
    let Some(configured_ns) = far.configured_ns else {
        let no_answer = || "it has not answered by the end: run it for longer".to_owned();
        return Err(wrong(far.refused.unwrap_or_else(no_answer)));
    };
    if let Some(reason) = wrong_rate(&left.ticks, update_rate.hz()) {
        return Err(wrong(reason));
    }
    let mut digest = Digest::default();
    digest.outputs(&left.outputs);
    let log = far.log.map(|log| log.lines()).unwrap_or_default();
    let mut recording = Recording {
        warm_up_s,
        wall_s,
        hash: digest.finish(),
        ticks: left.ticks,
        estimates: far.estimates,
        arrived: far.arrived,
        outputs: left.outputs,
        display_status: far.statuses.last().map(|&(_, status)| status),
        log: log
            .into_iter()
            .map(|(at_ns, line)| (at_ns, board, line))
            .collect(),
        ..Recording::empty(Engine::Elf, scene.duration_s)
    };
    recording.match_arrivals();
    let run = AloneRun {
        recording,
        configured_ns,
        motions: far.motions,
        instructions: finished.instructions,
        resets: finished.resets.len(),
        clears: left.clears,
        dac_frame_errors: left.dac_frame_errors,
        statuses: far.statuses,
        safety: far.safety,
    };
    Ok((run, far.watcher))
}

/// What is wrong with the rate of the last two ticks, if it is not the one asked for.
fn wrong_rate(ticks: &[TickRecord], rate_hz: u32) -> Option<String> {
    let [.., before, last] = ticks else {
        return Some("it has no ticks".to_owned());
    };
    let seen_hz = 1e9 / (last.at_ns - before.at_ns) as f64;
    // Instants are whole ns: 4 kHz is off by 4·10⁻⁶ of it at most.
    let agrees = (seen_hz / f64::from(rate_hz) - 1.0).abs() < 1e-4;
    (!agrees).then(|| format!("it ticks at {seen_hz:.0} Hz, asked for {rate_hz}"))
}

/// The scripted sensor, and the way from it to the board.
struct ScriptedSensor<W> {
    alone: DisplayBench,
    port: Port,
    weather: Impairments,
    asked_ns: Option<u64>,
    configured_ns: Option<u64>,
    refused: Option<String>,
    next_estimate_ns: u64,
    /// When its UART has sent all that it was given so far.
    free_ns: u64,
    heard: MessageDecoder,
    estimates: Vec<EstimateRecord>,
    arrived: Vec<Arrival>,
    has_asked: bool,
    statuses: Vec<(u64, Status)>,
    safety: Vec<Safety>,
    motions: u64,
    /// What the board has said since the last look.
    sent: Vec<u8>,
    log: Option<Log>,
    /// When the emulator had run for [`WARM_UP_NS`].
    warm: Option<Instant>,
    watcher: W,
}

impl<W> ScriptedSensor<W> {
    fn new(alone: DisplayBench, log: Option<Log>, watcher: W) -> Self {
        Self {
            weather: Impairments::new(&alone.link, alone.seed, TO_DISPLAY),
            alone,
            port: Port::new(Hello::new(Role::Sensor, "hil-sim", [0, 1, 0])),
            asked_ns: None,
            configured_ns: None,
            refused: None,
            next_estimate_ns: 0,
            free_ns: 0,
            heard: MessageDecoder::default(),
            estimates: Vec::new(),
            arrived: Vec::new(),
            has_asked: false,
            statuses: Vec::new(),
            safety: Vec::new(),
            motions: 0,
            sent: Vec::new(),
            log,
            warm: None,
            watcher,
        }
    }

    /// Hears what the board said by `now_ns`, and says what is due; what arrives until the next look is
    /// put on the board's wire.
    fn look(&mut self, board: &mut Nucleo<DisplayPins>, now_ns: u64) {
        // Nobody is on the console.
        board.wire(CONSOLE_UART).take_sent();
        self.hear(now_ns);
        self.configure(now_ns);
        if self.configured_ns.is_some() && now_ns >= self.next_estimate_ns {
            self.estimate(now_ns);
        }
        self.speak(board, now_ns);
    }

    fn hear(&mut self, now_ns: u64) {
        let bytes = mem::take(&mut self.sent);
        let mut report: Option<ConfigurationReport> = None;
        let Self {
            statuses,
            safety,
            motions,
            ..
        } = self;
        self.port
            .receive(now_ns / 1_000, &bytes, |message| match message {
                Message::Configuration(answer) => report = Some(answer),
                Message::Status(status) => statuses.push((now_ns, status)),
                Message::Safety(change) => safety.push(change),
                Message::Motion(_) => *motions += 1,
                _ => {}
            });
        let Some(report) = report.filter(|_| self.configured_ns.is_none()) else {
            return;
        };
        match report.refused {
            Some(refusal) => self.refused = Some(format!("it refuses {refusal:?}")),
            None => {
                self.configured_ns = Some(now_ns);
                self.next_estimate_ns = now_ns.next_multiple_of(ESTIMATE_NS);
            }
        }
    }

    fn configure(&mut self, now_ns: u64) {
        let due = self
            .asked_ns
            .is_none_or(|asked_ns| now_ns - asked_ns >= PATIENCE_NS);
        let known = matches!(self.port.peer(), Peer::Known(_));
        if !due || !known || self.configured_ns.is_some() || self.refused.is_some() {
            return;
        }
        self.asked_ns = Some(now_ns);
        let described = self.alone.actuators;
        if described != DEFAULT_ACTUATORS {
            for (block, first) in described.chunks_exact(ACTUATOR_BLOCK).zip(0u8..) {
                self.port.post(&Message::Actuators(Actuators {
                    first: first * ACTUATOR_BLOCK as u8,
                    actuators: std::array::from_fn(|index| block[index]),
                }));
            }
        }
        let configuration = Configuration::Display(DisplayConfiguration {
            actuators: protocol::actuators::hash(&described),
            ..self.alone.configuration
        });
        self.port
            .post(&Message::Configure(Configure::anyway(configuration)));
    }

    fn estimate(&mut self, now_ns: u64) {
        self.next_estimate_ns += ESTIMATE_NS;
        let t_s = now_ns as f64 * 1e-9;
        let said = (self.alone.surface)(t_s);
        let velocity_mm_s = self.alone.hand.velocity_mm_s(t_s);
        let sequence = self.estimates.len() as u32;
        let estimate = said.estimate(sequence, now_ns / 1_000, velocity_mm_s);
        self.estimates.push(EstimateRecord {
            made_ns: now_ns,
            received_ns: None,
            estimate,
        });
        self.port.post(&Message::Estimate(estimate));
        let due = self.estimates.len().is_multiple_of(ESTIMATES_PER_TEXTURE) && estimate.valid;
        if let Some(texture) = self.alone.texture.filter(|_| due) {
            self.port.post(&Message::Texture(Texture {
                sequence,
                instant_us: now_ns / 1_000,
                ..texture
            }));
        }
    }

    fn speak(&mut self, board: &mut Nucleo<DisplayPins>, now_ns: u64) {
        let mut out = [0; MAX_FRAME];
        loop {
            let count = self.port.take(&mut out);
            if count == 0 {
                break;
            }
            for &byte in &out[..count] {
                self.free_ns = self.free_ns.max(now_ns) + BYTE_NS;
                if self.configured_ns.is_some() {
                    self.weather.push(self.free_ns, byte);
                } else {
                    board.wire(PEER_UART).hear(self.free_ns, byte);
                    self.heard.hear(&[(self.free_ns, byte)]);
                }
            }
        }
        let mut arrived = Vec::new();
        while let Some((due_ns, byte)) = self.weather.pop(now_ns + LOOK_NS) {
            board.wire(PEER_UART).hear(due_ns, byte);
            arrived.push((due_ns, byte));
        }
        self.heard.hear(&arrived);
        for said in self.heard.take() {
            match said.message {
                Message::Hello(hello) => self.has_asked |= hello.asks != 0,
                Message::Estimate(estimate) => self.arrived.push(Arrival {
                    at_ns: said.at_ns,
                    estimate,
                    has_asked: mem::take(&mut self.has_asked),
                }),
                _ => {}
            }
        }
    }
}

impl<W: Watcher> BoardHook<DisplayPins> for ScriptedSensor<W> {
    fn sent(&mut self, _board: &mut Nucleo<DisplayPins>, sent: &[TimedByte]) {
        self.sent.extend(sent.iter().map(|&(_, byte)| byte));
    }

    fn heard(&mut self, _due_ns: u64, _byte: u8) {}

    fn attend(&mut self, between: QuantumContext<'_, DisplayPins>) {
        let now_ns = between.now_ns;
        self.look(between.session.board_mut(), now_ns);
        self.watcher.on_look(now_ns, between.host);
        if self.warm.is_none() && now_ns >= WARM_UP_NS {
            self.warm = Some(Instant::now());
        }
    }

    fn log(&mut self, now_ns: u64, host: &mut dyn Host) {
        if let Some(log) = &mut self.log {
            log.read(now_ns, host);
        }
    }

    fn settled(&mut self, settled: &Settled) {
        self.watcher.on_settled(settled);
    }

    fn is_over(&self, now_ns: u64) -> bool {
        let end_ns = (self.alone.duration_s * 1e9).ceil() as u64;
        now_ns >= end_ns || self.refused.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_ticks_at_another_rate_than_asked_for_is_told_of() {
        let ticks = [0, 500_000, 1_000_000].map(|at_ns| TickRecord {
            at_ns,
            encoder: 0,
            position_mm: 0.0,
        });
        assert_eq!(wrong_rate(&ticks, 2_000), None);
        let reason = wrong_rate(&ticks, 4_000).unwrap();
        assert_eq!(reason, "it ticks at 2000 Hz, asked for 4000");
        assert!(wrong_rate(&[], 2_000).is_some());
    }
}
