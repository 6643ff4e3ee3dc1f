//! The bench: which board is where, from a file and from the command line.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use hil_sim_core::scene_file::line::{line_at, line_of};
use protocol::Role;
use serde::Deserialize;

use crate::place::Place;

/// The bench file that is looked for in the current folder.
pub const FILE_NAME: &str = "ridgelink.toml";

/// Everything known of a bench.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bench {
    /// The sensor board.
    pub sensor: Seat,
    /// The display board.
    pub display: Seat,
}

/// What is known of one board. All of it may be left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
pub struct Seat {
    /// Its console's port.
    pub port: Option<PathBuf>,
    /// The port at its link to the other board, where the two are not wired together: for a bridge that
    /// stands in the wire.
    pub link: Option<PathBuf>,
    /// Its ST-LINK's serial number: the port is then found by it, whatever it is called, and so is the
    /// probe to flash by.
    pub usb: Option<String>,
    /// Its firmware: to flash, and to read its log.
    pub elf: Option<PathBuf>,
    /// Where the raw bytes of its log's RTT channel can be read, if not by the probe: a file or a
    /// pseudo-terminal, or `tcp:HOST:PORT`.
    pub rtt: Option<String>,
}

impl Seat {
    /// Where its console is looked for.
    pub fn place(&self) -> Place {
        match (&self.port, &self.usb) {
            (Some(port), _) => Place::Port(port.clone()),
            (None, Some(serial)) => Place::Usb(serial.clone()),
            (None, None) => Place::Anywhere,
        }
    }
}

/// Why a bench can't be used.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum BenchError {
    #[error("{0}: can't be read: {1}: name a bench file with --bench, or in RIDGELINK_BENCH")]
    Unreadable(PathBuf, #[source] io::Error),
    #[error("{}:{line}: {}{message}", file.display(), key.as_ref().map_or(String::new(), |key| format!("{key}: ")))]
    Malformed {
        file: PathBuf,
        line: usize,
        key: Option<String>,
        message: String,
    },
    #[error("{0} can't be both boards: give each its own port or serial number")]
    Twice(String),
}

impl Bench {
    /// Reads a bench file. Fails if it can't be read or is no bench.
    pub fn read(path: &Path) -> Result<Self, BenchError> {
        let text = fs::read_to_string(path)
            .map_err(|source| BenchError::Unreadable(path.to_owned(), source))?;
        let bench: Self = toml::from_str(&text).map_err(|error| malformed(path, &text, error))?;
        bench.names_something(path, &text)?;
        Ok(bench)
    }

    /// Fails if a name in it is empty.
    fn names_something(&self, path: &Path, text: &str) -> Result<(), BenchError> {
        for (board, seat) in [("sensor", &self.sensor), ("display", &self.display)] {
            let is_empty = |path: &Option<PathBuf>| {
                path.as_ref()
                    .is_some_and(|path| path.as_os_str().is_empty())
            };
            let names = [
                ("port", is_empty(&seat.port)),
                ("link", is_empty(&seat.link)),
                ("usb", seat.usb.as_deref() == Some("")),
                ("elf", is_empty(&seat.elf)),
                ("rtt", seat.rtt.as_deref() == Some("")),
            ];
            if let Some((name, _)) = names.into_iter().find(|(_, is_empty)| *is_empty) {
                return Err(BenchError::Malformed {
                    file: path.to_owned(),
                    line: line_of(text, &[board, name]).unwrap_or(1),
                    key: Some(format!("{board}.{name}")),
                    message: "is empty: give a name, or take the line out".to_owned(),
                });
            }
        }
        Ok(())
    }

    /// The bench file to be used: `given`, else [`FILE_NAME`] in the current folder, else `ridgelink/bench.toml` in
    /// the user's folder of settings; none of them is an empty bench. Fails if the file can't be read or is no
    /// bench.
    pub fn find(given: Option<&Path>) -> Result<Self, BenchError> {
        let settings = std::env::var_os("XDG_CONFIG_HOME")
            .filter(|folder| !folder.is_empty())
            .map(PathBuf::from)
            .or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(".config")));
        let usual = [
            Some(PathBuf::from(FILE_NAME)),
            settings.map(|folder| folder.join("ridgelink").join("bench.toml")),
        ];
        let usual = usual.into_iter().flatten().find(|path| path.exists());
        let path = given.map(Path::to_owned).or(usual);
        path.map_or_else(|| Ok(Self::default()), |path| Self::read(&path))
    }

    /// The same, unless both boards are at one place, by whatever names. Fails if they are.
    pub fn checked(self) -> Result<Self, BenchError> {
        let [place, other] = [&self.sensor, &self.display].map(Seat::place);
        if place != Place::Anywhere && place.leads_to() == other.leads_to() {
            return Err(BenchError::Twice(place.to_string()));
        }
        Ok(self)
    }

    /// The boards that the bench has: one that names one board only has only that one, as at one end of a
    /// relay.
    pub fn roles(&self) -> Vec<Role> {
        let is_named = |role: &Role| {
            self.seat(*role)
                .is_some_and(|seat| seat.place() != Place::Anywhere)
        };
        let both = [Role::Sensor, Role::Display];
        match both.iter().filter(|role| is_named(role)).count() {
            1 => both.into_iter().filter(is_named).collect(),
            _ => both.into(),
        }
    }

    /// What is known of the board of `role`; a host has no seat.
    pub const fn seat(&self, role: Role) -> Option<&Seat> {
        match role {
            Role::Sensor => Some(&self.sensor),
            Role::Display => Some(&self.display),
            Role::Host => None,
        }
    }
}

/// A refusal in one line, where the parser's own draws the file.
fn malformed(path: &Path, text: &str, mut error: toml::de::Error) -> BenchError {
    let at = error.span().map_or(0, |span| span.start);
    // Without the text it says the key instead.
    error.set_input(None);
    let said = error.to_string();
    let key = said
        .trim_end()
        .rsplit_once("\nin `")
        .map(|(_, key)| key.trim_end_matches('`').to_owned());
    BenchError::Malformed {
        file: path.to_owned(),
        line: line_at(text.as_bytes(), at),
        key,
        message: format!("{}: mend it", error.message().replace('\n', ", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bench_names_ports_serial_numbers_and_firmwares() {
        let text =
            "[sensor]\nport = \"/dev/ttyACM0\"\nelf = \"sensor.elf\"\n[display]\nusb = \"066C\"\n";
        let bench: Bench = toml::from_str(text).expect("a bench");
        assert_eq!(bench.sensor.place(), Place::Port("/dev/ttyACM0".into()));
        assert_eq!(bench.sensor.elf.as_deref(), Some(Path::new("sensor.elf")));
        assert_eq!(bench.display.place(), Place::Usb("066C".to_owned()));
    }

    #[test]
    fn a_key_that_does_not_exist_is_refused_by_line_and_name() {
        let error = toml::from_str::<Bench>("[sensor]\nprot = \"x\"\n").expect_err("no such key");
        let message = error.to_string();
        assert!(
            message.contains("line 2") && message.contains("prot"),
            "{message}"
        );
    }

    #[test]
    fn the_example_is_a_bench() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("doc/bench.toml");
        let bench = Bench::read(&example).expect("a bench");
        for seat in [&bench.sensor, &bench.display] {
            assert!(seat.usb.is_some() && seat.elf.is_some(), "{seat:?}");
        }
        assert_eq!(bench.display.place(), Place::Port("/dev/ttyACM1".into()));
    }

    #[test]
    fn one_port_for_two_boards_is_refused() {
        let text = "[sensor]\nport = \"/dev/a\"\n[display]\nport = \"/dev/a\"\n";
        let bench: Bench = toml::from_str(text).expect("well-formed");
        let message = bench.checked().expect_err("one port twice").to_string();
        assert!(message.starts_with("/dev/a can't be both"), "{message}");
    }

    #[test]
    fn two_names_of_one_port_for_two_boards_are_refused() {
        let folder = std::env::temp_dir().join(format!("bench-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let [port, link] = ["port", "link"].map(|name| folder.join(name));
        fs::write(&port, "").expect("a file");
        std::os::unix::fs::symlink("port", &link).expect("a link");
        let seat = |path: &PathBuf| Seat {
            port: Some(path.clone()),
            ..Seat::default()
        };
        let bench = Bench {
            sensor: seat(&link),
            display: seat(&port),
        };
        let message = bench.checked().expect_err("one port twice").to_string();
        fs::remove_dir_all(&folder).expect("the folder");
        let words = format!("{} can't be both", link.display());
        assert!(message.starts_with(&words), "{message}");
    }

    #[test]
    fn a_bench_that_names_one_board_has_one() {
        let seat = |port: Option<&str>| Seat {
            port: port.map(Into::into),
            ..Seat::default()
        };
        let of = |sensor, display| {
            let bench = Bench {
                sensor: seat(sensor),
                display: seat(display),
            };
            bench.roles()
        };
        assert_eq!(of(None, None), [Role::Sensor, Role::Display]);
        assert_eq!(of(Some("/a"), Some("/b")), [Role::Sensor, Role::Display]);
        assert_eq!(of(Some("/a"), None), [Role::Sensor]);
        assert_eq!(of(None, Some("/b")), [Role::Display]);
    }
}
