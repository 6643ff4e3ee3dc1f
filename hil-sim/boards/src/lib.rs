//! The `elf` engine: the two ELFs that a user would flash, on two emulated Nucleo-F429ZI boards joined
//! by a UART.

#[cfg(target_os = "linux")]
pub mod bench;
mod console;
pub mod cost;
pub mod cycles;
pub mod dac81416;
mod display;
pub mod display_alone;
mod firmware;
mod injector;
pub mod instructions;
pub mod jig;
mod lockstep;
mod nucleo;
mod pair;
mod processor_pool;
mod recorder;
mod rtt;
pub mod semihosted;
mod sensor;
pub mod sensor_alone;
pub mod soak;
mod terminal;
mod traps;
mod wire;
pub mod wiring;

use std::time::Instant;

use protocol::{Message, Role, Status};

pub use console::Told;
pub use firmware::{Firmware, FirmwareError, Firmwares};
pub use lockstep::QUANTUM_NS;
pub use recorder::WARM_UP_NS;
pub use terminal::{Terminal, Terminals};

use display::DisplayRecords;
use hil_sim_core::run::decoder::{MessageDecoder, TimedMessage};
use hil_sim_core::run::digest::Digest;
use hil_sim_core::run::fault_evidence::{FaultEvidence, Reset};
use hil_sim_core::run::recording::{Arrival, Engine, EstimateRecord, Recording, ScanRecord};
use hil_sim_core::scene::{Scene, SceneError};
use pair::Finished;
use recorder::Recorder;

const SCANS_PER_ESTIMATE: usize =
    (firmware_sensor::SCAN_RATE_HZ / firmware_sensor::ESTIMATE_RATE_HZ) as usize;

/// Why a run on emulated boards failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ElfError {
    /// The scene's world can't be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A firmware can't be used.
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    /// A board could not be put together.
    #[error("the {board} board can't be emulated: {reason}")]
    Board { board: &'static str, reason: String },
    /// A board stopped before the scene's end.
    #[error("the {board} board stopped at {at_s:.6} s of {duration_s} s: {reason}")]
    Stopped {
        board: &'static str,
        at_s: f64,
        duration_s: f64,
        reason: String,
    },
    /// A board does not take the configuration that the scene asks for.
    #[error("the {board} board does not run as the scene asks: {reason}")]
    Configuration { board: &'static str, reason: String },
    /// A fault needs to know where something is in the firmware, and it is not to be found.
    #[error(
        "the {board} board can't be broken by \"{kind}\": its ELF does not show where: build it with symbols, as ./test does"
    )]
    Fault {
        board: &'static str,
        kind: &'static str,
    },
    /// The firmware touched what the emulator has no model for.
    #[error(
        "the {board} board's firmware reached an address that no model answers for: {address:#010x}"
    )]
    Unmapped { board: &'static str, address: u64 },
}

impl ElfError {
    /// What the emulator said of a board.
    fn board<E: ToString>(board: &'static str) -> impl Fn(E) -> Self {
        move |error| Self::Board {
            board,
            reason: error.to_string(),
        }
    }
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
    let started = Instant::now();
    let beside =
        |role, firmware: &Firmware, terminal| Recorder::new(scene, role, &firmware.elf, terminal);
    let (sensor, display) = pair::run(
        scene,
        firmwares,
        beside(Role::Sensor, &firmwares.sensor, terminals.sensor),
        beside(Role::Display, &firmwares.display, terminals.display),
    )?;
    let ended = Instant::now();
    let facts = BoardFacts {
        sensor_instructions: sensor.instructions,
        display_instructions: display.instructions,
        resets: sensor.resets.len() + display.resets.len(),
        clears: display.records.clears,
        dac_frame_errors: display.records.dac_frame_errors,
        sensor_told: sensor.witness.told("sensor")?,
        display_told: display.witness.told("display")?,
    };
    let pace = recorder::pace(started, sensor.witness.warm, ended);
    Ok((record(scene, sensor, Some(display), pace), facts))
}

/// What both boards leave behind, or the sensor board if it ran alone.
fn record(
    scene: &Scene,
    sensor: Finished<Vec<ScanRecord>, Recorder>,
    display: Option<Finished<DisplayRecords, Recorder>>,
    (warm_up_s, wall_s): (f64, f64),
) -> Recording {
    let mut digest = Digest::default();
    digest.link(&sensor.witness.sent);

    // What the sensor said, and what of it reached the display.
    let said = read(&sensor.witness.sent, &sensor.resets);
    let mut heard = MessageDecoder::default();
    let mut display_said = MessageDecoder::default();
    let mut log: Vec<(u64, &'static str, String)> = Vec::new();
    let mut log_of = |board, witness: &Recorder| {
        let lines = witness.log_lines().into_iter();
        log.extend(lines.map(|(at_ns, line)| (at_ns, board, line)));
    };
    log_of("sensor", &sensor.witness);
    let mut resets = sensor.resets;
    // A sensor that has started again, or goes by a clock of its own, says nothing of the scene's.
    let keeps_time = sensor.clock.is_true() && resets.is_empty();
    let mut records = DisplayRecords::default();
    if let Some(display) = display {
        let witness = &display.witness;
        digest.link(&witness.sent);
        digest.outputs(&display.records.outputs);
        heard = read(&witness.heard, &display.resets);
        display_said = read(&witness.sent, &display.resets);
        log_of("display", witness);
        resets.extend(display.resets);
        records = display.records;
    }
    log.sort_by_key(|&(at_ns, ..)| at_ns);
    resets.sort_by_key(|reset| reset.at_ns);

    let clock_offset_ns = clock_offset_ns(&said, &sensor.records);
    let mut estimates: Vec<EstimateRecord> = Vec::new();
    for TimedMessage { at_ns, message } in said.messages() {
        if let Message::Estimate(estimate) = message {
            let made_ns = (estimate.instant_us * 1_000).saturating_add_signed(-clock_offset_ns);
            estimates.push(EstimateRecord {
                made_ns: if keeps_time { made_ns } else { *at_ns },
                received_ns: None,
                estimate: *estimate,
            });
        }
    }
    let mut has_asked = false;
    let arrived = heard.messages().filter_map(|heard| match heard.message {
        Message::Estimate(estimate) => Some(Arrival {
            at_ns: heard.at_ns,
            estimate,
            has_asked: std::mem::take(&mut has_asked),
        }),
        Message::Hello(hello) => {
            has_asked |= hello.asks != 0;
            None
        }
        _ => None,
    });
    let sensor_status = last_status(&said);
    let display_status = last_status(&display_said);
    let mut recording = Recording {
        engine: Engine::Elf,
        duration_s: scene.duration_s,
        warm_up_s,
        wall_s,
        hash: digest.finish(),
        scans: sensor.records,
        ticks: records.ticks,
        estimates,
        arrived: arrived.collect(),
        outputs: records.outputs,
        sensor_status,
        display_status,
        log,
        signs: FaultEvidence {
            display: display_said.into_messages(),
            sensor: said.into_messages(),
            resets,
            clears_ns: records.clears_ns,
        },
    };
    recording.match_arrivals();
    recording
}

/// What was said on a wire. The board whose resets these are has lost what it was at, and begins anew.
fn read(mut bytes: &[(u64, u8)], resets: &[Reset]) -> MessageDecoder {
    let mut decoder = MessageDecoder::default();
    for reset in resets {
        let (before, after) =
            bytes.split_at(bytes.partition_point(|&(at_ns, _)| at_ns < reset.at_ns));
        decoder.hear(before);
        decoder.restart();
        bytes = after;
    }
    decoder.hear(bytes);
    decoder
}

/// What the sensor's clock is ahead of the scene's, from the first estimate and the scan that it ends with.
fn clock_offset_ns(said: &MessageDecoder, scans: &[ScanRecord]) -> i64 {
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

fn last_status(listener: &MessageDecoder) -> Option<Status> {
    listener
        .messages()
        .rev()
        .find_map(|said| match said.message {
            Message::Status(status) => Some(status),
            _ => None,
        })
}
