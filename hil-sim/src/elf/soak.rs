//! A long run of both ELFs: random strokes over several specimens through bad weather, with nothing kept
//! but counts, and every count checked against what was seen on the wires and pins.
//!
//! The last [`QUIET_S`] the hand rests and nothing passes between the boards, so that the boards' last
//! counters are those of everything that came before.

mod strokes;
mod tally;

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use protocol::{Configuration, DisplayConfiguration, Mode, SensorConfiguration, Status};
use rigless::emulator::{self, Access, AccessKind, Driver, Host, Settled, Start, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;

pub use tally::Check;

use super::console::ConsoleHost;
use super::display::DisplayPins;
use super::lockstep::{QUANTUM_NS, Watched};
use super::nucleo::{CONSOLE_UART, Nucleo, PEER_UART, Pins};
use super::rtt::Log;
use super::sensor::SensorPins;
use super::wire::TimedByte;
use super::{ElfError, Firmware, Firmwares};
use crate::arm::Arm;
use crate::fault::HandFault;
use crate::scene::{ArmDrive, Follows, Gauges, Kinematic, Link, Motion, Scene, Specimen};
use crate::weather::Weather;
use crate::world::World;
use strokes::Strokes;
use tally::{Outputs, Side};

/// The two directions' numbers.
const TO_DISPLAY: u64 = 0;
const TO_SENSOR: u64 = 1;
/// Silence at the end, in s: two of the boards' statuses and more.
pub const QUIET_S: f64 = 3.0;
/// The shortest run, in s.
pub const SHORTEST_S: f64 = 10.0;
/// How often the log is read: well before the 1 KiB of RTT are full.
const LOG_NS: u64 = 10_000_000;
/// How often progress is told.
const TOLD_NS: u64 = 1_000_000_000;

/// The run to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soak {
    /// Virtual time in s, [`SHORTEST_S`] or more.
    pub duration_s: f64,
    /// All randomness comes from it.
    pub seed: u64,
    /// What becomes of both boards' frames on their way.
    pub link: Link,
}

impl Soak {
    /// Weather of every sort at once.
    pub const WEATHER: Link = Link {
        delay_ms: 30.0,
        jitter_ms: 20.0,
        loss: 0.05,
        reorder: 0.01,
        corrupt: 1e-4,
    };
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Soaked {
    /// What was checked.
    pub checks: Vec<Check>,
    /// What was only counted: name and value.
    pub counts: Vec<(&'static str, u64)>,
}

impl Soaked {
    /// Whether every check holds.
    pub fn holds(&self) -> bool {
        self.checks.iter().all(|check| check.holds)
    }
}

/// Runs the pair. `progress` is told the virtual seconds that have passed, once a second.
///
/// # Errors
/// If a board can't be emulated or stops before the end.
pub fn run(
    soak: &Soak,
    firmwares: &Firmwares,
    progress: impl Fn(f64) + Send + Sync + 'static,
) -> Result<Soaked, ElfError> {
    let end_ns = (soak.duration_s.max(SHORTEST_S) * 1e9).ceil() as u64;
    let quiet_ns = end_ns - (QUIET_S * 1e9) as u64;
    let strokes = Strokes::new(soak.seed, quiet_ns as f64 * 1e-9);
    let crossed = strokes.crossed();
    let scene = scene(soak, strokes.hand());
    let (to_display, from_sensor) = sync_channel(1);
    let (to_sensor, from_display) = sync_channel(1);
    let travelling = Configuration::Display(DisplayConfiguration {
        mode: Mode::Travelling,
        ..DisplayConfiguration::DEFAULT
    });
    let half = |to_peer, from_peer, direction, wanted, firmware: &Firmware| Half {
        to_peer,
        from_peer,
        weather: Weather::new(&soak.link, soak.seed, direction),
        console: ConsoleHost::new(Some(wanted), None, &[]),
        log: Log::find(&firmware.elf),
        side: Side::default(),
        outputs: Outputs::default(),
        next_exchange_ns: QUANTUM_NS,
        next_log_ns: LOG_NS,
        next_told_ns: TOLD_NS,
        quiet_ns,
        end_ns,
        abandoned: false,
        progress: None,
    };
    let sensor_half = half(
        to_display,
        from_display,
        TO_SENSOR,
        Configuration::Sensor(SensorConfiguration::DEFAULT),
        &firmwares.sensor,
    );
    let display_half = Half {
        progress: Some(Box::new(progress)),
        ..half(
            to_sensor,
            from_sensor,
            TO_DISPLAY,
            travelling,
            &firmwares.display,
        )
    };
    let (sensor_world, display_world) = (World::new(&scene)?, World::new(&scene)?);
    let arm = Arm::new(&scene.arm, &scene.motion);
    let configuration = scene.sensor_configuration();
    let (sensor, display) = thread::scope(|scope| {
        let sensor = scope.spawn(|| {
            let pins = SensorPins::new(sensor_world, arm, configuration, &[]);
            drive(
                "sensor",
                Nucleo::new(pins, SensorPins::fit),
                &firmwares.sensor,
                sensor_half,
            )
        });
        let display = drive(
            "display",
            Nucleo::new(
                DisplayPins::new(display_world, HandFault::new(&[])),
                DisplayPins::fit,
            ),
            &firmwares.display,
            display_half,
        );
        (sensor.join(), display)
    });
    let sensor = sensor.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let (sensor, display) = match (sensor, display) {
        (Ok(sensor), Ok(display)) => (sensor, display),
        // The board that fails abandons the other: its own reason is the one to tell.
        (Err(error), Ok(_)) | (Ok(_), Err(error)) => return Err(error),
        (Err(sensor), Err(display)) => {
            let abandoned = super::is_abandoned(&sensor);
            return Err(if abandoned { display } else { sensor });
        }
    };
    Ok(tally::judge(sensor, display, crossed))
}

/// The world that the strokes go through: four specimens, noise, an arm that follows over the link.
fn scene(soak: &Soak, hand: Motion) -> Scene {
    let mut scene = Scene::constant(2.0, 50.0);
    scene.seed = soak.seed;
    scene.duration_s = soak.duration_s;
    scene.surface.specimens = strokes::SPECIMENS
        .map(|(wavelength_mm, length_mm)| Specimen {
            wavelength_mm,
            length_mm,
        })
        .to_vec();
    scene.motion = hand;
    scene.arm = ArmDrive {
        follows: Follows::Link,
        lag_ms: 10.0,
        ..ArmDrive::default()
    };
    scene.gauges = Gauges::Kinematic(Kinematic {
        snr_db: Some(20.0),
        ..Kinematic::default()
    });
    scene.link = soak.link;
    scene
}

/// What is taken from a board's pins at the end of every quantum.
trait Drained: Watched {
    fn drain(board: &mut Nucleo<Self>, outputs: &mut Outputs)
    where
        Self: Sized;
}

impl Drained for SensorPins {
    fn drain(board: &mut Nucleo<Self>, _outputs: &mut Outputs) {
        board.pins().0.scans.clear();
    }
}

impl Drained for DisplayPins {
    fn drain(board: &mut Nucleo<Self>, outputs: &mut Outputs) {
        let (pins, part) = board.pins();
        let records = pins.leave(part);
        let loads = super::display::loads(part);
        outputs.take(records, loads);
    }
}

/// One board of the pair.
struct Half {
    to_peer: SyncSender<Vec<TimedByte>>,
    from_peer: Receiver<Vec<TimedByte>>,
    weather: Weather,
    console: ConsoleHost,
    log: Option<Log>,
    side: Side,
    outputs: Outputs,
    next_exchange_ns: u64,
    next_log_ns: u64,
    next_told_ns: u64,
    quiet_ns: u64,
    end_ns: u64,
    abandoned: bool,
    progress: Option<Box<dyn Fn(f64) + Send>>,
}

impl Half {
    fn exchange<P: Drained>(&mut self, board: &mut Nucleo<P>, now_ns: u64) -> bool {
        P::drain(board, &mut self.outputs);
        let sent = board.wire(PEER_UART).take_sent();
        self.side.sent(&sent, &self.outputs);
        let (Ok(()), Ok(received)) = (self.to_peer.send(sent), self.from_peer.recv()) else {
            self.abandoned = true;
            return false;
        };
        if now_ns < self.quiet_ns {
            for (at_ns, byte) in received {
                self.weather.push(at_ns + QUANTUM_NS, byte);
            }
        }
        while let Some((due_ns, byte)) = self.weather.pop(now_ns + QUANTUM_NS) {
            self.side.arrived(due_ns, byte);
            board.wire(PEER_UART).hear(due_ns, byte);
        }
        self.console.serve(board, now_ns);
        true
    }
}

impl<P: Drained> Driver<Nucleo<P>> for Half {
    fn on_settled(
        &mut self,
        session: &mut Session<Nucleo<P>>,
        _host: &mut dyn Host,
        settled: Settled,
    ) {
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
            P::on_write(session.board_mut(), address, value, virtual_time.0);
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Nucleo<P>>,
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
        if now_ns >= self.next_exchange_ns {
            if !self.exchange(session.board_mut(), now_ns) || now_ns >= self.end_ns {
                return None;
            }
            self.next_exchange_ns += QUANTUM_NS;
            if now_ns >= self.next_told_ns {
                self.next_told_ns += TOLD_NS;
                if let Some(progress) = &self.progress {
                    progress(now_ns as f64 * 1e-9);
                }
            }
        }
        let mut next_ns = self.next_exchange_ns;
        for uart in [PEER_UART, CONSOLE_UART] {
            if let Some(due_ns) = session.board_mut().wire(uart).next_due()
                && due_ns > now_ns
            {
                next_ns = next_ns.min(due_ns);
            }
        }
        Some(VirtualNanos(next_ns))
    }
}

/// What a board leaves behind.
struct Left {
    name: &'static str,
    side: Side,
    outputs: Outputs,
    resets: usize,
    /// Lines of its log that tell of a panic.
    panics: Vec<String>,
    told: bool,
}

impl Left {
    /// Its last status.
    fn status(&self) -> Option<Status> {
        self.side.last_status()
    }
}

fn drive<P: Drained + Pins>(
    name: &'static str,
    board: Result<Nucleo<P>, rigless::soc::Error>,
    firmware: &Firmware,
    half: Half,
) -> Result<Left, ElfError> {
    let board_error = |reason: String| ElfError::Board {
        board: name,
        reason,
    };
    let end_ns = half.end_ns;
    let board = board.map_err(|error| board_error(error.to_string()))?;
    let session = Session::new(Box::new(board), 0, VirtualNanos(QUANTUM_NS))
        .map_err(|error| board_error(error.to_string()))?;
    let images = [firmware.image.clone()];
    let finished = emulator::run(session, &Start::new(&images), half)
        .map_err(|error| board_error(error.to_string()))?;
    let at_ns = finished.stop.map_or(0, |stop| stop.at.0);
    let half = finished.driver;
    if half.abandoned || at_ns < end_ns {
        let reason = if half.abandoned {
            super::ABANDONED.to_owned()
        } else {
            format!("{:?}", finished.stop)
        };
        return Err(ElfError::Stopped {
            board: name,
            at_s: at_ns as f64 * 1e-9,
            duration_s: end_ns as f64 * 1e-9,
            reason,
        });
    }
    if let Some(unmapped) = finished.session.unmapped().first() {
        return Err(ElfError::Unmapped {
            board: name,
            address: unmapped.address,
        });
    }
    let lines = half.log.as_ref().map(Log::lines).unwrap_or_default();
    Ok(Left {
        name,
        told: half
            .console
            .told
            .is_some_and(|told| told.report.refused.is_none()),
        side: half.side,
        outputs: half.outputs,
        resets: finished.session.resets().len(),
        panics: lines
            .into_iter()
            .map(|(_, line)| line)
            .filter(|line| line.contains("panicked"))
            .collect(),
    })
}
