//! The `elf` engine: the two ELFs that a user would flash, on two emulated Nucleo-F429ZI boards joined
//! by a UART.

pub mod alone;
pub mod cost;
mod display;
mod firmware;
pub mod instructions;
mod lockstep;
mod nucleo;
mod rtt;
mod sensor;
pub mod soak;
mod wire;

use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::Instant;

use protocol::{Configuration, DisplayConfiguration, Message, Role, SensorConfiguration, Status};
use rigless::emulator::{self, Start};
use rigless::session::Session;
use rigless::soc::stm32f427::Stm32f427;
use rigless::time::VirtualNanos;

pub use firmware::{Firmware, FirmwareError, Firmwares};
pub use lockstep::{QUANTUM_NS, Told, WARM_UP_NS};

use crate::arm::Arm;
use crate::digest::Digest;
use crate::listener::{Listener, Said};
use crate::recording::{Engine, EstimateRecord, Recording, ScanRecord};
use crate::scene::{Scene, SceneError};
use crate::weather::Weather;
use crate::world::World;
use display::{DisplayPins, DisplayRecords};
use lockstep::{Cable, ConsoleHost, Lockstep, Watched};
use nucleo::Nucleo;
use rtt::Log;
use sensor::SensorPins;

/// The two directions' numbers, as in the native engine: the same scene has the same weather.
const TO_DISPLAY: u64 = 0;
const TO_SENSOR: u64 = 1;

const SCANS_PER_ESTIMATE: usize =
    (firmware_sensor::SCAN_RATE_HZ / firmware_sensor::ESTIMATE_RATE_HZ) as usize;

/// Why a run on emulated boards failed.
#[derive(Debug, thiserror::Error)]
pub enum ElfError {
    /// The scene's world can't be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A firmware can't be used.
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    /// A board could not be put together.
    #[error("the {board} board can't be emulated: {reason}")]
    Board {
        /// Which board.
        board: &'static str,
        /// What the emulator said.
        reason: String,
    },
    /// A board stopped before the scene's end.
    #[error("the {board} board stopped at {at_s:.6} s of {duration_s} s: {reason}")]
    Stopped {
        /// Which board.
        board: &'static str,
        /// When, in virtual seconds.
        at_s: f64,
        /// How long the scene is.
        duration_s: f64,
        /// What was seen.
        reason: String,
    },
    /// A board does not take the configuration that the scene asks for.
    #[error("the {board} board does not run as the scene asks: {reason}")]
    Configuration {
        /// Which board.
        board: &'static str,
        /// What it answered.
        reason: String,
    },
    /// The firmware touched what the emulator has no model for.
    #[error(
        "the {board} board's firmware reached an address that no model answers for: {address:#010x}"
    )]
    Unmapped {
        /// Which board.
        board: &'static str,
        /// The address.
        address: u64,
    },
}

/// What one board leaves behind.
struct Outcome<T> {
    left: T,
    driver: Lockstep,
    instructions: u64,
    resets: usize,
}

/// What only the `elf` engine knows, beside the [`Recording`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BoardFacts {
    /// Instructions the sensor board retired.
    pub sensor_instructions: u64,
    /// Instructions the display board retired.
    pub display_instructions: u64,
    /// Resets of either board after power-up.
    pub resets: usize,
    /// How often CLR fell after it was first released.
    pub clears: u32,
    /// Frames that a DAC81416 could not make sense of.
    pub dac_frame_errors: u64,
    /// How the sensor board was configured over its console, if the scene does not want its default.
    pub sensor_told: Option<Told>,
    /// The same of the display board.
    pub display_told: Option<Told>,
}

/// Runs `scene` on the two firmwares.
pub fn run(scene: &Scene, firmwares: &Firmwares) -> Result<(Recording, BoardFacts), ElfError> {
    let end_ns = (scene.duration_s * 1e9).ceil() as u64;
    let sensor_world = World::new(scene)?;
    let display_world = World::new(scene)?;
    let arm = Arm::new(&scene.arm, &scene.motion);
    let (to_display, from_sensor) = sync_channel(1);
    let (to_sensor, from_display) = sync_channel(1);

    let sensor_driver = Lockstep::new(
        Cable {
            to_peer: to_display,
            from_peer: from_display,
        },
        Weather::new(&scene.link, scene.seed, TO_SENSOR),
        console_for(scene, Role::Sensor),
        Log::find(&firmwares.sensor.elf),
        end_ns,
    );
    let display_driver = Lockstep::new(
        Cable {
            to_peer: to_sensor,
            from_peer: from_sensor,
        },
        Weather::new(&scene.link, scene.seed, TO_DISPLAY),
        console_for(scene, Role::Display),
        Log::find(&firmwares.display.elf),
        end_ns,
    );

    let started = Instant::now();
    let (sensor, display) = thread::scope(|scope| {
        let sensor = scope.spawn(|| {
            let board = Nucleo::new(
                SensorPins::new(sensor_world, arm, scene.sensor_configuration()),
                SensorPins::fit,
            );
            let take = |pins: &mut SensorPins, _: &mut Stm32f427| std::mem::take(&mut pins.scans);
            drive(
                "sensor",
                board,
                &firmwares.sensor,
                sensor_driver,
                end_ns,
                take,
            )
        });
        let board = Nucleo::new(DisplayPins::new(display_world), DisplayPins::fit);
        let display = drive(
            "display",
            board,
            &firmwares.display,
            display_driver,
            end_ns,
            DisplayPins::leave,
        );
        (sensor.join(), display)
    });
    let ended = Instant::now();
    let sensor = sensor.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    // The board that fails abandons the other: its own reason is the one to tell.
    let (sensor, display) = match (sensor, display) {
        (Ok(sensor), Ok(display)) => (sensor, display),
        (Err(error), Ok(_)) | (Ok(_), Err(error)) => return Err(error),
        (Err(sensor), Err(display)) => {
            return Err(if is_abandoned(&sensor) {
                display
            } else {
                sensor
            });
        }
    };
    let facts = BoardFacts {
        sensor_instructions: sensor.instructions,
        display_instructions: display.instructions,
        resets: sensor.resets + display.resets,
        clears: display.left.clears,
        dac_frame_errors: display.left.dac_frame_errors,
        sensor_told: told("sensor", &sensor.driver)?,
        display_told: told("display", &display.driver)?,
    };
    let (begun, warm_up_s) = match sensor.driver.warm {
        Some(warm) => (warm, WARM_UP_NS as f64 * 1e-9),
        None => (started, 0.0),
    };
    let pace = (warm_up_s, (ended - begun).as_secs_f64());
    Ok((record(scene, sensor, display, pace), facts))
}

const ABANDONED: &str = "the other board stopped";

fn is_abandoned(error: &ElfError) -> bool {
    matches!(error, ElfError::Stopped { reason, .. } if reason == ABANDONED)
}

/// A host on the console, if the scene wants of the board what is not its default.
fn console_for(scene: &Scene, role: Role) -> Option<ConsoleHost> {
    match role {
        Role::Display => {
            let wanted = scene.display_configuration();
            (wanted != DisplayConfiguration::DEFAULT).then(|| {
                let described = (wanted.actuators != DisplayConfiguration::DEFAULT.actuators)
                    .then_some(&*scene.display.actuators);
                ConsoleHost::new(Configuration::Display(wanted), described)
            })
        }
        _ => {
            let wanted = scene.sensor_configuration();
            (wanted != SensorConfiguration::DEFAULT)
                .then(|| ConsoleHost::new(Configuration::Sensor(wanted), None))
        }
    }
}

/// What the board answered, if it was asked for anything.
fn told(name: &'static str, driver: &Lockstep) -> Result<Option<Told>, ElfError> {
    let reason = match driver.told() {
        None if driver.is_asked() => {
            "it has not answered by the scene's end: give a longer duration_s".to_owned()
        }
        told => match told.and_then(|told| told.report.refused) {
            None => return Ok(told),
            Some(refusal) => refusal.to_string(),
        },
    };
    Err(ElfError::Configuration {
        board: name,
        reason,
    })
}

fn drive<P: Watched, T>(
    name: &'static str,
    board: Result<Nucleo<P>, rigless::soc::Error>,
    firmware: &Firmware,
    driver: Lockstep,
    end_ns: u64,
    take: impl FnOnce(&mut P, &mut Stm32f427) -> T,
) -> Result<Outcome<T>, ElfError> {
    let board_error = |reason: String| ElfError::Board {
        board: name,
        reason,
    };
    let board = board.map_err(|error| board_error(error.to_string()))?;
    let first_stop = VirtualNanos(QUANTUM_NS);
    let session = Session::new(Box::new(board), 0, first_stop)
        .map_err(|error| board_error(error.to_string()))?;
    let images = [firmware.image.clone()];
    let mut finished = emulator::run(session, &Start::new(&images), driver)
        .map_err(|error| board_error(error.to_string()))?;
    let at_ns = finished.stop.map_or(0, |stop| stop.at.0);
    if finished.driver.abandoned || at_ns < end_ns {
        let reason = if finished.driver.abandoned {
            ABANDONED.to_owned()
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
    let resets = finished.session.resets().len();
    let (pins, part) = finished.session.board_mut().pins();
    Ok(Outcome {
        left: take(pins, part),
        driver: finished.driver,
        instructions: finished.stop.map_or(0, |stop| stop.instruction_count),
        resets,
    })
}

fn record(
    scene: &Scene,
    sensor: Outcome<Vec<ScanRecord>>,
    display: Outcome<DisplayRecords>,
    (warm_up_s, wall_s): (f64, f64),
) -> Recording {
    let mut digest = Digest::default();
    digest.link(&sensor.driver.sent);
    digest.link(&display.driver.sent);
    digest.outputs(&display.left.outputs);

    // What the sensor said, and what of it reached the display.
    let mut said = Listener::default();
    said.hear(&sensor.driver.sent);
    let mut heard = Listener::default();
    heard.hear(&display.driver.heard);
    let mut display_said = Listener::default();
    display_said.hear(&display.driver.sent);

    let clock_offset_ns = clock_offset_ns(&said, &sensor.left);
    let mut estimates: Vec<EstimateRecord> = Vec::new();
    for Said { message, .. } in said.messages() {
        if let Message::Estimate(estimate) = message {
            estimates.push(EstimateRecord {
                made_ns: (estimate.instant_us * 1_000).saturating_add_signed(-clock_offset_ns),
                received_ns: None,
                estimate: *estimate,
            });
        }
    }
    for Said { at_ns, message } in heard.messages() {
        if let Message::Estimate(received) = message
            && let Some(record) = estimates
                .iter_mut()
                .find(|record| record.estimate == *received && record.received_ns.is_none())
        {
            record.received_ns = Some(*at_ns);
        }
    }
    let mut log: Vec<(u64, &'static str, String)> = Vec::new();
    for (board, driver) in [("sensor", &sensor.driver), ("display", &display.driver)] {
        log.extend(
            driver
                .log_lines()
                .into_iter()
                .map(|(at_ns, line)| (at_ns, board, line)),
        );
    }
    log.sort_by_key(|&(at_ns, ..)| at_ns);
    Recording {
        engine: Engine::Elf,
        duration_s: scene.duration_s,
        warm_up_s,
        wall_s,
        hash: digest.finish(),
        scans: sensor.left,
        ticks: display.left.ticks,
        estimates,
        outputs: display.left.outputs,
        sensor_status: last_status(&said),
        display_status: last_status(&display_said),
        log,
    }
}

/// What the sensor's clock is ahead of the scene's, from the first estimate and the scan that it ends with.
fn clock_offset_ns(said: &Listener, scans: &[ScanRecord]) -> i64 {
    let first = said.messages().find_map(|said| match said.message {
        Message::Estimate(estimate) => Some(estimate),
        _ => None,
    });
    let Some(estimate) = first else { return 0 };
    let scan = (estimate.sequence as usize + 1) * SCANS_PER_ESTIMATE - 1;
    scans.get(scan).map_or(0, |scan| {
        (estimate.instant_us * 1_000).cast_signed() - scan.at_ns.cast_signed()
    })
}

fn last_status(listener: &Listener) -> Option<Status> {
    listener
        .messages()
        .rev()
        .find_map(|said| match said.message {
            Message::Status(status) => Some(status),
            _ => None,
        })
}
