//! What the console says to a person: a banner, a line a second, and answers to keys.

use protocol::line::banner;
use protocol::{Hello, Key, Latest, Line, Role, Status, Stop, StopReason};

use crate::ports::Ports;
use crate::stop;

/// Said to who types what has no meaning.
const HINT: &str = "? for help";

/// What a board has to say for itself.
pub struct ConsoleOutput {
    /// Who it is.
    pub hello: Hello,
    /// It in a line.
    pub line: fn(&Latest, &Status) -> Line,
    /// What the line means.
    pub help: &'static [&'static str],
    /// Somebody typed a Stop: obeys, and says what that does.
    pub stop: fn(Stop) -> &'static str,
}

impl ConsoleOutput {
    /// Says who it is, and why it started.
    pub fn greet(&self, ports: &Ports, status: &Status) {
        let role = Role::from_byte(self.hello.role).map_or("board", Role::name);
        ports.say(&banner(&self.hello, role, status));
    }

    /// Says how it is.
    pub fn tell(&self, ports: &Ports, status: &Status) {
        if ports.speaks_text() {
            ports.say(&(self.line)(&ports.latest(), status));
        }
    }

    /// Does what was asked for.
    pub fn obey(&self, ports: &Ports, key: Key, status: &Status) {
        match key {
            Key::Help => {
                self.greet(ports, status);
                for line in self.help {
                    ports.say(line);
                }
            }
            Key::Stop => {
                let stop = Stop {
                    reason: StopReason::Operator,
                };
                ports.say((self.stop)(stop));
                stop::on_key(stop);
            }
            Key::Other => ports.say(HINT),
        }
    }
}
