//! `host-bridge stop`, and what becomes of the Stops that others of these commands say.

use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use crate::link::{Event, by_hand, not_stopped, stop_all};
use crate::state::State;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
use protocol::{Message, Role, Stopped, Trip};

use super::output::say;

/// How it is used.
pub const EXAMPLES: &str = "\
A display's outputs go to 0 V, a sensor's arm drive goes off, and both stay so until the board's reset button or \
power. Every version of the firmware understands it, and a board that has another program's attention as well. \
With two sites, `relay stop` reaches them from anywhere.

Exit status: 0 every board of the bench says that it has stopped; 1 one does not, or its port leads to another \
board: then press the emergency stop for the display, and cut the power of the arm's drive for the sensor.";

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
        let mut heard = HeardAnswers::default();
        // Those whose ports have been looked at.
        let mut seen = Vec::new();
        while !waiting.is_empty() {
            match told.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok((
                    role,
                    Event::Heard {
                        message: Message::Stopped(stopped),
                        ..
                    },
                )) => answers.push((role, stopped)),
                Ok((role, Event::StateChanged(_))) => seen.push(role),
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
                heard.take(*role, &state, stopped);
                false
            });
        }
        for (role, link) in &waiting {
            let state = link.state();
            match answers.iter().find(|(of, _)| of == role) {
                Some((_, stopped)) => heard.take(*role, &state, stopped),
                None if !seen.contains(role) => {
                    let why = "its port is not open yet: a program that has it may not answer; a longer --within tells";
                    heard.missed.push((*role, why.to_owned()));
                }
                None => {
                    let advice = state.advice().unwrap_or("it does not answer");
                    let why = format!("{state} ({advice})");
                    heard.missed.push((*role, why));
                }
            }
        }
        Ok(ExitCode::from(u8::from(heard.say_missed())))
    }
}

/// Who has answered.
#[derive(Default)]
struct HeardAnswers {
    /// The boards that have said of themselves that they have stopped.
    stopped: Vec<Role>,
    /// The boards of the bench that did not answer where they were to be, and why.
    missed: Vec<(Role, String)>,
}

impl HeardAnswers {
    /// Takes the answer that came on the way to the board of `role`, from whomever.
    fn take(&mut self, role: Role, state: &State, stopped: &Stopped) {
        let who = state.who(role);
        if who != Some(role)
            && let Some(port) = state.port()
        {
            let is = who.map_or("another board", Role::name);
            let (port, name) = (port.display(), role.name());
            let why = format!("{port} is the {is}, which has stopped; the {name} was not told");
            self.missed.push((role, why));
        }
        if let Some(who) = who.filter(|who| !self.stopped.contains(who)) {
            self.stopped.push(who);
            say(&has_stopped(who, stopped));
        }
    }

    /// Says which boards have not stopped as far as is known; whether there are any. One may have answered on the
    /// other's way.
    fn say_missed(&self) -> bool {
        let mut is_missed = false;
        for (role, why) in &self.missed {
            if !self.stopped.contains(role) {
                is_missed = true;
                say(&format!(
                    "NOT STOPPED as far as is known: {}: {why}: {}",
                    role.name(),
                    by_hand(&[*role])
                ));
            }
        }
        is_missed
    }
}

/// A board's answer to a Stop, in words.
fn has_stopped(role: Role, stopped: &Stopped) -> String {
    let trip = stopped.trip().map(Trip::name);
    let trip = trip.unwrap_or("a reason that this program does not know");
    format!("{} has stopped: {trip}", role.name())
}

/// A board answers a Stop within milliseconds.
const PATIENCE: Duration = Duration::from_millis(500);

/// What becomes of Stops that a program says beside its work.
pub struct Outcome {
    boards: Vec<Role>,
    /// How the ways to them stand.
    states: Vec<(Role, State)>,
    /// Until when boards that were told to stop may take to answer.
    until: Option<Instant>,
    /// Those that have answered since, by their own names.
    stopped: Vec<Role>,
}

impl Outcome {
    /// Nothing was said yet to these.
    pub const fn new(boards: Vec<Role>) -> Self {
        Self {
            boards,
            states: Vec::new(),
            until: None,
            stopped: Vec::new(),
        }
    }

    /// A Stop is being said. To be called before any answer to it is heard.
    pub fn begin(&mut self) {
        self.until = Some(Instant::now() + PATIENCE);
        self.stopped.clear();
    }

    /// Until when boards may take to answer; none if no Stop waits for that.
    pub const fn until(&self) -> Option<Instant> {
        self.until
    }

    /// Takes what the link to the board of `role` tells. Words if a board has stopped, once until it starts again or is
    /// told again: by its own name, for behind a port may be the other one.
    pub fn hear(&mut self, role: Role, event: &Event) -> Option<String> {
        match event {
            Event::StateChanged(state) => {
                self.states.retain(|(of, _)| *of != role);
                self.states.push((role, state.clone()));
                None
            }
            Event::Heard {
                message: Message::Stopped(stopped),
                ..
            } => {
                let state = self.states.iter().find(|(of, _)| *of == role);
                let who = state.map_or(Some(role), |(_, state)| state.who(role))?;
                // A Stop that is repeated is answered as often.
                let is_new = !self.stopped.contains(&who);
                is_new.then(|| {
                    self.stopped.push(who);
                    has_stopped(who, stopped)
                })
            }
            Event::Restarted => {
                self.stopped.retain(|who| *who != role);
                None
            }
            Event::Heard { .. } => None,
        }
    }

    /// Words for the boards that have not answered in time, once.
    pub fn overdue(&mut self) -> Option<String> {
        self.until.take_if(|end| Instant::now() >= *end)?;
        self.unstopped("no answer, told again")
    }

    /// Words for those that are not told again.
    fn given_up(&mut self) -> Option<String> {
        self.until.take()?;
        self.unstopped("no answer by the end of this program")
    }

    fn unstopped(&self, why: &str) -> Option<String> {
        let boards = self.boards.iter().copied();
        let unstopped: Vec<_> = boards
            .filter(|board| !self.stopped.contains(board))
            .collect();
        (!unstopped.is_empty()).then(|| not_stopped(&unstopped, why))
    }
}

/// How long the last words of a teller may take.
const LINGER: Duration = Duration::from_secs(1);

/// Says on standard error what becomes of Stops. By a thread of its own: nobody who says or hears them waits for who
/// reads it.
#[derive(Clone)]
pub struct Teller {
    told: Sender<Told>,
    /// Closed when all has been said.
    said: Receiver<()>,
}

enum Told {
    Stop,
    Event(Role, Event),
    End,
}

impl Teller {
    /// Tells of these boards.
    pub fn start(boards: Vec<Role>) -> Self {
        let (told, tells) = unbounded();
        let (saying, said) = bounded(0);
        thread::spawn(move || {
            tell(Outcome::new(boards), &tells);
            drop(saying);
        });
        Self { told, said }
    }

    /// A Stop is being said. To be called before it is.
    pub fn begin(&self) {
        // It is there for as long as this is.
        let _ = self.told.send(Told::Stop);
    }

    /// Takes what the link to the board of `role` tells.
    pub fn on_event(&self, role: Role, event: &Event) {
        if let Event::StateChanged(_)
        | Event::Restarted
        | Event::Heard {
            message: Message::Stopped(_),
            ..
        } = event
        {
            let _ = self.told.send(Told::Event(role, event.clone()));
        }
    }

    /// Nothing is said to the boards any more: says what is left to be said, but not to who takes nothing.
    pub fn end(self) {
        let _ = self.told.send(Told::End);
        let _ = self.said.recv_timeout(LINGER);
    }
}

fn tell(mut outcome: Outcome, tells: &Receiver<Told>) {
    loop {
        let told = match outcome.until() {
            Some(until) => tells.recv_deadline(until),
            None => tells.recv().map_err(RecvTimeoutError::from),
        };
        let words = match told {
            Ok(Told::Stop) => {
                outcome.begin();
                None
            }
            Ok(Told::Event(role, event)) => outcome.hear(role, &event),
            Err(RecvTimeoutError::Timeout) => outcome.overdue(),
            Ok(Told::End) | Err(RecvTimeoutError::Disconnected) => {
                if let Some(words) = outcome.given_up() {
                    say(&words);
                }
                return;
            }
        };
        if let Some(words) = words {
            say(&words);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn that_a_board_has_stopped_is_told_once_however_often_it_answers() {
        let mut outcome = Outcome::new(vec![Role::Display]);
        let answer = Event::Heard {
            at_us: 0,
            message: Message::Stopped(Stopped::by(Trip::Operator)),
        };
        let words = Some("display has stopped: by the operator".to_owned());
        let mut told = |event| outcome.hear(Role::Display, event);
        assert_eq!(told(&answer), words);
        assert_eq!(told(&answer), None);
        // It goes again.
        assert_eq!(told(&Event::Restarted), None);
        assert_eq!(told(&answer), words);
        assert_eq!(told(&answer), None);
        outcome.begin();
        assert_eq!(outcome.hear(Role::Display, &answer), words);
        // Nothing of it is overdue when its time is over.
        outcome.until = Some(Instant::now());
        assert_eq!(outcome.overdue(), None);
        outcome.begin();
        outcome.until = Some(Instant::now());
        assert!(outcome.overdue().is_some());
    }
}
