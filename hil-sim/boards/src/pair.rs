//! A pair of boards from power-up to the end, each on a thread of its own.

use std::sync::mpsc::sync_channel;
use std::thread;

use protocol::Role;
use rigless::emulator::Start;

use super::display::DisplayPins;
use super::lockstep::{BoardHook, Cable, Lockstep, PORTIONS_READY};
use super::nucleo::{Nucleo, Pins};
use super::sensor::SensorPins;
use super::traps::Traps;
use super::{ElfError, Firmware, Firmwares};
use hil_sim_core::plant::fault::clock::Clock;
use hil_sim_core::plant::fault::encoder::EncoderFaults;
use hil_sim_core::plant::world::World;
use hil_sim_core::run::fault_evidence::Reset;
use hil_sim_core::scene::Scene;

/// What is said of a board whose fellow failed.
const ABANDONED: &str = "the other board stopped";

/// What one board leaves behind.
pub struct Finished<R, W> {
    /// What was written down at its pins and not yet taken.
    pub records: R,
    /// What stood beside it.
    pub witness: W,
    /// Its clock.
    pub clock: Clock,
    /// Instructions that it retired.
    pub instructions: u64,
    /// Its resets after power-up.
    pub resets: Vec<Reset>,
}

type Left<P, W> = Finished<<P as Pins>::Records, W>;
/// What the sensor board leaves behind, and the display board.
pub type Both<S, D> = (Left<SensorPins, S>, Left<DisplayPins, D>);

/// Runs both boards in `scene`, a witness beside each, until the witnesses say that it is over.
///
/// # Errors
/// If a board can't be emulated, or stops before that.
pub fn run<S, D>(
    scene: &Scene,
    firmwares: &Firmwares,
    sensor: S,
    display: D,
) -> Result<Both<S, D>, ElfError>
where
    S: BoardHook<SensorPins>,
    D: BoardHook<DisplayPins>,
{
    let (sensor_pins, display_world) = (SensorPins::of_scene(scene)?, World::new(scene)?);
    let (to_display, from_sensor) = sync_channel(PORTIONS_READY);
    let (to_sensor, from_display) = sync_channel(PORTIONS_READY);
    let sensor_cable = Cable {
        to_peer: to_display,
        from_peer: from_display,
    };
    let display_cable = Cable {
        to_peer: to_sensor,
        from_peer: from_sensor,
    };
    let (sensor, display) = thread::scope(|scope| {
        let sensor = scope.spawn(|| {
            let firmware = &firmwares.sensor;
            drive(
                Role::Sensor,
                Nucleo::new(sensor_pins, SensorPins::fit),
                firmware,
                Lockstep::new(scene, Role::Sensor, &firmware.elf, sensor_cable, sensor),
                scene.duration_s,
            )
        });
        let firmware = &firmwares.display;
        let pins = DisplayPins::new(display_world, EncoderFaults::of_hand(&scene.faults));
        let display = drive(
            Role::Display,
            Nucleo::new(pins, DisplayPins::fit),
            firmware,
            Lockstep::new(scene, Role::Display, &firmware.elf, display_cable, display),
            scene.duration_s,
        );
        (sensor.join(), display)
    });
    let sensor = sensor.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    match (sensor, display) {
        (Ok(sensor), Ok(display)) => Ok((sensor, display)),
        // The board that fails abandons the other: its own reason is the one to tell.
        (Err(error), Ok(_)) | (Ok(_), Err(error)) => Err(error),
        (Err(sensor), Err(display)) if is_abandoned(&sensor) => Err(display),
        (Err(sensor), Err(_)) => Err(sensor),
    }
}

fn is_abandoned(error: &ElfError) -> bool {
    matches!(error, ElfError::Stopped { reason, .. } if reason == ABANDONED)
}

/// Runs one board to its end.
pub(super) fn drive<P: Pins, W: BoardHook<P>>(
    role: Role,
    board: Result<Nucleo<P>, rigless::soc::Error>,
    firmware: &Firmware,
    driver: Lockstep<W>,
    duration_s: f64,
) -> Result<Left<P, W>, ElfError> {
    let name = role.name();
    let board = board.map_err(ElfError::board(name))?;
    let mut images = vec![firmware.image.clone()];
    images.extend(driver.injector().traps().and_then(Traps::image));
    let board = board.running(&images, firmware.processor.clone());
    let first_stop = driver.first_stop();
    let mut finished = board
        .run(&Start::new(&images), first_stop, driver)
        .map_err(ElfError::board(name))?;
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
            duration_s,
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
    let clock = finished.driver.clock().clone();
    let resets = finished.session.resets().iter().map(|reset| Reset {
        role,
        at_ns: clock.true_ns(reset.at.0),
        is_injected: cuts_ns.contains(&reset.at.0),
    });
    let resets = resets.collect();
    let (pins, _) = finished.session.board_mut().pins();
    Ok(Finished {
        records: pins.take_records(),
        witness: finished.driver.witness,
        clock,
        instructions: finished.stop.map_or(0, |stop| stop.instruction_count),
        resets,
    })
}
