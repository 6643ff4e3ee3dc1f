//! `host-bridge stop`.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::link::{Event, stop_all};
use crate::state::State;
use crossbeam_channel::RecvTimeoutError;
use protocol::{Message, Role, Stopped, Trip};

use super::output::say;

/// How it is used.
pub const EXAMPLES: &str = "\
A display's outputs go to 0 V, a sensor's arm drive goes off, and both stay so until the board's reset button or \
power. Every version of the firmware understands it, and a board that has another program's attention as well. \
With two sites, `relay stop` reaches them from anywhere.

Exit status: 0 every board of the bench says that it has stopped; 1 one does not, or its port leads to another \
board: then press the emergency stop, or cut the power.";

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
        // A bench that can't be right is no reason not to say Stop.
        let bench = self.boards.named()?;
        let (mut waiting, told) = super::told_links(&bench);
        let boards: Vec<_> = waiting.iter().map(|(_, link)| link.sender()).collect();
        stop_all(&boards);
        let end = Instant::now() + Duration::from_secs(self.within.into());
        let mut answers: Vec<(Role, Stopped)> = Vec::new();
        let mut is_missed = false;
        while !waiting.is_empty() {
            match told.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok((
                    role,
                    Event::Heard {
                        message: Message::Stopped(stopped),
                        ..
                    },
                )) => answers.push((role, stopped)),
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
            }
            waiting.retain(|(role, link)| {
                let state = link.state();
                // Who it is that answered may show in a moment.
                let is_clear = !matches!(state, State::Opened { .. });
                let answer = answers.iter().find(|(of, _)| of == role);
                let Some((_, stopped)) = answer.filter(|_| is_clear) else {
                    return true;
                };
                is_missed |= !say_answer(*role, &state, stopped);
                false
            });
        }
        for (role, link) in &waiting {
            let state = link.state();
            if let Some((_, stopped)) = answers.iter().find(|(of, _)| of == role) {
                is_missed |= !say_answer(*role, &state, stopped);
                continue;
            }
            is_missed = true;
            let advice = state.advice().unwrap_or("it does not answer");
            not_stopped(*role, &format!("{state} ({advice})"));
        }
        Ok(ExitCode::from(u8::from(is_missed)))
    }
}

/// Says whose answer came on the way to the board of `role`; whether it is that board's.
fn say_answer(role: Role, state: &State, stopped: &Stopped) -> bool {
    let name = role.name();
    if let State::Stranger { port, hello, .. } = state {
        let is = Role::from_byte(hello.role).map_or("another board", Role::name);
        let port = port.display();
        not_stopped(
            role,
            &format!("{port} is the {is}, which has stopped; the {name} was not told"),
        );
        return false;
    }
    say(&has_stopped(role, stopped));
    true
}

/// A board's answer to a Stop, in words.
pub fn has_stopped(role: Role, stopped: &Stopped) -> String {
    let trip = stopped.trip().map(Trip::name);
    let trip = trip.unwrap_or("a reason that this program does not know");
    format!("{} has stopped: {trip}", role.name())
}

fn not_stopped(role: Role, why: &str) {
    say(&format!(
        "NOT STOPPED as far as is known: {}: {why}: press the emergency stop, or cut its power",
        role.name()
    ));
}
