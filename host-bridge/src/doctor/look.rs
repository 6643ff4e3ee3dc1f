//! Looking at a bench: what is plugged in, and what its boards say for some seconds.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use protocol::{Message, Ping, Role, Status};

use super::examination::{BoardFacts, ElfFacts, Examination, ProbeFacts};
use super::examination::{ClockFacts, Exchange};
use super::permission::{Permission, has_plugdev};
use crate::bench::{Bench, Seat};
use crate::clock::{Receiver, Sender, channel, micros};
use crate::flash::firmware::Firmware;
use crate::flash::probes;
use crate::link::{Event, Link};
use crate::place;
use crate::state::State;
use crate::system::System;

/// Longest wait for each board to be named as what it is: three ports without an answer, and a bit; in µs.
const SETTLING_US: u64 = 5_000_000;
/// How long a board that is not known may still be found behind another port: two links that began at each
/// other's port have exchanged them within a look or two; in µs.
const EXCHANGE_US: u64 = 600_000;
/// Between two looks at whether all are settled, in µs.
const LOOK_US: u64 = 50_000;
/// Between two pings: often enough to see a clock drift within seconds; in µs.
const PING_EVERY_US: u64 = 100_000;

type Told = (Role, Event);

/// Who listens along while a bench is looked at.
pub trait Observer {
    /// The board of `role` has said this.
    fn hear(&mut self, _role: Role, _message: &Message) {}

    /// What is to be said to the boards now; asked some ten times a second.
    fn say(&mut self) -> Vec<(Role, Message)> {
        Vec::new()
    }

    /// Whether enough has been seen of the boards that are there.
    fn has_enough(&self, _present: &[&BoardFacts]) -> bool {
        false
    }
}

/// Hears nothing, says nothing, and has never enough.
struct Nobody;

impl Observer for Nobody {}

/// Looks at everything, and listens for `span` to the boards that are there. If the bench names the place
/// of one board only, it has only that one, as at one end of a relay. It ends early once `ended` is set.
pub fn look(system: &System, bench: &Bench, span: Duration, ended: &AtomicBool) -> Examination {
    look_with(system, bench, span, ended, &mut Nobody)
}

/// The same, with somebody who listens along once the boards are known, and who ends it when enough has been
/// seen, which is after `span` at the latest.
pub fn look_with(
    system: &System,
    bench: &Bench,
    span: Duration,
    ended: &AtomicBool,
    observer: &mut dyn Observer,
) -> Examination {
    let now_us = || system.clock.now_us();
    let goes_on = || !ended.load(Ordering::Acquire);
    let (tell, told) = channel(&system.clock);
    let mut watches: Vec<Watch> = bench
        .roles()
        .into_iter()
        .filter_map(|role| Some(Watch::open(system, role, bench.seat(role)?, &tell)))
        .collect();
    let probes = probes::attached().iter().map(ProbeFacts::from).collect();
    let settled_us = now_us() + SETTLING_US;
    while watches.iter().any(|watch| !watch.is_settled()) && now_us() < settled_us && goes_on() {
        hear(&mut watches, &told, now_us() + LOOK_US, &mut Nobody);
    }
    let began_us = now_us();
    let end_us = began_us.saturating_add(micros(span));
    watches.iter_mut().for_each(Watch::begin);
    // A bench without a board needs no patience.
    if watches.iter().any(|watch| watch.facts.state.is_known()) {
        let mut next_ping_us = began_us;
        while now_us() < end_us && goes_on() && !has_enough(&watches, observer) {
            if now_us() >= next_ping_us {
                next_ping_us += PING_EVERY_US;
                watches.iter().for_each(Watch::ping);
                for (role, message) in observer.say() {
                    // A board that is not there is asked again.
                    let asked = watches.iter().filter(|watch| watch.facts.role == role);
                    asked.for_each(|watch| _ = watch.link.post(&message));
                }
            }
            hear(&mut watches, &told, next_ping_us.min(end_us), observer);
        }
    }
    let looked = Duration::from_micros(now_us() - began_us);
    Examination {
        looked_s: looked.as_secs_f64(),
        st_links: place::st_links(),
        probes,
        has_plugdev: has_plugdev(),
        boards: watches.into_iter().map(|watch| watch.end(looked)).collect(),
    }
}

fn has_enough(watches: &[Watch], observer: &dyn Observer) -> bool {
    let present: Vec<&BoardFacts> = watches
        .iter()
        .map(|watch| &watch.facts)
        .filter(|facts| facts.state.is_known())
        .collect();
    observer.has_enough(&present)
}

/// Takes what is told until `until_us`, at least one thing or none.
fn hear(watches: &mut [Watch], told: &Receiver<Told>, until_us: u64, observer: &mut dyn Observer) {
    let Some(first) = told.recv_until(until_us) else {
        return;
    };
    for (role, event) in std::iter::once(first).chain(told.try_iter()) {
        if let Event::Heard { message, .. } = &event {
            observer.hear(role, message);
        }
        if let Some(watch) = watches.iter_mut().find(|watch| watch.facts.role == role) {
            watch.note(event);
        }
    }
}

/// A board that is being looked at.
struct Watch {
    system: System,
    link: Link,
    facts: BoardFacts,
    /// When it was last named as something, in µs.
    named_us: Option<u64>,
    exchanges: Vec<Exchange>,
    /// What its role says at a rate, and how much of it has been said since the beginning.
    said: u32,
}

impl Watch {
    fn open(system: &System, role: Role, seat: &Seat, tell: &Sender<Told>) -> Self {
        let tell = tell.clone();
        let link = Link::open_on(system, role, seat.place(), move |event| {
            tell.send((role, event));
        });
        let mut facts = BoardFacts::new(role, link.state());
        facts.elf = seat.elf.as_ref().map(|path| ElfFacts {
            path: path.clone(),
            hello: Firmware::read(path, role)
                .map(|firmware| firmware.hello)
                .map_err(|error| error.to_string()),
        });
        Self {
            system: system.clone(),
            link,
            facts,
            named_us: None,
            exchanges: Vec::new(),
            said: 0,
        }
    }

    /// Whether what it has been named as stands.
    fn is_settled(&self) -> bool {
        self.facts.state.is_known()
            || self
                .named_us
                .is_some_and(|named_us| self.now_us() - named_us > EXCHANGE_US)
    }

    fn now_us(&self) -> u64 {
        self.system.clock.now_us()
    }

    /// What was said before does not count for rates.
    fn begin(&mut self) {
        self.said = 0;
    }

    fn ping(&self) {
        // A board that is not there answers nothing.
        let sent_us = self.now_us();
        let _ = self.link.post(&Message::Ping(Ping { sent_us }));
    }

    fn note(&mut self, event: Event) {
        match event {
            Event::StateChanged(state) => {
                self.named_us = (!matches!(state, State::Opened { .. })).then(|| self.now_us());
                if let State::Known(_, hello)
                | State::Foreign(_, hello)
                | State::Stranger { hello, .. } = &state
                {
                    self.facts.hello = Some(*hello);
                }
                if self.facts.state.is_known() && !state.is_known() {
                    self.facts.losses += 1;
                }
                self.facts.state = state;
            }
            Event::Restarted => {
                self.facts.restarts += 1;
                self.facts.first = None;
                self.facts.last = None;
                self.exchanges.clear();
            }
            Event::Heard { at_us, message } => self.hear(at_us, message),
        }
    }

    fn hear(&mut self, at_us: u64, message: Message) {
        match message {
            Message::Status(status) => self.status(status),
            Message::Pong(pong) => self.exchanges.extend(Exchange::new(&pong, at_us)),
            Message::Estimate(estimate) => {
                self.said += 1;
                self.facts.health = Some(estimate.health);
            }
            Message::Motion(_) => self.said += 1,
            _ => {}
        }
    }

    fn status(&mut self, status: Status) {
        if self.facts.first.is_none() {
            self.facts.first = Some(status);
        } else {
            self.facts.last = Some(status);
        }
    }

    /// What has been seen in the end, after it was listened to for `looked`.
    fn end(self, looked: Duration) -> BoardFacts {
        let mut facts = self.facts;
        facts.counters = self.link.counters();
        facts.missed = self.link.missed();
        facts.clock = ClockFacts::new(&self.exchanges);
        facts.rate_hz = (facts.state.is_known() && looked >= Duration::from_secs(1))
            .then(|| f64::from(self.said) / looked.as_secs_f64());
        facts.permission = match &facts.state {
            State::Denied(port) => Permission::of(port),
            _ => None,
        };
        facts
    }
}

impl From<&probes::Attached> for ProbeFacts {
    fn from(probe: &probes::Attached) -> Self {
        let info = probe.info();
        Self {
            name: info.identifier.clone(),
            vendor: info.vendor_id,
            product: info.product_id,
            serial: info.serial_number.clone(),
            is_allowed: probe.is_allowed,
        }
    }
}
