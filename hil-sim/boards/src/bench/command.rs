//! What can be done to a bench while it stands.

use std::str::FromStr;

use protocol::Role;

use super::PortName;
use crate::wiring::Mistake;

/// Something to be done to a bench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// `pull PORT`: a cable is pulled.
    Pull(PortName),
    /// `plug PORT`: it is put back.
    Plug(PortName),
    /// `reset sensor`, `reset display`: the board's reset button is pressed.
    Reset(Role),
    /// `hand SPEED`: the hand goes at so many mm/s from now on, −1000 to 1000.
    Hand {
        /// In mm/s.
        speed_mm_s: f64,
    },
    /// `stop`: the emergency stop is pressed, and stays so.
    Stop,
    /// `release`: it is released.
    Release,
    /// `wrong MISTAKE`: a wire is put wrong, and stays so.
    Wrong(Mistake),
    /// `right MISTAKE`: it is put right.
    Right(Mistake),
    /// `quit`: the bench is taken down.
    Quit,
}

/// As it is read from a line.
impl std::fmt::Display for Command {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Pull(name) => write!(formatter, "pull {name}"),
            Self::Plug(name) => write!(formatter, "plug {name}"),
            Self::Reset(role) => write!(formatter, "reset {}", role.name()),
            Self::Hand { speed_mm_s } => write!(formatter, "hand {speed_mm_s}"),
            Self::Stop => formatter.write_str("stop"),
            Self::Release => formatter.write_str("release"),
            Self::Wrong(mistake) => write!(formatter, "wrong {}", mistake.name()),
            Self::Right(mistake) => write!(formatter, "right {}", mistake.name()),
            Self::Quit => formatter.write_str("quit"),
        }
    }
}

/// A line that says nothing to be done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{line}\": {reason}")]
pub struct NoCommand {
    /// The line.
    pub line: String,
    /// What is wrong with it.
    pub reason: String,
}

impl FromStr for Command {
    type Err = NoCommand;

    fn from_str(line: &str) -> Result<Self, NoCommand> {
        let refuse = |reason: &str| NoCommand {
            line: line.trim().to_owned(),
            reason: reason.to_owned(),
        };
        let mut words = line.split_whitespace();
        let (Some(verb), object, None) = (words.next(), words.next(), words.next()) else {
            return Err(refuse("give a command, such as pull sensor-console"));
        };
        let one_of = |names: &[&str]| refuse(&format!("give one of {}", names.join(", ")));
        let port = || {
            let port = object.and_then(|name| name.parse().ok());
            port.ok_or_else(|| one_of(&PortName::ALL.map(PortName::name)))
        };
        let mistake = || {
            let mistake = object.and_then(Mistake::from_name);
            mistake.ok_or_else(|| one_of(&Mistake::ALL.map(Mistake::name)))
        };
        match (verb, object) {
            ("pull", _) => Ok(Self::Pull(port()?)),
            ("plug", _) => Ok(Self::Plug(port()?)),
            ("reset", Some("sensor")) => Ok(Self::Reset(Role::Sensor)),
            ("reset", Some("display")) => Ok(Self::Reset(Role::Display)),
            ("reset", _) => Err(refuse("give sensor or display")),
            ("hand", speed) => match speed.and_then(|speed| speed.parse().ok()) {
                Some(speed_mm_s @ -1e3..=1e3) => Ok(Self::Hand { speed_mm_s }),
                _ => Err(refuse("give a speed of −1000 to 1000 mm/s")),
            },
            ("stop", None) => Ok(Self::Stop),
            ("release", None) => Ok(Self::Release),
            ("wrong", _) => Ok(Self::Wrong(mistake()?)),
            ("right", _) => Ok(Self::Right(mistake()?)),
            ("quit", None) => Ok(Self::Quit),
            _ => Err(refuse(
                "is no command: give pull, plug, reset, hand, stop, release, wrong, right or quit",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_read_from_a_line() {
        for (line, command) in [
            (
                "pull sensor-console",
                Command::Pull(PortName::SensorConsole),
            ),
            (" plug  display-rtt\n", Command::Plug(PortName::DisplayRtt)),
            ("reset display", Command::Reset(Role::Display)),
            ("hand -12.5", Command::Hand { speed_mm_s: -12.5 }),
            ("stop", Command::Stop),
            ("release", Command::Release),
            ("wrong sdi-open", Command::Wrong(Mistake::SdiOpen)),
            ("right sdi-open", Command::Right(Mistake::SdiOpen)),
            ("quit", Command::Quit),
        ] {
            assert_eq!(line.parse(), Ok(command));
            assert_eq!(command.to_string().parse(), Ok(command));
        }
    }

    #[test]
    fn what_is_no_command_is_named_with_what_to_do() {
        for (line, due) in [
            ("", "\"\": give a command, such as pull sensor-console"),
            ("pull", "\"pull\": give one of sensor-console, "),
            ("pull host", "\"pull host\": give one of sensor-console, "),
            ("reset", "\"reset\": give sensor or display"),
            ("hand fast", "\"hand fast\": give a speed of −1000 to 1000"),
            ("hand 1001", "\"hand 1001\": give a speed of −1000 to 1000"),
            ("hand nan", "\"hand nan\": give a speed of −1000 to 1000"),
            ("wrong", "\"wrong\": give one of link-straight, "),
            ("right way", "\"right way\": give one of link-straight, "),
            ("stop it", "\"stop it\": is no command: give pull"),
            ("jump", "\"jump\": is no command: give pull"),
        ] {
            let error = line.parse::<Command>().unwrap_err().to_string();
            assert!(error.starts_with(due), "{error}");
        }
    }
}
