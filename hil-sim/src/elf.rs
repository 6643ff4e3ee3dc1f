//! The `elf` engine: the two ELFs that a user would flash, on two emulated Nucleo-F429ZI boards joined
//! by a UART.

pub mod alone;
mod console;
pub mod cost;
mod display;
mod firmware;
mod injector;
pub mod instructions;
mod lockstep;
mod nucleo;
mod rtt;
mod sensor;
pub mod soak;
mod terminal;
mod traps;
mod wire;

use std::sync::mpsc::sync_channel;
use std::thread;
use std::time::Instant;

use protocol::{Message, Role, Status};
use rigless::emulator::{self, Start};
use rigless::session::Session;
use rigless::soc::stm32f427::Stm32f427;
use rigless::time::VirtualNanos;

pub use console::Told;
pub use firmware::{Firmware, FirmwareError, Firmwares};
pub use lockstep::{QUANTUM_NS, WARM_UP_NS};
pub use terminal::{Terminal, Terminals};

use crate::arm::Arm;
use crate::digest::Digest;
use crate::fault::{HandFault, Reset, Signs};
use crate::listener::{Listener, Said};
use crate::recording::{Engine, EstimateRecord, Recording, ScanRecord};
use crate::scene::{Scene, SceneError};
use crate::world::World;
use display::{DisplayPins, DisplayRecords};
use lockstep::{Cable, Lockstep, Watched};
use nucleo::Nucleo;
use sensor::SensorPins;
use traps::Traps;

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
    /// A fault needs to know where something is in the firmware, and it is not to be found.
    #[error(
        "the {board} board can't be broken by \"{kind}\": its ELF does not show where: build it with symbols, as ./test does"
    )]
    Fault {
        /// Which board.
        board: &'static str,
        /// The fault's kind.
        kind: &'static str,
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
    resets: Vec<Reset>,
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
///
/// # Errors
/// If a board can't be emulated, stops before the scene's end, or does not take its configuration.
pub fn run(scene: &Scene, firmwares: &Firmwares) -> Result<(Recording, BoardFacts), ElfError> {
    run_at(scene, firmwares, Terminals::default())
}

/// The same, with somebody at the consoles.
///
/// # Errors
/// The same.
pub fn run_at(
    scene: &Scene,
    firmwares: &Firmwares,
    terminals: Terminals,
) -> Result<(Recording, BoardFacts), ElfError> {
    let end_ns = (scene.duration_s * 1e9).ceil() as u64;
    let sensor_world = World::new(scene)?;
    let display_world = World::new(scene)?;
    let arm = Arm::new(&scene.arm, &scene.motion);
    let (to_display, from_sensor) = sync_channel(1);
    let (to_sensor, from_display) = sync_channel(1);

    let mut sensor_driver = Lockstep::new(
        scene,
        Role::Sensor,
        &firmwares.sensor.elf,
        Cable {
            to_peer: to_display,
            from_peer: from_display,
        },
    );
    let mut display_driver = Lockstep::new(
        scene,
        Role::Display,
        &firmwares.display.elf,
        Cable {
            to_peer: to_sensor,
            from_peer: from_sensor,
        },
    );
    sensor_driver.terminal = terminals.sensor;
    display_driver.terminal = terminals.display;

    let started = Instant::now();
    let (sensor, display) = thread::scope(|scope| {
        let sensor = scope.spawn(|| {
            let board = Nucleo::new(
                SensorPins::new(
                    sensor_world,
                    arm,
                    scene.sensor_configuration(),
                    &scene.faults,
                ),
                SensorPins::fit,
            );
            let take = |pins: &mut SensorPins, _: &mut Stm32f427| std::mem::take(&mut pins.scans);
            drive(
                Role::Sensor,
                board,
                &firmwares.sensor,
                sensor_driver,
                end_ns,
                take,
            )
        });
        let board = Nucleo::new(
            DisplayPins::new(display_world, HandFault::new(&scene.faults)),
            DisplayPins::fit,
        );
        let display = drive(
            Role::Display,
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
        resets: sensor.resets.len() + display.resets.len(),
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
    role: Role,
    board: Result<Nucleo<P>, rigless::soc::Error>,
    firmware: &Firmware,
    driver: Lockstep,
    end_ns: u64,
    take: impl FnOnce(&mut P, &mut Stm32f427) -> T,
) -> Result<Outcome<T>, ElfError> {
    let name = role.name();
    let board_error = |reason: String| ElfError::Board {
        board: name,
        reason,
    };
    let board = board.map_err(|error| board_error(error.to_string()))?;
    let first_stop = VirtualNanos(QUANTUM_NS);
    let session = Session::new(Box::new(board), 0, first_stop)
        .map_err(|error| board_error(error.to_string()))?;
    let mut images = vec![firmware.image.clone()];
    images.extend(driver.injector().traps().and_then(Traps::image));
    let mut finished = emulator::run(session, &Start::new(&images), driver)
        .map_err(|error| board_error(error.to_string()))?;
    let at_ns = finished.stop.map_or(0, |stop| stop.at.0);
    if !finished.driver.is_done {
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
    if let Some(kind) = finished.driver.injector().failed {
        return Err(ElfError::Fault {
            board: name,
            kind: kind.name(),
        });
    }
    // A board that is broken may well reach where nothing answers.
    if let Some(unmapped) = finished.session.unmapped().first()
        && !finished.driver.injector().breaks()
    {
        return Err(ElfError::Unmapped {
            board: name,
            address: unmapped.address,
        });
    }
    let cuts_ns = &finished.driver.injector().cuts_ns;
    let clock = finished.driver.clock();
    let resets = finished.session.resets().iter().map(|reset| Reset {
        role,
        at_ns: clock.true_ns(reset.at.0),
        is_injected: cuts_ns.contains(&reset.at.0),
    });
    let resets = resets.collect();
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
    // A sensor that has started again, or goes by a clock of its own, says nothing of the scene's.
    let keeps_time = sensor.driver.clock().is_true() && sensor.resets.is_empty();
    for Said { at_ns, message } in said.messages() {
        if let Message::Estimate(estimate) = message {
            let made_ns = (estimate.instant_us * 1_000).saturating_add_signed(-clock_offset_ns);
            estimates.push(EstimateRecord {
                made_ns: if keeps_time { made_ns } else { *at_ns },
                received_ns: None,
                estimate: *estimate,
            });
        }
    }
    // Estimates come in their order but for a few.
    const REORDERED: usize = 256;
    let mut last: usize = 0;
    for Said { at_ns, message } in heard.messages() {
        let from = last.saturating_sub(REORDERED);
        if let Message::Estimate(received) = message
            && let Some(found) = estimates[from..]
                .iter()
                .position(|record| record.estimate == *received && record.received_ns.is_none())
        {
            last = from + found;
            estimates[last].received_ns = Some(*at_ns);
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
    let sensor_status = last_status(&said);
    let display_status = last_status(&display_said);
    let mut resets = sensor.resets;
    resets.extend(display.resets);
    resets.sort_by_key(|reset| reset.at_ns);
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
        sensor_status,
        display_status,
        log,
        signs: Signs {
            display: display_said.into_messages(),
            sensor: said.into_messages(),
            resets,
            clears_ns: display.left.clears_ns,
        },
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
