//! A long run of both ELFs: random strokes over several specimens through bad weather, with nothing kept
//! but counts, and every count checked against what was seen on the wires and pins.
//!
//! The last [`QUIET_S`] the hand rests and nothing passes between the boards, so that the boards' last
//! counters are those of everything that came before.

mod strokes;
mod tally;

use protocol::{Configuration, DisplayConfiguration, Mode, Rendering, SensorConfiguration, Status};
use rigless::emulator::Host;

pub use tally::Check;

use super::console::ConsoleHost;
use super::display::DisplayPins;
use super::lockstep::{BoardHook, QuantumContext};
use super::nucleo::{Nucleo, Pins};
use super::pair;
use super::pair::Finished;
use super::rtt::Log;
use super::sensor::SensorPins;
use super::wire::TimedByte;
use super::{ElfError, Firmware, Firmwares};
use hil_sim_core::scene::{
    ArmDrive, Follows, Gauges, Irregularity, Kinematic, Link, Motion, Scene, Specimen,
};
use strokes::Strokes;
use tally::{Outputs, Side};

/// Silence at the end, in s: two of the boards' statuses and more.
pub const QUIET_S: f64 = 3.0;
/// The shortest run, in s.
pub const SHORTEST_S: f64 = 10.0;
const PROGRESS_EVERY_NS: u64 = 1_000_000_000;

/// The run to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soak {
    /// Virtual time in s, [`SHORTEST_S`] or more.
    pub duration_s: f64,
    /// All randomness comes from it.
    pub seed: u64,
    /// How much of the surface the display plays.
    pub rendering: Rendering,
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
    let scene = scene(soak, end_ns, strokes.hand());
    let travelling = Configuration::Display(DisplayConfiguration {
        mode: Mode::Travelling,
        rendering: soak.rendering,
        ..DisplayConfiguration::DEFAULT
    });
    let half = |wanted, firmware: &Firmware| Half {
        console: ConsoleHost::new(Some(wanted), None, &[]),
        log: Log::find(&firmware.elf),
        side: Side::default(),
        outputs: Outputs::default(),
        next_told_ns: PROGRESS_EVERY_NS,
        quiet_ns,
        end_ns,
        progress: None,
    };
    let sensor = half(
        Configuration::Sensor(SensorConfiguration::DEFAULT),
        &firmwares.sensor,
    );
    let display = Half {
        progress: Some(Box::new(progress)),
        ..half(travelling, &firmwares.display)
    };
    let (sensor, display) = pair::run(&scene, firmwares, sensor, display)?;
    Ok(tally::judge(
        Left::new("sensor", sensor),
        Left::new("display", display),
        crossed,
        soak.link.loss,
    ))
}

/// The world that the strokes go through: four specimens, noise, an arm that follows over the link.
fn scene(soak: &Soak, end_ns: u64, hand: Motion) -> Scene {
    let mut scene = Scene::constant(2.0, 50.0);
    scene.seed = soak.seed;
    scene.duration_s = end_ns as f64 * 1e-9;
    scene.surface.specimens = strokes::SPECIMENS
        .map(|(wavelength_mm, length_mm)| Specimen {
            wavelength_mm,
            length_mm,
        })
        .to_vec();
    scene.surface.irregularity = Irregularity::rich(soak.rendering);
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
trait Drained: Pins {
    fn drain(board: &mut Nucleo<Self>, outputs: &mut Outputs)
    where
        Self: Sized;
}

impl Drained for SensorPins {
    fn drain(board: &mut Nucleo<Self>, _outputs: &mut Outputs) {
        let (pins, _) = board.pins();
        pins.take_records();
    }
}

impl Drained for DisplayPins {
    fn drain(board: &mut Nucleo<Self>, outputs: &mut Outputs) {
        let (pins, _) = board.pins();
        let records = pins.take_records();
        let loads = pins.loads();
        outputs.take(records, loads);
    }
}

/// Beside one board of the pair.
struct Half {
    console: ConsoleHost,
    log: Option<Log>,
    side: Side,
    outputs: Outputs,
    next_told_ns: u64,
    quiet_ns: u64,
    end_ns: u64,
    progress: Option<Box<dyn Fn(f64) + Send>>,
}

impl<P: Drained> BoardHook<P> for Half {
    fn sent(&mut self, board: &mut Nucleo<P>, sent: &[TimedByte]) {
        P::drain(board, &mut self.outputs);
        self.side.sent(sent, &self.outputs, self.quiet_ns);
    }

    fn is_joined(&self, now_ns: u64) -> bool {
        now_ns < self.quiet_ns
    }

    fn heard(&mut self, due_ns: u64, byte: u8) {
        self.side.arrived(due_ns, byte);
    }

    fn attend(&mut self, between: QuantumContext<'_, P>) {
        let now_ns = between.now_ns;
        self.console.serve(between.session.board_mut(), now_ns);
        if now_ns >= self.next_told_ns {
            self.next_told_ns += PROGRESS_EVERY_NS;
            if let Some(progress) = &self.progress {
                progress(now_ns as f64 * 1e-9);
            }
        }
    }

    fn log(&mut self, now_ns: u64, host: &mut dyn Host) {
        if let Some(log) = &mut self.log {
            log.read(now_ns, host);
        }
    }

    fn is_over(&self, now_ns: u64) -> bool {
        now_ns >= self.end_ns
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
    fn new<R>(name: &'static str, finished: Finished<R, Half>) -> Self {
        let half = finished.witness;
        let lines = half.log.as_ref().map(Log::lines).unwrap_or_default();
        let told = half.console.told;
        Self {
            name,
            told: told.is_some_and(|told| told.report.refused.is_none()),
            side: half.side,
            outputs: half.outputs,
            resets: finished.resets.len(),
            panics: lines
                .into_iter()
                .map(|(_, line)| line)
                .filter(|line| line.contains("panicked"))
                .collect(),
        }
    }

    fn status(&self) -> Option<Status> {
        self.side.last_status()
    }
}
