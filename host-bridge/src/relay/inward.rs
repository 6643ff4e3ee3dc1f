//! What comes from the other site, on its way to the board: judged by order and age. Between the network and the board's
//! line there is never a queue: a newer message takes the place of one that waits.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use protocol::{Hello, Message, Ping, Pong, Role, Stop, Trip};

use crate::clock::{Notify, micros};
use crate::lock::locked;
use crate::monitor::log_entry::LogLine;
use crate::relay::age::{Age, Ages};
use crate::relay::envelope::{Content, Envelope, EnvelopeError, sequence_number};
use crate::relay::flow::Answer;
use crate::relay::gate::{Gate, Order};
use crate::relay::remote::{Bystander, RemoteBridge};
use crate::relay::report::{Histogram, Incoming, Notice, Percentiles};

/// For so long after another bridge has got the bench, in µs, its board's messages wait: the board here is to notice that
/// nobody speaks. An arm that hears nothing for 0.1 s stands still, and follows the next hand from where both are.
const BETWEEN_HOLDERS_US: u64 = 150_000;

/// What is to be done about an envelope.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "it is done at once, on the stack of one callback"
)]
pub enum Heard {
    Nothing,
    /// The board is to be told.
    Pass(Waiting),
    /// A ping is to be answered.
    Asked {
        session: u64,
        ping: Ping,
        /// Whether that one holds the bench.
        holds: bool,
    },
    /// A ping of one's own was answered.
    Answered {
        answer: Answer,
        /// Whether this bridge holds the bench, as the other site sees it.
        holds: bool,
    },
    /// The board is to be told, and then the sender.
    Stop(u64, Stop),
    /// The Stop of this number is done at the other site: see [`Content::Stopped`].
    Stopped(u64, Option<Trip>),
    /// Somebody there watches the board here.
    Watched,
    Greeting(Hello),
    /// What the board there said, for who watches here.
    Shown(Message),
    /// What the log of the board there said, and which line of those that were sent that is.
    Log(u32, LogLine),
    /// Who watches there asks the board here.
    Question(Message),
}

/// The inward direction of a bridge.
#[derive(Clone, Debug)]
pub struct Inward {
    /// The role of the other site's board.
    role: Role,
    session: u64,
    max_age_us: u64,
    gate: Gate,
    ages: Ages,
    /// Until when messages wait, in µs: see [`BETWEEN_HOLDERS_US`].
    quiet_until_us: u64,
    remote: RemoteBridge,
    counts: Incoming,
    total: Histogram,
    recent: Histogram,
    round_trip_us: u64,
    watcher: Bystander,
    told_slow: bool,
}

impl Inward {
    /// Nothing heard yet from the site of the board of `role`, by the bridge of this `session`.
    pub fn new(role: Role, session: u64, max_age: Duration) -> Self {
        Self {
            role,
            session,
            max_age_us: micros(max_age),
            gate: Gate::default(),
            ages: Ages::new(max_age),
            quiet_until_us: 0,
            remote: RemoteBridge::default(),
            counts: Incoming::default(),
            total: Histogram::default(),
            recent: Histogram::default(),
            round_trip_us: 0,
            watcher: Bystander::default(),
            told_slow: false,
        }
    }

    /// Bytes came from the other site at `now_us`. `tell` hears what a person should know.
    pub fn hear(&mut self, bytes: &[u8], now_us: u64, mut tell: impl FnMut(Notice)) -> Heard {
        let envelope = match Envelope::from_bytes(bytes) {
            Ok(envelope) if envelope.role() == Some(self.role) => envelope,
            Err(EnvelopeError::Foreign { hello, version }) => {
                self.counts.refused += 1;
                let before = self.remote.state().clone();
                self.remote.hear_foreign(hello, version);
                if *self.remote.state() != before {
                    tell(Notice::Remote(self.role, self.remote.state().clone()));
                }
                return Heard::Nothing;
            }
            _ => {
                self.counts.refused += 1;
                return Heard::Nothing;
            }
        };
        // What every build says alike tells nothing of the build: it neither asks for the bench nor keeps it.
        match envelope.content {
            Content::Stop { id, stop } => return Heard::Stop(id, stop),
            // Only of the board that is held, or of any where none is: anybody could say so.
            Content::Stopped { id, trip } => {
                let is_of_holder = self.gate.is_holder(envelope.session);
                let is_believed = is_of_holder || !self.gate.is_held(now_us);
                return if is_believed {
                    Heard::Stopped(id, trip)
                } else {
                    Heard::Nothing
                };
            }
            // It is said again, until it is done.
            Content::Stopping { .. } => return Heard::Nothing,
            _ => {}
        }
        self.greet(&envelope, now_us, &mut tell);
        let is_holder = self.gate.is_holder(envelope.session);
        match envelope.content {
            Content::Board { .. } => self.weigh(envelope, now_us, tell),
            Content::Ping(ping) => Heard::Asked {
                session: envelope.session,
                ping,
                holds: is_holder,
            },
            Content::Pong { to, pong, holds } => {
                let is_ours = to == self.session && self.remote.is_session(envelope.session);
                let answer = is_ours.then(|| self.on_pong(&pong, now_us)).flatten();
                answer.map_or(Heard::Nothing, |answer| Heard::Answered { answer, holds })
            }
            Content::Watch => Heard::Watched,
            Content::Greeting(hello) if is_holder => Heard::Greeting(hello),
            Content::Shown(message) if is_holder => Heard::Shown(message),
            Content::Log { number, line } if is_holder => Heard::Log(number, line),
            Content::Question(message) => Heard::Question(message),
            Content::Leaving => {
                self.gate.leave(envelope.session);
                Heard::Nothing
            }
            Content::HandOver => {
                if self.gate.hand_over(envelope.session, now_us) {
                    self.begin(now_us);
                    self.watcher = Bystander::default();
                    tell(Notice::HandedOver(self.role));
                }
                Heard::Nothing
            }
            Content::Stop { .. }
            | Content::Stopped { .. }
            | Content::Stopping { .. }
            | Content::Greeting(_)
            | Content::Shown(_)
            | Content::Log { .. } => Heard::Nothing,
        }
    }

    /// A message was given to the board at `now_us`.
    pub fn on_passed(&mut self, waiting: &Waiting, now_us: u64) {
        let age_us = waiting.age_us + now_us.saturating_sub(waiting.came_us);
        self.counts.passed += 1;
        self.total.add(age_us);
        self.recent.add(age_us);
    }

    /// What has become of messages that were not given to the board.
    pub const fn counts_mut(&mut self) -> &mut Incoming {
        &mut self.counts
    }

    pub fn elapse(&mut self, now_us: u64, mut tell: impl FnMut(Notice)) {
        if self.remote.elapse(now_us) {
            tell(Notice::Remote(self.role, self.remote.state().clone()));
        }
        if self.watcher.elapse(now_us) {
            tell(Notice::WatcherGone(self.role));
        }
    }

    /// Who is at the other site.
    pub const fn remote(&self) -> &RemoteBridge {
        &self.remote
    }

    /// What has been counted so far.
    pub const fn counts(&self) -> Incoming {
        Incoming {
            arrivals: self.gate.arrivals(),
            ..self.counts
        }
    }

    /// The ages since this was last asked.
    pub fn take_recent(&mut self) -> Option<Percentiles> {
        std::mem::take(&mut self.recent).percentiles()
    }

    pub fn total(&self) -> Option<Percentiles> {
        self.total.percentiles()
    }

    fn greet(&mut self, envelope: &Envelope, now_us: u64, tell: &mut impl FnMut(Notice)) {
        if self.gate.ask(envelope.session, now_us) {
            self.begin(now_us);
            self.watcher = Bystander::default();
        }
        if !self.gate.is_holder(envelope.session) {
            if self.watcher.hear(now_us) {
                tell(Notice::Watcher(self.role));
            }
        } else if self.remote.hear(envelope.hello, envelope.session, now_us) {
            tell(Notice::Remote(self.role, self.remote.state().clone()));
        }
    }

    /// Another bridge has the bench.
    const fn begin(&mut self, now_us: u64) {
        self.ages.forget();
        // The first one takes the bench from nobody.
        if self.counts.passed > 0 {
            self.quiet_until_us = now_us.saturating_add(BETWEEN_HOLDERS_US);
        }
    }

    fn on_pong(&mut self, pong: &Pong, now_us: u64) -> Option<Answer> {
        let round_trip_us = self.ages.on_pong(pong, now_us)?;
        self.round_trip_us = round_trip_us;
        Some(Answer {
            sent_us: pong.sent_us,
            there_us: i128::from(pong.received_us) - i128::from(pong.sent_us),
            round_trip_us,
        })
    }

    fn weigh(&mut self, envelope: Envelope, now_us: u64, mut tell: impl FnMut(Notice)) -> Heard {
        let Content::Board { start, message } = envelope.content else {
            return Heard::Nothing;
        };
        let Some(sequence_number) = sequence_number(start, &message) else {
            return Heard::Nothing;
        };
        let order = self
            .gate
            .judge(envelope.session, envelope.counter, sequence_number);
        if order != Order::Newer {
            return Heard::Nothing;
        }
        match self.ages.judge(envelope.sent_us, now_us) {
            Age::Fresh(age_us) => Heard::Pass(Waiting {
                message,
                from_us: self.quiet_until_us,
                until_us: now_us.saturating_add(self.max_age_us.saturating_sub(age_us)),
                age_us,
                came_us: now_us,
            }),
            Age::Stale(age_us) => {
                self.counts.stale += 1;
                if self.round_trip_us / 2 > self.max_age_us && !self.told_slow {
                    self.told_slow = true;
                    let max_age_us = self.max_age_us;
                    tell(Notice::Slow { age_us, max_age_us });
                }
                Heard::Nothing
            }
            Age::Unknown => {
                self.counts.undated += 1;
                Heard::Nothing
            }
        }
    }
}

/// A message that waits for the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Waiting {
    pub message: Message,
    /// From when on it may be said, in µs of the bridge's clock.
    pub from_us: u64,
    /// When it is too old to be said, in µs of the bridge's clock.
    pub until_us: u64,
    /// How old it was when it came, in µs.
    pub age_us: u64,
    /// When it came, in µs of the bridge's clock.
    pub came_us: u64,
}

/// What is taken out.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "it is taken out and said at once"
)]
pub enum Due {
    Message(Waiting),
    Nothing,
    Closed,
}

#[derive(Debug, Default)]
struct Contents {
    newest: Option<Waiting>,
    is_closed: bool,
}

pub struct Outbox {
    contents: Mutex<Contents>,
    changed: Arc<dyn Notify>,
}

impl Outbox {
    /// An empty one, for one thread that waits on `changed` and takes things out.
    pub fn new(changed: Arc<dyn Notify>) -> Self {
        Self {
            contents: Mutex::default(),
            changed,
        }
    }

    /// Puts a message in. True if another had to make room.
    pub fn put(&self, waiting: Waiting) -> bool {
        let replaced = self.contents().newest.replace(waiting).is_some();
        self.changed.notify();
        replaced
    }

    /// Puts one back that was taken out, unless there is a newer one. True if there is.
    pub fn put_back(&self, waiting: Waiting) -> bool {
        let newest = &mut self.contents().newest;
        let makes_way = newest.is_some();
        newest.get_or_insert(waiting);
        makes_way
    }

    pub fn close(&self) {
        self.contents().is_closed = true;
        self.changed.notify();
    }

    /// Takes out what is to be said; waits for it until `until_us` at the longest.
    pub fn take(&self, until_us: u64) -> Due {
        match self.try_take() {
            Due::Nothing => {
                self.changed.wait_until(until_us);
                self.try_take()
            }
            due => due,
        }
    }

    fn try_take(&self) -> Due {
        let mut contents = self.contents();
        if contents.is_closed {
            return Due::Closed;
        }
        contents.newest.take().map_or(Due::Nothing, Due::Message)
    }

    fn contents(&self) -> MutexGuard<'_, Contents> {
        locked(&self.contents)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::{Clock, SystemClock};
    use crate::relay::site::bridge_hello;
    use protocol::{Motion, StopReason};

    /// What the bridge of the sensor's board says, of a build with that protocol.
    fn said(protocol: u16, session: u64, content: Content) -> Envelope {
        let mut hello = bridge_hello(Role::Sensor);
        hello.protocol = protocol.to_le_bytes();
        Envelope {
            hello,
            session,
            counter: 1,
            sent_us: 0,
            content,
        }
    }

    fn outbox() -> Outbox {
        Outbox::new(SystemClock.notify())
    }

    fn waiting(sequence: u32) -> Waiting {
        Waiting {
            message: Message::Motion(Motion {
                sequence,
                instant_us: 0,
                position_um: 0,
                velocity_um_s: 0,
            }),
            from_us: 0,
            until_us: 0,
            age_us: 0,
            came_us: 0,
        }
    }

    #[test]
    fn a_stop_of_another_build_is_obeyed_and_nothing_else_of_it_is_believed() {
        let mut inward = Inward::new(Role::Sensor, 1, Duration::from_secs(1));
        let stop = Stop {
            reason: StopReason::Operator,
        };
        for (content, expected) in [
            (Content::Stop { id: 7, stop }, Heard::Stop(7, stop)),
            (
                Content::Stopped { id: 7, trip: None },
                Heard::Stopped(7, None),
            ),
            (Content::Leaving, Heard::Nothing),
        ] {
            let envelope = said(77, 9, content);
            let heard = inward.hear(&envelope.to_bytes(), 0, |_| {});
            assert_eq!(heard, expected);
        }
        assert_eq!(inward.remote.state().word(), "foreign");
        // Where a bridge of this build is heard, it alone is believed.
        let own = protocol::PROTOCOL_VERSION;
        let ping = Content::Ping(Ping { sent_us: 0 });
        inward.hear(&said(own, 3, ping).to_bytes(), 0, |_| {});
        for (protocol, session, expected) in [
            (77, 9, Heard::Nothing),
            (own, 9, Heard::Nothing),
            (own, 3, Heard::Stopped(7, None)),
        ] {
            let stopped = said(protocol, session, Content::Stopped { id: 7, trip: None });
            let heard = inward.hear(&stopped.to_bytes(), 0, |_| {});
            assert_eq!(heard, expected, "{protocol} {session}");
        }
    }

    /// It may be of a build whose envelopes are others, and whose boards are the same.
    #[test]
    fn a_stop_tells_nothing_of_the_build_and_asks_for_nothing() {
        let mut inward = Inward::new(Role::Sensor, 1, Duration::from_secs(1));
        let stop = Stop {
            reason: StopReason::Operator,
        };
        let content = Content::Stop { id: 7, stop };
        let envelope = said(protocol::PROTOCOL_VERSION, 9, content);
        let heard = inward.hear(&envelope.to_bytes(), 0, |_| {});
        assert_eq!(heard, Heard::Stop(7, stop));
        assert_eq!(inward.remote.state().word(), "unheard");
        assert!(!inward.gate.is_held(0));
    }

    #[test]
    fn the_newest_takes_the_place_of_what_waits() {
        let outbox = outbox();
        assert!(!outbox.put(waiting(1)));
        assert!(outbox.put(waiting(2)));
        assert_eq!(outbox.take(0), Due::Message(waiting(2)));
        assert_eq!(outbox.take(0), Due::Nothing);
    }

    #[test]
    fn what_is_put_back_makes_way_for_what_came_meanwhile() {
        let outbox = outbox();
        assert!(!outbox.put_back(waiting(1)));
        assert!(outbox.put_back(waiting(2)));
        assert_eq!(outbox.take(0), Due::Message(waiting(1)));
        outbox.put(waiting(3));
        assert!(outbox.put_back(waiting(1)));
        assert_eq!(outbox.take(0), Due::Message(waiting(3)));
    }

    #[test]
    fn closing_wakes_who_waits() {
        let outbox = outbox();
        std::thread::scope(|scope| {
            let waiter = scope.spawn(|| outbox.take(u64::MAX));
            outbox.close();
            assert_eq!(waiter.join().expect("it ends"), Due::Closed);
        });
    }
}
