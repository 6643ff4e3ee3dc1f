//! `host-bridge stop`.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::link::{Event, stop_all};
use crossbeam_channel::RecvTimeoutError;
use protocol::{Message, Trip};

use super::output::say;

/// How it is used.
pub const EXAMPLES: &str = "\
A display's outputs go to 0 V, a sensor's arm drive goes off, and both stay so until the board's reset button or \
power. Every version of the firmware understands it, and a board that has another program's attention as well. \
With two sites, `relay stop` reaches them from anywhere.

Exit status: 0 every board of the bench says that it has stopped; 1 one does not: then press the emergency stop, \
or cut the power.";

/// What `stop` is asked for.
#[derive(Debug, clap::Args)]
pub struct StopBoards {
    /// How long to say so and to wait for the boards' word
    #[arg(long, value_name = "S", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=3_600))]
    within: u32,
    #[command(flatten)]
    boards: super::Where,
}

impl StopBoards {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        let (mut waiting, told) = super::told_links(&bench);
        let boards: Vec<_> = waiting.iter().map(|(_, link)| link.sender()).collect();
        stop_all(&boards);
        let end = Instant::now() + Duration::from_secs(self.within.into());
        while !waiting.is_empty() {
            match told.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok((
                    role,
                    Event::Heard {
                        message: Message::Stopped(stopped),
                        ..
                    },
                )) => {
                    let before = waiting.len();
                    waiting.retain(|(waits, _)| *waits != role);
                    if waiting.len() == before {
                        // It answers each time that it was told.
                        continue;
                    }
                    let trip = stopped.trip().map(Trip::name);
                    let trip = trip.unwrap_or("a reason that this program does not know");
                    say(&format!("{} has stopped: {trip}", role.name()));
                }
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
            }
        }
        for (role, link) in &waiting {
            let state = link.state();
            let advice = state.advice().unwrap_or("it does not answer");
            say(&format!(
                "NOT STOPPED as far as is known: {}: {state} ({advice}): press the emergency stop, or cut its power",
                role.name()
            ));
        }
        Ok(ExitCode::from(u8::from(!waiting.is_empty())))
    }
}
