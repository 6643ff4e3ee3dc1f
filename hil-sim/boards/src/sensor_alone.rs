//! The sensor board alone: its ELF on an emulated board, opposite a display that only listens.
//!
//! ```text
//! scene ─> gauges, arm's encoder ─> sensor ELF ─> Estimate, Texture, Status ─> far end ─> Recording
//!                                        ^  └──────────────────────────────────── Hello
//! ```
//!
//! No hand's motion comes, so an arm that follows the hand stands still. Scenes of recorded gauges have their arm's
//! place from the recording.

use std::time::Instant;

use protocol::{Hello, MAX_FRAME, Port, Role};
use rigless::emulator::Host;

use super::lockstep::{BoardHook, Lockstep, QUANTUM_NS, QuantumContext};
use super::nucleo::{Nucleo, PEER_UART};
use super::pair::{self, Finished};
use super::recorder::{self, Recorder};
use super::sensor::SensorPins;
use super::wire::TimedByte;
use super::{ElfError, Firmware, record};
use hil_sim_core::link::impairments::BYTE_NS;
use hil_sim_core::run::recording::Recording;
use hil_sim_core::scene::Scene;

/// Runs `scene` on the sensor's firmware. Nothing of a display is in the recording: no ticks, arrivals or outputs.
///
/// # Errors
/// If the board can't be emulated, stops before the scene's end, or does not take its configuration.
pub fn run(scene: &Scene, firmware: &Firmware) -> Result<Recording, ElfError> {
    let started = Instant::now();
    let listener = Listener {
        recorder: Recorder::new(scene, Role::Sensor, &firmware.elf, None),
        port: Port::new(Hello::new(Role::Display, "hil-sim", [0, 1, 0])),
        unheard: Vec::new(),
        free_ns: 0,
    };
    let Finished {
        records,
        witness: Listener { recorder, .. },
        clock,
        instructions,
        resets,
    } = pair::drive(
        Role::Sensor,
        Nucleo::new(SensorPins::of_scene(scene)?, SensorPins::fit),
        firmware,
        Lockstep::alone(scene, Role::Sensor, &firmware.elf, QUANTUM_NS, listener),
        scene.duration_s,
    )?;
    recorder.told(Role::Sensor.name())?;
    let pace = recorder::pace(started, recorder.warm, Instant::now());
    let sensor = Finished {
        records,
        witness: recorder,
        clock,
        instructions,
        resets,
    };
    Ok(record(scene, sensor, None, pace))
}

/// Greets the sensor, hears what it says, and keeps it.
struct Listener {
    recorder: Recorder,
    port: Port,
    /// What the board has said since its last turn.
    unheard: Vec<u8>,
    /// When its UART has sent all that it was given so far.
    free_ns: u64,
}

impl Listener {
    fn answer(&mut self, board: &mut Nucleo<SensorPins>, now_ns: u64) {
        self.port.receive(now_ns / 1_000, &self.unheard, |_| {});
        self.unheard.clear();
        let mut said = [0; MAX_FRAME];
        loop {
            let count = self.port.take(&mut said);
            if count == 0 {
                break;
            }
            for &byte in &said[..count] {
                self.free_ns = self.free_ns.max(now_ns) + BYTE_NS;
                board.wire(PEER_UART).hear(self.free_ns, byte);
            }
        }
    }
}

impl BoardHook<SensorPins> for Listener {
    fn sent(&mut self, board: &mut Nucleo<SensorPins>, sent: &[TimedByte]) {
        self.unheard.extend(sent.iter().map(|&(_, byte)| byte));
        self.recorder.sent(board, sent);
    }

    fn heard(&mut self, _due_ns: u64, _byte: u8) {}

    fn attend(&mut self, between: QuantumContext<'_, SensorPins>) {
        self.answer(between.session.board_mut(), between.now_ns);
        self.recorder.attend(between);
    }

    fn log(&mut self, now_ns: u64, host: &mut dyn Host) {
        BoardHook::<SensorPins>::log(&mut self.recorder, now_ns, host);
    }

    fn restart(&mut self) {
        BoardHook::<SensorPins>::restart(&mut self.recorder);
    }

    fn is_over(&self, now_ns: u64) -> bool {
        BoardHook::<SensorPins>::is_over(&self.recorder, now_ns)
    }
}
