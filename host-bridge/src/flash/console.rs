//! The board's console before and after: who says Hello there, and whether it is the new firmware.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use protocol::{Hello, Role};

use crate::clock::{Receiver, channel, micros};
use crate::link::{Event, Link};
use crate::lock::locked;
use crate::place::{Place, StLink};
use crate::state::{Named, State};
use crate::system::System;

/// How long a board may take from its reset to its first Hello; it takes a tenth of this.
pub const PATIENCE: Duration = Duration::from_secs(10);
/// How long a look may take: what a link needs to be sure of silence, and some.
const LOOK: Duration = Duration::from_millis(2_500);
/// How often a wait looks up whether it was called off.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// Where the console of the board of `seat` is, behind a probe of serial number `probe`.
///
/// A port that was named is taken at its word, unless it is another ST-LINK's: then the Hello that is heard there
/// would be another board's. Fails if the port is another ST-LINK's.
pub fn place(seat: &Place, probe: Option<&str>, links: &[StLink]) -> Result<Place, Elsewhere> {
    let is_console = |serial: &&str| {
        links
            .iter()
            .any(|link| link.serial.as_deref() == Some(*serial))
    };
    let Some(own) = probe.filter(is_console) else {
        return Ok(seat.clone());
    };
    let Place::Port(port) = seat else {
        return Ok(Place::Usb(own.to_owned()));
    };
    let real = port.canonicalize().unwrap_or_else(|_| port.clone());
    let link = links.iter().find(|link| link.port == real);
    match link.and_then(|link| link.serial.as_deref()) {
        Some(serial) if serial != own => Err(Elsewhere {
            console: port.display().to_string(),
            serial: serial.to_owned(),
            probe: own.to_owned(),
        }),
        _ => Ok(seat.clone()),
    }
}

/// The console that was named is not behind the probe.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{console} is the console of the ST-LINK {serial}, but the probe is {probe}: name one board only"
)]
pub struct Elsewhere {
    /// The port.
    pub console: String,
    /// Its ST-LINK.
    pub serial: String,
    /// The probe.
    pub probe: String,
}

/// A link to whoever is at `place`, and what it tells.
fn listen(system: &System, role: Role, place: Place) -> (Link, Receiver<Event>) {
    let (events, told) = channel(&system.clock);
    let link = Link::open_on(system, role, place, move |event| events.send(event));
    (link, told)
}

/// How the console at `place` stands, for one who wants the board of `role`: as soon as that is clear.
pub fn look(system: &System, role: Role, place: Place) -> State {
    let (link, told) = listen(system, role, place);
    let end_us = system.clock.now_us().saturating_add(micros(LOOK));
    loop {
        match told.recv_until(end_us) {
            Some(
                Event::StateChanged(State::Opened { .. }) | Event::Heard { .. } | Event::Restarted,
            ) => {}
            Some(Event::StateChanged(state)) => return state,
            None => return link.state(),
        }
    }
}

/// Looks at several consoles at once.
pub fn look_at_all(system: &System, role: Role, places: Vec<Place>) -> Vec<State> {
    let looks: Vec<_> = places
        .into_iter()
        .map(|place| {
            let absent = State::Absent(place.to_string());
            let found = Arc::new(Mutex::new(absent));
            let (system_of_look, theirs) = (system.clone(), Arc::clone(&found));
            let work = move || {
                let state = look(&system_of_look, role, place);
                *locked(&theirs) = state;
            };
            (found, system.clock.spawn(Box::new(work)))
        })
        .collect();
    let end = |(found, thread): (Arc<Mutex<State>>, _)| {
        system.clock.join(thread);
        locked(&found).clone()
    };
    looks.into_iter().map(end).collect()
}

/// Why the new firmware was not heard.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum NoHello {
    #[error(
        "flashed and verified, but no Hello from the board within {} s: {state}; {}",
        limit.as_secs(),
        state.advice().unwrap_or("press its reset button and see `host-bridge doctor`")
    )]
    Silence { state: State, limit: Duration },
    #[error(
        "flashed and verified, but the board says that it is {}, not {}: see that console and probe are the \
         same board's, and press its reset button",
        Named(found),
        Named(wanted)
    )]
    AnotherVersion { found: Hello, wanted: Hello },
    #[error("flashed and verified; the board's Hello was not waited for")]
    CalledOff,
}

/// Waits at `place` for the Hello of the firmware that says `wanted` of itself, for at most `limit`. Fails if it is
/// not heard, or when `called_off` becomes true.
pub fn wait(
    system: &System,
    role: Role,
    place: Place,
    wanted: Hello,
    limit: Duration,
    called_off: &AtomicBool,
) -> Result<Hello, NoHello> {
    let (link, told) = listen(system, role, place);
    let end_us = system.clock.now_us().saturating_add(micros(limit));
    let mut other = None;
    loop {
        if called_off.load(Ordering::Relaxed) {
            return Err(NoHello::CalledOff);
        }
        let now_us = system.clock.now_us();
        match told.recv_until(end_us.min(now_us.saturating_add(micros(LOOK_AGAIN)))) {
            Some(Event::StateChanged(State::Known(_, hello)))
                if hello.version == wanted.version =>
            {
                return Ok(hello);
            }
            Some(Event::StateChanged(State::Known(_, hello))) => other = Some(hello),
            Some(_) | None => {}
        }
        if now_us >= end_us {
            break;
        }
    }
    Err(match other {
        Some(found) => NoHello::AnotherVersion { found, wanted },
        None => NoHello::Silence {
            state: link.state(),
            limit,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn links() -> [StLink; 2] {
        [("/dev/null", "A"), ("/dev/zero", "B")].map(|(port, serial)| StLink {
            port: port.into(),
            serial: Some(serial.to_owned()),
        })
    }

    #[test]
    fn the_console_is_the_probes_own() {
        let place = place(&Place::Anywhere, Some("B"), &links());
        assert_eq!(place, Ok(Place::Usb("B".to_owned())));
    }

    #[test]
    fn a_probe_without_a_console_leaves_what_the_bench_says() {
        for seat in [Place::Anywhere, Place::Port("/dev/ttyS0".into())] {
            assert_eq!(place(&seat, Some("J"), &links()), Ok(seat.clone()));
            assert_eq!(place(&seat, None, &links()), Ok(seat));
        }
    }

    #[test]
    fn another_boards_console_is_refused() {
        let error = place(&Place::Port("/dev/null".into()), Some("B"), &links());
        let error = error.expect_err("it is the other's").to_string();
        assert!(
            error.contains("ST-LINK A") && error.contains("probe is B"),
            "{error}"
        );
    }
}
