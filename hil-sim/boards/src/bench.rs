//! A bench to try things on: the emulated pair, held to a wall clock, with each board's ports as
//! pseudo-terminals. What meets the real boards meets these.
//!
//! A folder holds the ports by stable names, and `bench.toml`, which tells a host-bridge of them. Nothing
//! of what goes by is kept: a bench may stand for days.

mod baud;
mod command;
mod computer;
mod folder;
pub mod live_hand;
mod pace;
mod port_server;
mod pty;
mod socket;
pub mod surroundings;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use protocol::Role;
use strum::{Display, EnumString, IntoStaticStr, VariantArray};

pub use command::{Command, NoCommand};
pub use pace::Pace;
pub use port_server::{Outputs, SensorView};

use super::pair;
use super::{ElfError, Firmwares};
use crate::bench::live_hand::DrivenHand;
use computer::Computer;
use folder::Folder;
use hil_sim_core::link::channel::LinkChannel;
use hil_sim_core::scene::{Gauges, Link, LiveHand, Motion, Scene, SceneError, Specimen};
use pace::Pacer;
use port_server::{PortServer, Shared};
use socket::Socket;
use surroundings::Surroundings;

/// The folder that benches stand in by default.
pub const DEFAULT_DIR: &str = "target/serve";

/// How long the ports stay after a bench at [`Pace::Max`] is over, for what their readers have not got yet.
const LINGERS: Duration = Duration::from_millis(500);
const LOOKS: Duration = Duration::from_millis(5);

/// One of a bench's ports.
#[derive(Clone, Copy, Debug, Display, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum PortName {
    /// The sensor board's console.
    SensorConsole,
    /// The display board's console.
    DisplayConsole,
    /// The sensor board's port to its peer, if the boards are not joined.
    SensorLink,
    /// The display board's port to its peer, if the boards are not joined.
    DisplayLink,
    /// The raw bytes of the sensor board's RTT channel 0.
    SensorRtt,
    /// The raw bytes of the display board's RTT channel 0.
    DisplayRtt,
}

impl PortName {
    /// All of them.
    pub const ALL: [Self; 6] = *Self::VARIANTS.as_array().unwrap();

    /// Its name in the bench's folder.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether it has a baud rate.
    const fn is_serial(self) -> bool {
        !matches!(self, Self::SensorRtt | Self::DisplayRtt)
    }

    /// Whether it is there only if the boards are not joined.
    const fn is_link(self) -> bool {
        matches!(self, Self::SensorLink | Self::DisplayLink)
    }
}

/// Who moves the operator's hand.
#[derive(Clone, Debug)]
pub enum Hand {
    /// The scene: for as long as the bench stands, what is recorded to and fro.
    Scene,
    /// Rests until [`Command::Hand`] says otherwise.
    Told,
    /// A recording in place of the scene's motion, to and fro.
    Recorded(Motion),
}

/// The bench to be set up.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where its ports are to be found; made if it is not there.
    pub dir: PathBuf,
    /// What is rubbed, how, through which weather. How long it lasts does not count.
    pub scene: Scene,
    /// Who moves the hand.
    pub hand: Hand,
    /// How fast time goes by on this computer.
    pub pace: Pace,
    /// Whose time it is and what the ports lead to; none: this computer's clock and pseudo-terminals.
    pub surroundings: Option<Arc<dyn Surroundings>>,
    /// Whether the boards are not joined: each has its port to the peer in the folder, for two bridges.
    pub is_apart: bool,
    /// When it is over, in virtual seconds; none: when it is told to stop.
    pub until_s: Option<f64>,
}

impl Options {
    /// At real time, joined, without an end: a hand that swings at 0.83 Hz and up to 70 mm/s over specimens
    /// of 2 and 3 mm, whose border is in the middle of the stroke. Shorter ones would pass before they are felt:
    /// the gauges alone reach over 6 mm.
    pub fn new(dir: impl Into<PathBuf>) -> Self {
        let mut scene = Scene::constant(1.0, 0.0);
        scene.name = "bench".to_owned();
        // The stroke is 27 mm long.
        scene.surface.specimens = [(2.0, 13.5), (3.0, f64::INFINITY)]
            .map(|(wavelength_mm, length_mm)| Specimen {
                wavelength_mm,
                length_mm,
            })
            .to_vec();
        scene.motion = Motion::Sinusoid {
            amplitude_mm_s: 70.0,
            frequency_hz: 0.83,
        };
        Self {
            dir: dir.into(),
            scene,
            hand: Hand::Scene,
            pace: Pace::REAL,
            surroundings: None,
            is_apart: false,
            until_s: None,
        }
    }
}

/// Why a bench can't be set up, or does not stand any more.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ServeError {
    /// Another bench has the folder.
    #[error("{}: another bench stands here: stop it, or give another folder by --dir", path.display())]
    Taken { path: PathBuf },
    /// The folder can't be used.
    #[error("{}: can't be used for a bench's ports: give another folder by --dir", path.display())]
    Folder { path: PathBuf, source: io::Error },
    /// There is no pseudo-terminal for a port.
    #[error("{name}: no pseudo-terminal: is /dev/pts mounted, and are there any left?")]
    Terminal { name: PortName, source: io::Error },
    /// The port is not there.
    #[error("{name}: there is no such port while the boards are joined: set the bench up --apart")]
    Joined { name: PortName },
    /// The scene has weather or faults on a wire that is not there.
    #[error(
        "the scene has weather or faults on the wire between the boards, and --apart takes it out: leave \
         [link] and the link's faults to the bridges, or the boards joined"
    )]
    Impairments,
    /// The wire is not there.
    #[error("{mistake}: there is no wire between the boards of a bench that is --apart")]
    NoWire { mistake: &'static str },
    /// The scene has a host do wrong.
    #[error(
        "the scene's fault \"{kind}\" needs the console, which is yours on a bench: take it out"
    )]
    Console { kind: &'static str },
    /// The gauges are recorded.
    #[error(
        "the scene's gauges are recorded, and feel no other hand than the scene's: give a scene with \
         kinematic gauges"
    )]
    Gauges,
    /// The boards can't be run, or don't run as the scene asks.
    #[error(transparent)]
    Elf(#[from] ElfError),
    /// A board has stopped.
    #[error("the {board} board stopped at {at_s:.6} s: {reason}")]
    Stopped {
        board: &'static str,
        at_s: f64,
        reason: String,
    },
    /// It is over.
    #[error("the bench is over")]
    Over,
}

impl ServeError {
    /// What the system says of a folder, or of what is in the way in it.
    fn folder(path: &Path) -> impl Fn(io::Error) -> Self {
        move |source| Self::Folder {
            path: path.to_owned(),
            source,
        }
    }
}

impl From<SceneError> for ServeError {
    fn from(error: SceneError) -> Self {
        Self::Elf(error.into())
    }
}

/// What a bench does at the moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BenchStatus {
    /// Virtual time, in s.
    pub now_s: f64,
    /// How far the wall clock is ahead, in all that was given up and not, in s. 0 at [`Pace::Max`].
    pub behind_s: f64,
    /// The hand's velocity, in mm/s.
    pub hand_mm_s: f64,
    /// What the sensor board said last, and what is true.
    pub sensed: SensorView,
    /// Bytes that were lost because a port's reader was too slow.
    pub dropped: u64,
}

/// A pair of boards with ports to plug into. Dropped, it is stopped, and its ports are gone.
#[derive(Debug)]
pub struct Bench {
    shared: Arc<Shared>,
    hand: Arc<DrivenHand>,
    has_recorded_gauges: bool,
    folder: Arc<Folder>,
    runner: Option<JoinHandle<Result<(), ServeError>>>,
}

impl Bench {
    /// Sets a bench up. The boards are set as the scene asks and the ports are there when this returns.
    ///
    /// # Errors
    /// If the folder is another bench's or can't be used, a board can't be emulated or refuses what the
    /// scene asks, or the scene asks for what a bench can't do.
    pub fn start(options: Options, firmwares: &Firmwares) -> Result<Self, ServeError> {
        let (mut scene, is_apart, until_s) = (options.scene, options.is_apart, options.until_s);
        check(&scene, &options.hand, is_apart)?;
        let folder = Arc::new(Folder::take(&options.dir)?);
        let has_recorded_gauges = matches!(scene.gauges, Gauges::Recorded(_));
        let hand = Arc::new(live(&scene, options.hand));
        scene.motion = Motion::Live(hand.clone());
        scene.duration_s = until_s.unwrap_or(f64::INFINITY);
        let surroundings = options
            .surroundings
            .unwrap_or_else(|| Arc::new(Computer::new(Pacer::new(options.pace))));
        let shared = Arc::new(Shared {
            sockets: PortName::ALL
                .map(|name| Socket::new(name, folder.clone(), surroundings.clone())),
            surroundings,
            is_apart,
            waits: options.pace == Pace::Max,
            now_ns: AtomicU64::new(0),
            behind_us: AtomicU64::new(0),
            end_ns: AtomicU64::new(until_s.map_or(u64::MAX, |until_s| (until_s * 1e9) as u64)),
            stops: AtomicBool::new(false),
            sensed: Mutex::default(),
            outputs: Mutex::default(),
            orders: Mutex::default(),
        });
        let (ready, is_ready) = channel();
        let beside =
            |role, elf: &[u8]| PortServer::new(&scene, role, elf, shared.clone(), ready.clone());
        let sensor = beside(Role::Sensor, &firmwares.sensor.elf);
        let display = beside(Role::Display, &firmwares.display.elf);
        drop(ready);
        let runner = std::thread::spawn({
            let (shared, firmwares) = (shared.clone(), firmwares.clone());
            move || run(&scene, &firmwares, sensor, display, &shared)
        });
        let mut bench = Self {
            shared,
            hand,
            has_recorded_gauges,
            folder,
            runner: Some(runner),
        };
        for _ in [Role::Sensor, Role::Display] {
            let Ok(answer) = is_ready.recv() else {
                // A board has stopped, which says more.
                bench.end()?;
                return Err(ServeError::Over);
            };
            answer?;
        }
        for name in PortName::ALL {
            if is_apart || !name.is_link() {
                bench.shared.socket(name).plug()?;
            }
        }
        bench.folder.describe(firmwares)?;
        Ok(bench)
    }

    /// Where a port is when its cable is plugged in: a link in the bench's folder, whose name stays.
    pub fn path(&self, name: PortName) -> PathBuf {
        self.folder.port(name)
    }

    /// The file that tells a host-bridge of the bench.
    pub fn bench_file(&self) -> PathBuf {
        self.folder.bench_file()
    }

    /// The scene's time, in s.
    pub fn now_s(&self) -> f64 {
        self.shared.now_s()
    }

    /// Pulls a port's cable: whoever has it open finds it hung up, and its name is gone.
    ///
    /// # Errors
    /// If the port is not there.
    pub fn pull(&self, name: PortName) -> Result<(), ServeError> {
        self.socket(name)?.pull();
        Ok(())
    }

    /// Puts it back.
    ///
    /// # Errors
    /// If the port is not there, or can't be made.
    pub fn plug(&self, name: PortName) -> Result<(), ServeError> {
        self.socket(name)?.plug()
    }

    /// Whether a port's cable is plugged in.
    pub fn is_plugged(&self, name: PortName) -> bool {
        self.shared.socket(name).is_plugged()
    }

    /// Whether somebody has a port open.
    pub fn has_client(&self, name: PortName) -> bool {
        self.shared.socket(name).has_client()
    }

    fn socket(&self, name: PortName) -> Result<&Socket, ServeError> {
        if name.is_link() && !self.shared.is_apart {
            return Err(ServeError::Joined { name });
        }
        Ok(self.shared.socket(name))
    }

    /// Does something to the bench. What concerns a board is done at the end of the quantum.
    ///
    /// # Errors
    /// If it can't be done.
    pub fn command(&self, command: Command) -> Result<(), ServeError> {
        match command {
            Command::Pull(name) => self.pull(name)?,
            Command::Plug(name) => self.plug(name)?,
            Command::Hand { .. } if self.has_recorded_gauges => return Err(ServeError::Gauges),
            Command::Hand { speed_mm_s } => self.hand.go(speed_mm_s),
            Command::Reset(role) => self.shared.order(role, command),
            Command::Stop | Command::Release => self.shared.order(Role::Display, command),
            Command::Wrong(mistake) | Command::Right(mistake) => {
                if self.shared.is_apart && mistake.is_of_link() {
                    let mistake = mistake.name();
                    return Err(ServeError::NoWire { mistake });
                }
                for role in [Role::Sensor, Role::Display] {
                    if mistake.is_at(role) {
                        self.shared.order(role, command);
                    }
                }
            }
            Command::Quit => self.shared.stops.store(true, Ordering::Relaxed),
        }
        Ok(())
    }

    /// What the display's converters put out.
    pub fn outputs(&self) -> Outputs {
        *lock(&self.shared.outputs)
    }

    /// What the bench does at the moment.
    pub fn standing(&self) -> BenchStatus {
        let now_s = self.now_s();
        BenchStatus {
            now_s,
            behind_s: self.shared.behind_us.load(Ordering::Relaxed) as f64 * 1e-6,
            hand_mm_s: self.hand.velocity_mm_s(now_s),
            sensed: *lock(&self.shared.sensed),
            dropped: self.shared.sockets.iter().map(Socket::dropped).sum(),
        }
    }

    /// Whether it is over: its end has come, it was told to stop, or a board has stopped.
    pub fn is_over(&self) -> bool {
        self.runner.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Stops it, if it is not over.
    ///
    /// # Errors
    /// If a board stopped before.
    pub fn stop(mut self) -> Result<(), ServeError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), ServeError> {
        self.shared.stops.store(true, Ordering::Relaxed);
        match self.runner.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            None => Ok(()),
        }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.shared.stops.store(true, Ordering::Relaxed);
        // Who drops a bench has no use for its result.
        let _ = self.runner.take().map(JoinHandle::join);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether a bench can do what `scene` asks.
fn check(scene: &Scene, hand: &Hand, is_apart: bool) -> Result<(), ServeError> {
    if let Some(fault) = scene.faults.iter().find(|fault| fault.kind.is_of_host()) {
        let kind = fault.kind.name();
        return Err(ServeError::Console { kind });
    }
    let disturbed = scene.link != Link::default()
        || [Role::Sensor, Role::Display]
            .into_iter()
            .any(|role| LinkChannel::new(scene, role).has_faults());
    if is_apart && disturbed {
        return Err(ServeError::Impairments);
    }
    match (&scene.gauges, hand) {
        (Gauges::Recorded(_), Hand::Told | Hand::Recorded(_)) => Err(ServeError::Gauges),
        _ => Ok(()),
    }
}

/// The hand of a scene that has no end.
fn live(scene: &Scene, hand: Hand) -> DrivenHand {
    let whole = |motion: &Motion| match motion {
        Motion::Recorded(positions) => Some(positions.extent()),
        _ => None,
    };
    match hand {
        // What is recorded of one scene goes on together.
        Hand::Scene => {
            let is_recorded = matches!(scene.gauges, Gauges::Recorded(_))
                || matches!(scene.motion, Motion::Recorded(_));
            let recorded_s = is_recorded.then_some((0.0, scene.duration_s));
            DrivenHand::new(scene.motion.clone(), recorded_s)
        }
        Hand::Told => DrivenHand::new(Motion::Constant { speed_mm_s: 0.0 }, None),
        Hand::Recorded(motion) => {
            let recorded_s = whole(&motion);
            DrivenHand::new(motion, recorded_s)
        }
    }
}

fn run(
    scene: &Scene,
    firmwares: &Firmwares,
    sensor: PortServer,
    display: PortServer,
    shared: &Shared,
) -> Result<(), ServeError> {
    let ended = pair::run(scene, firmwares, sensor, display);
    match ended {
        Ok(_) => {}
        Err(ElfError::Stopped {
            board,
            at_s,
            reason,
            ..
        }) => {
            return Err(ServeError::Stopped {
                board,
                at_s,
                reason,
            });
        }
        Err(error) => return Err(error.into()),
    }
    if shared.waits && !shared.stops.load(Ordering::Relaxed) {
        let begun = Instant::now();
        while begun.elapsed() < LINGERS && shared.has_clients() {
            std::thread::sleep(LOOKS);
        }
    }
    Ok(())
}
