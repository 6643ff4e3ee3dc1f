//! In which order ports are tried for a board, so that links that look among the same ports don't get
//! into each other's way for ever.

use std::path::{Path, PathBuf};

use crate::line_monitor::PATIENCE_US;
use crate::place::Place;
use crate::system::Ports;

/// How long a port that led nowhere before may take to answer, in µs: a board that runs answers within
/// milliseconds.
const SECOND_LOOK_US: u64 = 300_000;

/// Looks for one board again and again, and remembers where it was not.
pub struct Search {
    place: Place,
    /// Ports behind which something else was, for as long as they are there.
    elsewhere: Vec<PathBuf>,
}

impl Search {
    /// A search at `place` that remembers nothing yet.
    pub const fn new(place: Place) -> Self {
        Self {
            place,
            elsewhere: Vec::new(),
        }
    }

    /// The ports to try, in order: those that led nowhere before come last. Of ports to choose from, those
    /// that this program has open are left out.
    pub fn candidates(&mut self, system: &dyn Ports) -> Candidates {
        let mut ports = system.candidates(&self.place);
        self.elsewhere.retain(|port| ports.contains(port));
        let choosy = self.is_choosy() || ports.len() > 1;
        if choosy {
            ports.retain(|port| !system.is_open(port));
            ports.sort_by_key(|port| self.elsewhere.contains(port));
        }
        Candidates { ports, choosy }
    }

    /// How long `port` may be silent before it is called so, in µs.
    pub fn patience_us(&self, port: &Path) -> u64 {
        if self.elsewhere.iter().any(|known| known == port) {
            SECOND_LOOK_US
        } else {
            PATIENCE_US
        }
    }

    /// Remembers whether the board was behind `port`.
    pub fn remember(&mut self, port: &Path, found: bool) {
        self.elsewhere.retain(|known| known != port);
        if !found {
            self.elsewhere.push(port.to_owned());
        }
    }

    const fn is_choosy(&self) -> bool {
        matches!(self.place, Place::Anywhere | Place::Among(_))
    }
}

pub struct Candidates {
    pub ports: Vec<PathBuf>,
    /// Whether a port behind which something else is, is to be left for the next one.
    pub choosy: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::State;
    use crate::system::Opened;

    /// Ports of which this program has one open.
    struct Held(Option<&'static str>);

    impl Ports for Held {
        fn candidates(&self, place: &Place) -> Vec<PathBuf> {
            match place {
                Place::Among(ports) => ports.clone(),
                Place::Port(port) => vec![port.clone()],
                Place::Usb(_) | Place::Anywhere => Vec::new(),
            }
        }

        fn is_open(&self, port: &Path) -> bool {
            self.0.is_some_and(|held| port == Path::new(held))
        }

        fn open(&self, port: &Path) -> Result<Opened, State> {
            let port = port.to_owned();
            Err(State::Busy(port))
        }
    }

    fn ports() -> Vec<PathBuf> {
        ["/a", "/b", "/c"].map(PathBuf::from).into()
    }

    #[test]
    fn a_port_that_led_nowhere_is_tried_last_and_shortly() {
        let mut search = Search::new(Place::Among(ports()));
        let [a, b, c] = ["/a", "/b", "/c"].map(Path::new);
        search.remember(a, false);
        assert_eq!(search.candidates(&Held(None)).ports, [b, c, a]);
        assert_eq!(search.patience_us(a), SECOND_LOOK_US);
        assert_eq!(search.patience_us(b), PATIENCE_US);
        search.remember(a, true);
        assert_eq!(search.candidates(&Held(None)).ports, ports());
    }

    #[test]
    fn a_port_of_another_link_is_left_out_where_there_is_a_choice() {
        let held = Held(Some("/a"));
        let Candidates { ports, choosy } = Search::new(Place::Among(ports())).candidates(&held);
        assert!(choosy);
        assert_eq!(ports, [Path::new("/b"), Path::new("/c")]);
        let Candidates { ports, choosy } = Search::new(Place::Port("/a".into())).candidates(&held);
        assert!(!choosy);
        assert_eq!(ports, [Path::new("/a")]);
    }
}
