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

use std::time::Instant;

use protocol::actuators::{ACTUATOR_BLOCK, ACTUATORS, Actuator, DEFAULT_ACTUATORS};
use protocol::{
    Actuators, Configuration, ConfigurationReport, Configure, Contact, DisplayConfiguration,
    Estimate, GaugeHealth, Hello, MAX_FRAME, Message, Peer, Port, Range, Role, Safety, Status,
    Texture,
};
use rigless::emulator::{self, Access, AccessKind, Driver, Host, Settled, Start, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;

use super::board_pins::BoardPins;
use super::display::DisplayPins;
use super::nucleo::{CONSOLE_UART, Nucleo, PEER_UART};
use super::recorder::WARM_UP_NS;
use super::rtt::Log;
use super::{ElfError, Firmware};
use hil_sim_core::link::impairments::{BYTE_NS, Impairments};
use hil_sim_core::plant::fault::hand::HandFault;
use hil_sim_core::plant::world::World;
use hil_sim_core::run::decoder::MessageDecoder;
use hil_sim_core::run::digest::Digest;
use hil_sim_core::run::fault_evidence::FaultEvidence;
use hil_sim_core::run::recording::{
    Arrival, Arrivals, Engine, EstimateRecord, Recording, TickRecord,
};
use hil_sim_core::scene::{Link, Motion, Scene};

/// How often the far end looks at what it has heard and has to say.
const LOOK_NS: u64 = 1_000_000;
const ESTIMATE_NS: u64 = 1_000_000_000 / firmware_sensor::ESTIMATE_RATE_HZ as u64;
/// Estimates to a texture.
const ESTIMATES_PER_TEXTURE: usize = 5;
/// How often the log is read: well before the 1 KiB of RTT are full.
const LOG_NS: u64 = 10_000_000;
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
pub(super) trait BoardHook: Send + 'static {
    /// The run has come to an instant at which the far end is served, each millisecond.
    fn on_look(&mut self, _at_ns: u64, _host: &mut dyn Host) {}

    /// Every access, stop and hit, once the models have settled.
    fn on_settled(&mut self, _settled: &Settled) {}
}

impl BoardHook for () {}

/// Runs `firmware` as `alone` says.
///
/// # Errors
/// If the board can't be emulated, stops before the end, or refuses the configuration.
pub fn run(alone: DisplayBench, firmware: &Firmware) -> Result<AloneRun, ElfError> {
    run_before(alone, firmware, ()).map(|(run, ())| run)
}

/// The same, before a witness, who is given back.
pub(super) fn run_before<W: BoardHook>(
    alone: DisplayBench,
    firmware: &Firmware,
    witness: W,
) -> Result<(AloneRun, W), ElfError> {
    const BOARD: &str = "display";
    let board_error = |reason: String| ElfError::Board {
        board: BOARD,
        reason,
    };
    let end_ns = (alone.duration_s * 1e9).ceil() as u64;
    let duration_s = alone.duration_s;
    let world = World::new(&Scene {
        motion: alone.hand.clone(),
        duration_s,
        ..Scene::constant(2.0, 50.0)
    })?;
    let board = Nucleo::new(
        DisplayPins::new(world, HandFault::new(&[])),
        DisplayPins::fit,
    )
    .map_err(|error| board_error(error.to_string()))?;
    let images = [firmware.image.clone()];
    let session = Session::new(
        Box::new(board.running(&images, firmware.processor.clone())),
        0,
        VirtualNanos(LOOK_NS),
    )
    .map_err(|error| board_error(error.to_string()))?;
    let driver = Solo {
        far: ScriptedSensor::new(alone),
        log: Log::find(&firmware.elf),
        next_look_ns: LOOK_NS,
        next_log_ns: LOG_NS,
        end_ns,
        warm: None,
        witness,
    };
    let started = Instant::now();
    let mut finished = emulator::run(session, &Start::new(&images), driver)
        .map_err(|error| board_error(error.to_string()))?;
    let ended = Instant::now();
    let at_ns = finished.stop.map_or(0, |stop| stop.at.0);
    if at_ns < end_ns {
        return Err(ElfError::Stopped {
            board: BOARD,
            at_s: at_ns as f64 * 1e-9,
            duration_s,
            reason: format!("{:?}", finished.stop),
        });
    }
    if let Some(unmapped) = finished.session.unmapped().first() {
        return Err(ElfError::Unmapped {
            board: BOARD,
            address: unmapped.address,
        });
    }
    let resets = finished.session.resets().len();
    let (pins, part) = finished.session.board_mut().pins();
    let left = pins.leave(part);
    let Solo {
        far,
        log,
        warm,
        witness,
        ..
    } = finished.driver;
    let Some(configured_ns) = far.configured_ns else {
        return Err(ElfError::Configuration {
            board: BOARD,
            reason: far
                .refused
                .unwrap_or_else(|| "it has not answered by the end: run it for longer".to_owned()),
        });
    };
    if let Some(reason) = wrong_rate(&left.ticks, far.alone.configuration.update_rate.hz()) {
        return Err(ElfError::Configuration {
            board: BOARD,
            reason,
        });
    }
    let mut digest = Digest::default();
    digest.outputs(&left.outputs);
    let (begun, warm_up_s) = match warm {
        Some(warm) => (warm, WARM_UP_NS as f64 * 1e-9),
        None => (started, 0.0),
    };
    let log = log.map(|log| log.lines()).unwrap_or_default();
    let run = AloneRun {
        configured_ns,
        motions: far.motions,
        instructions: finished.stop.map_or(0, |stop| stop.instruction_count),
        resets,
        clears: left.clears,
        dac_frame_errors: left.dac_frame_errors,
        recording: Recording {
            engine: Engine::Elf,
            duration_s,
            warm_up_s,
            wall_s: (ended - begun).as_secs_f64(),
            hash: digest.finish(),
            signs: FaultEvidence::default(),
            scans: Vec::new(),
            ticks: left.ticks,
            estimates: far.estimates,
            arrived: far.arrived,
            outputs: left.outputs,
            sensor_status: None,
            display_status: far.statuses.last().map(|&(_, status)| status),
            log: log
                .into_iter()
                .map(|(at_ns, line)| (at_ns, BOARD, line))
                .collect(),
        },
        statuses: far.statuses,
        safety: far.safety,
    };
    Ok((run, witness))
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
struct ScriptedSensor {
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
    arrivals: Arrivals,
    statuses: Vec<(u64, Status)>,
    safety: Vec<Safety>,
    motions: u64,
}

impl ScriptedSensor {
    fn new(alone: DisplayBench) -> Self {
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
            arrivals: Arrivals::default(),
            statuses: Vec::new(),
            safety: Vec::new(),
            motions: 0,
        }
    }

    /// Hears what the board said by `now_ns`, and says what is due; what arrives until the next look is
    /// put on the board's wire.
    fn look(&mut self, board: &mut Nucleo<DisplayPins>, now_ns: u64) {
        // Nobody is on the console.
        board.wire(CONSOLE_UART).take_sent();
        let sent = board.wire(PEER_UART).take_sent();
        self.hear(&sent, now_ns);
        self.configure(now_ns);
        if self.configured_ns.is_some() && now_ns >= self.next_estimate_ns {
            self.estimate(now_ns);
        }
        self.speak(board, now_ns);
    }

    fn hear(&mut self, sent: &[(u64, u8)], now_ns: u64) {
        let bytes: Vec<u8> = sent.iter().map(|&(_, byte)| byte).collect();
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
            if let Message::Estimate(estimate) = said.message {
                let arrival = Arrival {
                    at_ns: said.at_ns,
                    estimate,
                };
                self.arrivals.note(&mut self.estimates, &arrival);
                self.arrived.push(arrival);
            }
        }
    }
}

struct Solo<W> {
    far: ScriptedSensor,
    log: Option<Log>,
    next_look_ns: u64,
    next_log_ns: u64,
    end_ns: u64,
    /// When the emulator had run for [`WARM_UP_NS`].
    warm: Option<Instant>,
    witness: W,
}

impl<W: BoardHook> Driver<Nucleo<DisplayPins>> for Solo<W> {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<DisplayPins>>,
        _host: &mut dyn Host,
        settled: Settled,
    ) {
        self.witness.on_settled(&settled);
        if let Settled::Access {
            access:
                Access {
                    kind: AccessKind::Write,
                    address,
                    value,
                    virtual_time,
                    ..
                },
            ..
        } = settled
        {
            <DisplayPins as BoardPins>::on_write(
                session.board_mut(),
                address,
                value,
                virtual_time.0,
            );
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Nucleo<DisplayPins>>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        let now_ns = stop.at.0;
        if now_ns >= self.next_log_ns {
            self.next_log_ns = now_ns + LOG_NS;
            if let Some(log) = &mut self.log {
                log.read(now_ns, host);
            }
        }
        if now_ns >= self.next_look_ns {
            self.far.look(session.board_mut(), now_ns);
            self.witness.on_look(now_ns, host);
            if now_ns >= self.end_ns || self.far.refused.is_some() {
                return None;
            }
            if self.warm.is_none() && now_ns >= WARM_UP_NS {
                self.warm = Some(Instant::now());
            }
            self.next_look_ns += LOOK_NS;
        }
        let due_ns = session
            .board_mut()
            .wire(PEER_UART)
            .next_due()
            .filter(|&due_ns| due_ns > now_ns);
        Some(VirtualNanos(due_ns.map_or(self.next_look_ns, |due_ns| {
            due_ns.min(self.next_look_ns)
        })))
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
