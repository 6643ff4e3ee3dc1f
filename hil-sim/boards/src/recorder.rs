//! Keeps everything that one board of a run says and hears.

use std::time::Instant;

use protocol::Role;
use rigless::emulator::Host;

use super::ElfError;
use super::console::{ConsoleHost, Told};
use super::lockstep::{BoardHook, QuantumContext};
use super::nucleo::{Nucleo, Pins};
use super::rtt::Log;
use super::terminal;
use super::terminal::Terminal;
use super::wire::TimedByte;
use hil_sim_core::scene::Scene;

/// Virtual time by which the emulator has met, and translated, all of the firmware that a run needs.
pub const WARM_UP_NS: u64 = 500_000_000;

/// The virtual time in s at the beginning of a run that is not counted, and the wall time that the rest took, in s.
pub(super) fn pace(started: Instant, warm: Option<Instant>, ended: Instant) -> (f64, f64) {
    let warm_up_s = warm.map_or(0.0, |_| WARM_UP_NS as f64 * 1e-9);
    let counted = ended - warm.unwrap_or(started);
    (warm_up_s, counted.as_secs_f64())
}

/// Stands beside a board for as long as its scene lasts.
pub struct Recorder {
    console: Option<ConsoleHost>,
    /// Who sits at the console if no host does.
    terminal: Option<Box<dyn Terminal>>,
    log: Option<Log>,
    end_ns: u64,
    /// What the board sent to its peer, with instants.
    pub sent: Vec<TimedByte>,
    /// What the board heard from its peer, with the instants at which each byte was complete.
    pub heard: Vec<TimedByte>,
    /// When the board had run for [`WARM_UP_NS`].
    pub warm: Option<Instant>,
}

impl Recorder {
    /// Beside the board of `role` in `scene`, which runs `elf`.
    pub fn new(scene: &Scene, role: Role, elf: &[u8], terminal: Option<Box<dyn Terminal>>) -> Self {
        Self {
            console: ConsoleHost::of_scene(scene, role),
            terminal,
            log: Log::find(elf),
            end_ns: (scene.duration_s * 1e9).ceil() as u64,
            sent: Vec::new(),
            heard: Vec::new(),
            warm: None,
        }
    }

    /// What the board called `name` answered, if it was asked for anything.
    ///
    /// # Errors
    /// If it refuses, or has not answered.
    pub fn told(&self, name: &'static str) -> Result<Option<Told>, ElfError> {
        let is_asked = self.console.as_ref().is_some_and(ConsoleHost::asks);
        let reason = match self.console.as_ref().and_then(|host| host.told) {
            None if is_asked => {
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

    /// The board's log.
    pub fn log_lines(&self) -> Vec<(u64, String)> {
        self.log.as_ref().map(Log::lines).unwrap_or_default()
    }
}

impl<P: Pins> BoardHook<P> for Recorder {
    fn sent(&mut self, _board: &mut Nucleo<P>, sent: &[TimedByte]) {
        self.sent.extend_from_slice(sent);
    }

    fn heard(&mut self, due_ns: u64, byte: u8) {
        self.heard.push((due_ns, byte));
    }

    fn attend(&mut self, between: QuantumContext<'_, P>) {
        if let Some(host) = &mut self.console {
            host.serve(between.session.board_mut(), between.now_ns);
        } else if let Some(terminal) = &mut self.terminal {
            terminal::carry(&mut **terminal, between.session.board_mut(), between.now_ns);
        }
        if self.warm.is_none() && between.now_ns >= WARM_UP_NS {
            self.warm = Some(Instant::now());
        }
    }

    fn log(&mut self, now_ns: u64, host: &mut dyn Host) {
        if let Some(log) = &mut self.log {
            log.read(now_ns, host);
        }
    }

    fn restart(&mut self) {
        if let Some(console) = &mut self.console {
            console.restart();
        }
    }

    fn is_over(&self, now_ns: u64) -> bool {
        now_ns >= self.end_ns
    }
}
