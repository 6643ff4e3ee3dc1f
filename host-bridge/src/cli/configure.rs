//! `host-bridge configure`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::slice;
use std::time::Duration;

use anyhow::{bail, ensure};
use clap::ValueHint;
use crossbeam_channel::unbounded;
use hil_sim_core::scene_file::display::actuators;
use protocol::actuators::{DEFAULT_ACTUATORS, hash};
use protocol::{Configuration, DisplayConfiguration, Message, Role, SensorConfiguration};
use serde_json::{Map, Value};

use super::output::{print, say};
use crate::bench::Seat;
use crate::clock::now_us;
use crate::link::{Event, Link};
use crate::monitor::orders::{Change, Orders, Outcome, taken};
use crate::monitor::settings::{self, Kind, Setting, role_of};
use crate::place::{Place, is_far};

/// What it does, in full.
pub const ABOUT: &str = "\
Shows the settings that are in force on the boards, or changes some of them and keeps all others. All that is named \
for a board comes into force together, or is refused by the name and range of what is wrong. After its reset button or a \
power-off a board starts with its own settings again.";

/// How it is used.
pub const EXAMPLES: &str = "\
Examples:
  host-bridge configure                                     what is in force, as NAME=VALUE
  host-bridge configure amplitude_mv=1000 mode=travelling   the display, with 1 V and a wave that moves
  host-bridge configure method=counting window_ms=120       the sensor
  host-bridge configure --actuators array.csv               what the operator's fingertip carries
  host-bridge configure > kept                              kept for later, but for the actuators
  host-bridge configure --actuators array.csv $(grep -v '^#' kept)     and given again

FILE is what a scene names by `file` in its section [display]: CSV with the columns \
actuator,x_um,y_um,gain,phase_turns,inverted and, if measured, resonance_hz,damping; all fifty actuators.

Exit status: 0 done; 1 a board refused, or did not answer within --within; 2 it can't be done, or not be printed.";

/// Between two looks at what is due.
const TURN: Duration = Duration::from_millis(20);

/// What `configure` is asked for.
#[derive(Debug, clap::Args)]
pub struct ConfigureBoards {
    /// Settings and their new values; without any, and without --actuators, all that is in force is shown
    #[arg(value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// The description of the display's fifty actuators: places, gains, phases, polarity, resonances
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    actuators: Option<PathBuf>,
    /// How long to wait for the boards
    #[arg(long, value_name = "S", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=3_600))]
    within: u32,
    /// Prints what is in force afterwards as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    boards: super::Where,
}

impl ConfigureBoards {
    /// Does it.
    pub fn execute(self) -> anyhow::Result<ExitCode> {
        let bench = self.boards.find()?;
        let mut wanted = self.changes()?;
        if wanted.iter().any(|(_, change)| !change.is_empty()) {
            wanted.retain(|(_, change)| !change.is_empty());
            let absent = wanted.iter().find(|(of, _)| !bench.roles().contains(of));
            if let Some((role, _)) = absent {
                let name = role.name();
                bail!("this bench has no {name}: give its port with --{name}");
            }
        } else {
            wanted.retain(|(role, _)| bench.roles().contains(role));
        }
        for (role, change) in &wanted {
            if let Some(Place::Port(port)) = bench.seat(*role).map(Seat::place)
                && is_far(&port)
                && !change.is_empty()
            {
                let (port, name) = (port.display(), role.name());
                bail!("{name}: {port} is at another site: run `host-bridge configure` there");
            }
        }
        let (events, told) = unbounded();
        let mut boards: Vec<Board> = Vec::new();
        for (role, change) in wanted {
            let events = events.clone();
            let tell = move |event| super::tell(&events, role, event);
            if let Some(link) = super::link(&bench, role, tell) {
                boards.push(Board {
                    role,
                    link,
                    change,
                    orders: Orders::default(),
                    answer: None,
                });
            }
        }
        let end_us = now_us() + u64::from(self.within) * 1_000_000;
        while boards.iter().any(|board| board.answer.is_none()) && now_us() < end_us {
            let told = told.recv_timeout(TURN);
            for board in &mut boards {
                if let Ok((role, event)) = &told
                    && *role == board.role
                {
                    self.hear(board, event)?;
                }
                board.elapse();
            }
        }
        for board in boards.iter().filter(|board| board.answer.is_none()) {
            let state = board.link.state();
            let silent = if board.change.is_empty() {
                "it does not answer"
            } else {
                "it does not answer in time: see what is in force, `host-bridge configure`"
            };
            let advice = state.advice().unwrap_or(silent);
            say(&format!("{}: {state} ({advice})", board.role.name()));
        }
        let answers = boards.iter().filter_map(|board| {
            let in_force = &board.answer.as_ref()?.in_force;
            Some((board, in_force))
        });
        if self.json {
            let shown: Map<String, Value> = answers
                .map(|(board, in_force)| (board.role.name().to_owned(), described(in_force)))
                .collect();
            print(&serde_json::to_string_pretty(&shown)?)?;
        } else {
            let asked = answers.filter(|(board, _)| board.change.is_empty());
            let lines: Vec<String> = asked.flat_map(|(_, in_force)| listed(in_force)).collect();
            if !lines.is_empty() {
                print(&lines.join("\n"))?;
            }
        }
        let is_done = |board: &Board| board.answer.as_ref().is_some_and(|answer| answer.is_done);
        let is_whole = boards.iter().all(is_done);
        Ok(ExitCode::from(u8::from(!is_whole)))
    }

    /// What is to be changed of each board.
    fn changes(&self) -> anyhow::Result<Vec<(Role, Change)>> {
        let (mut sensor, mut display) = (Change::default(), Change::default());
        for given in &self.settings {
            let Some((name, value)) = given.split_once('=') else {
                bail!("{given:?} is no setting: give NAME=VALUE, as amplitude_mv=1000");
            };
            let name = name.trim();
            let named = |of: &&'static Setting| of.name == name;
            let of_sensor = settings::SENSOR.iter().find(named);
            let of_display = settings::DISPLAY.iter().find(named);
            let (change, setting, default) = match (of_sensor, of_display) {
                (Some(setting), _) => (
                    &mut sensor,
                    setting,
                    Configuration::Sensor(SensorConfiguration::DEFAULT),
                ),
                (None, Some(setting)) => (
                    &mut display,
                    setting,
                    Configuration::Display(DisplayConfiguration::DEFAULT),
                ),
                (None, None) => bail!("there is no setting {name:?}: {}", names()),
            };
            let is_new = change.settings.iter().all(|(of, _)| of.name != name);
            ensure!(is_new, "{name} is given twice: give one value");
            // Whether it is within the setting's range is the board's to say.
            setting.changed(default, value)?;
            change.settings.push((setting, value.to_owned()));
        }
        if let Some(path) = &self.actuators {
            display.actuators = Some(Box::new(actuators(path)?));
        }
        Ok(vec![(Role::Sensor, sensor), (Role::Display, display)])
    }

    /// Takes what a board's link tells, and prints what has come of a change: who waits for the other board may not
    /// wait to the end.
    fn hear(&self, board: &mut Board, event: &Event) -> anyhow::Result<()> {
        let Some(outcome) = board.on(event) else {
            return Ok(());
        };
        let name = board.role.name();
        let lines = match outcome {
            Outcome::Refused(refusal) => {
                say(&format!("{name}: refused: {refusal}"));
                return Ok(());
            }
            Outcome::Misread(misread) => {
                say(&misread.to_string());
                return Ok(());
            }
            Outcome::Unanswered => return Ok(()),
            Outcome::Taken(_) if self.json || board.change.is_empty() => return Ok(()),
            Outcome::Taken(values) => {
                let values = values.iter();
                let mut lines: Vec<String> = values
                    .map(|value| format!("{name}: {}", taken(slice::from_ref(value))))
                    .collect();
                if let (Some(path), Some(_)) = (&self.actuators, &board.change.actuators) {
                    let path = path.display();
                    lines.push(format!("{name}: actuators are those of {path} now"));
                }
                lines
            }
        };
        print(&lines.join("\n"))
    }
}

/// A board that is asked or changed.
struct Board {
    role: Role,
    link: Link,
    /// What is to be changed; nothing if it is only asked.
    change: Change,
    orders: Orders,
    /// None until it has answered.
    answer: Option<Answer>,
}

/// What a board has answered.
struct Answer {
    /// Whether all is as it was asked for.
    is_done: bool,
    /// What was in force then.
    in_force: Configuration,
}

impl Board {
    /// Asks, or changes, from the beginning.
    fn begin(&mut self) {
        if self.change.is_empty() {
            self.orders.read();
        } else {
            self.orders.change(self.change.clone(), now_us());
        }
    }

    /// What has come of what it was asked for, as soon as something has.
    fn on(&mut self, event: &Event) -> Option<Outcome> {
        match event {
            Event::StateChanged(state) if state.is_known() && self.answer.is_none() => self.begin(),
            Event::StateChanged(state) if !state.is_known() => self.orders.lost(),
            Event::Restarted => {
                // What it had taken is lost.
                if !self.change.is_empty() {
                    self.answer = None;
                }
                if self.answer.is_none() {
                    self.begin();
                }
            }
            Event::Heard {
                message: Message::Configuration(report),
                ..
            } if role_of(&report.configuration) == self.role && self.answer.is_none() => {
                let outcome = match self.orders.on_report(now_us(), report) {
                    None if self.change.is_empty() => Outcome::Taken(Vec::new()),
                    outcome => outcome?,
                };
                self.answer = Some(Answer {
                    is_done: matches!(outcome, Outcome::Taken(_)),
                    in_force: report.configuration,
                });
                return Some(outcome);
            }
            Event::StateChanged(_) | Event::Heard { .. } => {}
        }
        None
    }

    fn elapse(&mut self) {
        let is_known = self.link.state().is_known();
        if self.orders.elapse(now_us(), is_known).is_some() {
            // There may be time left.
            self.begin();
        }
        for message in self.orders.take() {
            // What is not heard is said again.
            let _ = self.link.post(&message);
        }
    }
}

/// All names of settings, by board.
fn names() -> String {
    let of = |role: Role| {
        let names: Vec<&str> = settings::of(role).iter().map(|of| of.name).collect();
        format!("the {}'s are {}", role.name(), names.join(", "))
    };
    [Role::Sensor, Role::Display].map(of).join("; ")
}

/// Where the description of the actuators in force is from.
fn origin(display: &DisplayConfiguration) -> &'static str {
    if display.actuators == hash(&DEFAULT_ACTUATORS) {
        "those that the board starts with"
    } else {
        "as described"
    }
}

/// A configuration as lines that can be given again; what can't be is a comment.
fn listed(configuration: &Configuration) -> Vec<String> {
    let role = role_of(configuration);
    let mut lines = vec![format!("# {}", role.name())];
    lines.extend(settings::of(role).iter().filter_map(|setting| {
        let value = setting.value(configuration)?;
        Some(format!("{}={value}", setting.name))
    }));
    if let Configuration::Display(display) = configuration {
        lines.push(format!(
            "# actuators {:#010x}: {}",
            display.actuators,
            origin(display)
        ));
    }
    lines
}

/// A configuration by the settings' names: whole numbers as such, all else in words.
fn described(configuration: &Configuration) -> Value {
    let settings = settings::of(role_of(configuration)).iter();
    let mut values: Map<String, Value> = settings
        .filter_map(|setting| {
            let text = setting.value(configuration)?;
            // Which gauges is no number, though it looks like one.
            let number = text.parse::<u64>().ok();
            let number = number.filter(|_| setting.kind != Kind::Gauges);
            let value = number.map_or_else(|| text.into(), Value::from);
            Some((setting.name.to_owned(), value))
        })
        .collect();
    if let Configuration::Display(display) = configuration {
        let hash = format!("{:#010x}", display.actuators);
        values.insert("actuators".to_owned(), hash.into());
    }
    Value::Object(values)
}
