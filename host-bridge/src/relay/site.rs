//! A bridge at one site: a board's link on one side, the network on the other.
//!
//! | thread | does |
//! | --- | --- |
//! | the link's | what the board says goes to the network at once |
//! | the engine's | what the network brings is judged and put into the outbox |
//! | the writer | what is in the outbox goes to the board as soon as the line takes it |
//! | the keeper | pings, repeats Stops, looks why nobody is heard |
//! | the connector | connects; ends when it has |

mod keeper;

use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

use protocol::{Hello, Message, Ping, Pong, Role, Stop, StopReason};

use crate::clock::{Notify, micros};
use crate::link::{self, Event, Link, LinkSender, NotSent};
use crate::lock::locked;
use crate::monitor::log_entry::{LogEvent, LogLine};
use crate::place::Place;
use crate::relay::envelope::{Content, Envelope, MAX_LINE, is_carried, is_question};
use crate::relay::far_board::{self, FarBoard};
use crate::relay::hand::Hand;
use crate::relay::inward::{Due, Outbox};
use crate::relay::inward::{Heard, Inward};
use crate::relay::name::{Channel, Name};
use crate::relay::network::NetworkError;
use crate::relay::outward::Outward;
use crate::relay::remote::Bystander;
use crate::relay::report::{Notice, Report};
use crate::relay::stops::{Standing, Stops};
use crate::relay::transport::{Connection, Subscription, Transport};
use crate::state::State;
use crate::system::System;
use keeper::Keeper;

/// Between two tries to connect for the first time.
const CONNECT_AGAIN: Duration = Duration::from_millis(250);
/// Most questions of the other site that the board is told within [`QUESTIONS_US`]: a fiftieth of its line.
const QUESTIONS: u32 = 64;
const QUESTIONS_US: u64 = 1_000_000;
/// Pings of the other site's programs that may be under way.
const PINGS: usize = 16;
/// Longest wait of the writer for something to write.
const IDLE: Duration = Duration::from_secs(1);

/// What a bridge is told.
pub struct Settings {
    /// The role of this site's board.
    pub role: Role,
    /// Where its console is.
    pub place: Place,
    /// What both bridges call the bench.
    pub name: Name,
    /// The way to the other site.
    pub network: Arc<dyn Transport>,
    /// How old something from the other site may be and still be passed on.
    pub max_age: Duration,
    /// Whether programs on this computer may watch the other site's board.
    pub shows_far_board: bool,
    /// The clock that it goes by, and the ports among which it looks for its board.
    pub system: System,
}

/// A bridge that runs. Dropping it ends it.
pub struct Site {
    shared: Arc<Shared>,
    link: Link,
    writer: Option<JoinHandle<()>>,
    keeper: Option<JoinHandle<()>>,
}

struct Shared {
    settings: Settings,
    other_role: Role,
    session: u64,
    started_us: u64,
    wire: OnceLock<Box<dyn Connection>>,
    outward: Mutex<Outward>,
    inward: Mutex<Inward>,
    outbox: Outbox,
    board: OnceLock<LinkSender>,
    /// Who the board here is, while it is there.
    board_hello: Mutex<Option<Hello>>,
    /// The other board is there in its place: what that says is not this board's.
    is_other_board: AtomicBool,
    /// Until when the other site watches the board here, in µs.
    shown_until_us: AtomicU64,
    far_board: OnceLock<FarBoard>,
    /// Since when questions are counted, in µs, and how many have come.
    questions: Mutex<(u64, u32)>,
    /// The last pings of the other site's programs, the newest first: when they were passed on, in µs, and their own
    /// numbers.
    pings: Mutex<VecDeque<(u64, u64)>>,
    /// How many lines of the log were sent.
    lines: AtomicU32,
    stops: Mutex<Stops>,
    hand: Mutex<Hand>,
    rival: Mutex<Bystander>,
    notices: Sender<Notice>,
    is_ended: AtomicBool,
    /// Wakes the keeper for its end.
    keeper_woken: Arc<dyn Notify>,
}

/// A number that no other start of a bridge has.
pub fn random_number() -> u64 {
    RandomState::new().hash_one(0)
}

/// The role of the board at the other site; none for a host, who has no board.
pub const fn opposite(role: Role) -> Option<Role> {
    match role {
        Role::Sensor => Some(Role::Display),
        Role::Display => Some(Role::Sensor),
        Role::Host => None,
    }
}

/// How the bridge of the board of `role` introduces itself.
pub fn bridge_hello(role: Role) -> Hello {
    Hello {
        role: role.byte(),
        ..link::host_hello()
    }
}

impl Site {
    /// Starts a bridge. It looks for its board and for the other site for as long as it lives; what a person should
    /// know comes out of the receiver. Fails if it can't listen, or if `role` is a host's.
    pub fn open(settings: Settings) -> Result<(Self, Receiver<Notice>), NetworkError> {
        let (role, place, system) = (
            settings.role,
            settings.place.clone(),
            settings.system.clone(),
        );
        let clock = Arc::clone(&system.clock);
        let other_role = opposite(role)
            .ok_or_else(|| NetworkError::Engine("a host has no board to be carried".to_owned()))?;
        let (notices, told) = mpsc::channel();
        let session = random_number();
        let shared = Arc::new(Shared {
            other_role,
            session,
            started_us: clock.now_us(),
            wire: OnceLock::new(),
            outward: Mutex::new(Outward::new(bridge_hello(role), session)),
            inward: Mutex::new(Inward::new(other_role, session, settings.max_age)),
            outbox: Outbox::new(clock.notify()),
            board: OnceLock::new(),
            board_hello: Mutex::new(None),
            is_other_board: AtomicBool::new(false),
            shown_until_us: AtomicU64::new(0),
            far_board: OnceLock::new(),
            questions: Mutex::default(),
            pings: Mutex::default(),
            lines: AtomicU32::new(0),
            stops: Mutex::new(Stops::default()),
            hand: Mutex::new(Hand::default()),
            rival: Mutex::default(),
            notices,
            is_ended: AtomicBool::new(false),
            keeper_woken: clock.notify(),
            settings,
        });
        if shared.settings.network.endpoints().is_empty() {
            shared.connect()?;
        } else {
            let shared = Arc::clone(&shared);
            clock.spawn(Box::new(move || shared.keep_connecting()));
        }
        let carrier = Arc::clone(&shared);
        let link = Link::open_on(&system, role, place, move |event| match event {
            Event::Heard { at_us, message } => carrier.carry(at_us, message),
            // What comes of it is told within two seconds.
            Event::StateChanged(State::Opened { .. }) => {}
            Event::StateChanged(state) => {
                *locked(&carrier.board_hello) = match &state {
                    State::Known(_, hello) => Some(*hello),
                    _ => None,
                };
                let is_other = state.who(role) != Some(role);
                if carrier.is_other_board.swap(is_other, Ordering::AcqRel) && !is_other {
                    // The other one may have answered for it.
                    locked(&carrier.stops).tell_again();
                }
                carrier.tell(Notice::Board(state));
            }
            // Its numbers tell the other site, and sooner.
            Event::Restarted => locked(&carrier.stops).on_restart(),
        });
        let (sender, writing) = (link.sender(), Arc::clone(&shared));
        let _ = shared.board.set(link.sender());
        let writer = clock.spawn(Box::new(move || writing.write(&sender)));
        let keeping = Arc::clone(&shared);
        let keeper = clock.spawn(Box::new(move || Keeper::new(keeping).run()));
        let site = Self {
            shared,
            link,
            writer: Some(writer),
            keeper: Some(keeper),
        };
        Ok((site, told))
    }

    /// A way to say Stop that can be handed to other threads.
    pub fn stopper(&self) -> impl Fn(Stop) + Send + Sync + 'static {
        let shared = Arc::clone(&self.shared);
        move |stop| shared.stop(stop)
    }

    /// Says Stop to both boards: to this one now, to the other one as soon as the network lets it through, and
    /// to each again until it says that it has stopped.
    pub fn stop(&self, stop: Stop) {
        self.shared.stop(stop);
    }

    /// The boards that have not answered a Stop.
    pub fn unstopped(&self) -> Vec<Notice> {
        let unanswered = locked(&self.shared.stops).unanswered();
        self.shared.not_stopped(unanswered)
    }

    /// A way to hand the bench over that can be handed to other threads: see [`Site::hand_over`].
    pub fn hander_over(&self) -> impl Fn() + Send + Sync + 'static {
        let shared = Arc::clone(&self.shared);
        move || shared.hand_over()
    }

    /// Hands the bench over to the bridge of this site that waits for it. What comes of it is told.
    pub fn hand_over(&self) {
        self.shared.hand_over();
    }

    /// A way to tell what the log of the board here says to who watches it from the other site, that can be handed to
    /// other threads.
    pub fn log_teller(&self) -> impl Fn(LogEvent) + Send + Sync + 'static {
        let shared = Arc::clone(&self.shared);
        move |event| shared.on_log(event)
    }

    /// How the bridge stands. Ages are of the time since this was last asked, or of all of it.
    pub fn report(&self, total: bool) -> Report {
        let shared = &self.shared;
        let outward = locked(&shared.outward);
        let (outgoing, round_trip_us) = (outward.counts, outward.flow.round_trip_us());
        drop(outward);
        let mut inward = locked(&shared.inward);
        Report {
            site: shared.settings.role.name(),
            uptime_s: (shared.now_us() - shared.started_us) as f64 / 1e6,
            board: self.link.state().word(),
            far: inward.remote().state().word(),
            hand: locked(&shared.hand).holding().word(),
            round_trip_us,
            incoming: inward.counts(),
            outgoing,
            age: if total {
                inward.total()
            } else {
                inward.take_recent()
            },
            total,
        }
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        self.shared.is_ended.store(true, Ordering::Release);
        self.shared.outbox.close();
        self.shared.keeper_woken.notify();
        for thread in [self.writer.take(), self.keeper.take()]
            .into_iter()
            .flatten()
        {
            self.shared.settings.system.clock.join(thread);
        }
        self.shared.say(Channel::Stop, Content::Leaving);
        if let Some(wire) = self.shared.wire.get() {
            wire.close();
        }
    }
}

impl Shared {
    fn now_us(&self) -> u64 {
        self.settings.system.clock.now_us()
    }

    fn tell(&self, notice: Notice) {
        // Who does not listen any more does not want to know.
        let _ = self.notices.send(notice);
    }

    fn say(&self, channel: Channel, content: Content) -> bool {
        let envelope = locked(&self.outward).other(self.now_us(), content);
        self.wire
            .get()
            .is_some_and(|wire| wire.publish(channel, &envelope))
    }

    fn connect(self: &Arc<Self>) -> Result<(), NetworkError> {
        let subscription = |keys, hear: fn(&Self, &[u8])| {
            // The engine keeps what listens for as long as the wire is there, and the wire is in here.
            let shared = Arc::downgrade(self);
            let on_bytes = move |bytes: &[u8]| {
                if let Some(shared) = shared.upgrade() {
                    hear(&shared, bytes);
                }
            };
            Subscription {
                keys,
                on_bytes: Box::new(on_bytes),
            }
        };
        let subscriptions = vec![
            subscription(self.settings.name.keys(self.other_role), Self::hear),
            subscription(
                self.settings.name.key(Role::Host, Channel::Stop),
                Self::hear_operator,
            ),
            subscription(
                self.settings.name.key(self.settings.role, Channel::Clock),
                Self::hear_rival,
            ),
        ];
        let wire = self.settings.network.connect(
            &self.settings.name,
            self.settings.role,
            subscriptions,
        )?;
        // Only one thread connects, once.
        let _ = self.wire.set(wire);
        Ok(())
    }

    fn pause(&self, span: Duration) {
        let clock = &self.settings.system.clock;
        clock
            .notify()
            .wait_until(clock.now_us().saturating_add(micros(span)));
    }

    fn keep_connecting(self: &Arc<Self>) {
        while !self.is_ended.load(Ordering::Acquire) && self.connect().is_err() {
            self.pause(CONNECT_AGAIN);
        }
    }

    fn carry(&self, at_us: u64, message: Message) {
        let obeyed = if self.is_other_board.load(Ordering::Acquire) {
            None
        } else {
            let mut stops = locked(&self.stops);
            stops.on_state(&message);
            stops.obeyed(at_us, &message)
        };
        if let Some((trip, ids)) = obeyed {
            // By another program, or by the board itself: both stop.
            let (id, reason) = (random_number(), StopReason::Host);
            let is_news = locked(&self.stops).spread(id, Stop { reason });
            if is_news || !ids.is_empty() {
                self.tell(Notice::Stopped(trip));
            }
            for id in ids {
                self.say(Channel::Stop, Content::Stopped { id, trip });
            }
            if is_news {
                let stop = Stop { reason };
                self.say(Channel::Stop, Content::Stop { id, stop });
            }
        }
        if self.is_shown()
            && let Some(message) = self.shown(&message)
        {
            self.say(Channel::Shown, Content::Shown(message));
        }
        if !is_carried(self.settings.role, &message) {
            return;
        }
        let envelope = locked(&self.outward).carry(at_us, self.now_us(), message);
        // Nobody has answered before there was a wire.
        if let (Some(envelope), Some(wire)) = (envelope, self.wire.get())
            && !wire.publish(Channel::Board, &envelope)
        {
            locked(&self.outward).counts.failed += 1;
        }
    }

    /// Whether the other site watches the board here.
    fn is_shown(&self) -> bool {
        self.now_us() < self.shown_until_us.load(Ordering::Acquire)
    }

    /// What of `message` is for who watches from the other site.
    fn shown(&self, message: &Message) -> Option<Message> {
        match message {
            // Ten times as much as all the rest: a network that is slow already is spared them.
            Message::Gauges(_) if !locked(&self.outward).flow.is_answered(self.now_us()) => None,
            // With the number that it was asked by; others are for programs here.
            Message::Pong(pong) => {
                let pings = locked(&self.pings);
                let asked = pings.iter().find(|(own_us, _)| *own_us == pong.sent_us)?;
                Some(Message::Pong(Pong {
                    sent_us: asked.1,
                    ..*pong
                }))
            }
            message => Some(message.clone()),
        }
    }

    /// The log of the board here says something.
    fn on_log(&self, event: LogEvent) {
        if self.is_shown()
            && let Some(line) = LogLine::of(event, MAX_LINE)
        {
            let number = self.lines.fetch_add(1, Ordering::Relaxed);
            self.say(Channel::Shown, Content::Log { number, line });
        }
    }

    /// Who watches at the other site asks the board here.
    fn on_question(&self, at_us: u64, message: &Message) {
        let mut questions = locked(&self.questions);
        if at_us.saturating_sub(questions.0) >= QUESTIONS_US {
            *questions = (at_us, 0);
        }
        questions.1 = questions.1.saturating_add(1);
        let is_too_many = questions.1 > QUESTIONS;
        drop(questions);
        let Some(board) = self.board.get().filter(|_| !is_too_many) else {
            return;
        };
        let message = match *message {
            // Under a number of this bridge's own, for another program's may be the same.
            Message::Ping(Ping { sent_us }) => {
                let mut pings = locked(&self.pings);
                pings.truncate(PINGS - 1);
                pings.push_front((at_us, sent_us));
                Message::Ping(Ping { sent_us: at_us })
            }
            ref question => question.clone(),
        };
        // Asked again if it is not answered.
        let _ = board.post(&message);
    }

    /// Bytes came from the other site.
    fn hear(&self, bytes: &[u8]) {
        let at_us = self.now_us();
        let mut inward = locked(&self.inward);
        let heard = match inward.hear(bytes, at_us, |notice| self.tell(notice)) {
            // Under the lock, so that nothing older can slip in behind it.
            Heard::Pass(waiting) => {
                if self.outbox.put(waiting) {
                    inward.counts_mut().replaced += 1;
                }
                return;
            }
            heard => heard,
        };
        drop(inward);
        match heard {
            Heard::Nothing | Heard::Pass(_) => {}
            Heard::Asked {
                session: to,
                ping: Ping { sent_us },
                holds,
            } => {
                let pong = Pong {
                    sent_us,
                    received_us: at_us,
                    answered_us: self.now_us(),
                };
                self.say(Channel::Clock, Content::Pong { to, pong, holds });
            }
            Heard::Answered { answer, holds } => {
                locked(&self.outward).flow.on_answer(answer);
                let news = locked(&self.hand).on_word(holds);
                if let Some(news) = news {
                    self.tell(news);
                }
            }
            Heard::Stop(id, stop) => self.on_stop(self.other_role, id, stop),
            Heard::Watched => {
                let until_us = at_us.saturating_add(far_board::WATCH_US);
                self.shown_until_us.store(until_us, Ordering::Release);
                let hello = *locked(&self.board_hello);
                if let Some(hello) = hello {
                    self.say(Channel::Shown, Content::Greeting(hello));
                }
            }
            Heard::Greeting(hello) => {
                self.far_board
                    .get()
                    .inspect(|far_board| far_board.greet(hello));
            }
            Heard::Shown(message) => {
                self.far_board
                    .get()
                    .inspect(|far_board| far_board.say(&message));
            }
            Heard::Log(number, line) => {
                self.far_board
                    .get()
                    .inspect(|far_board| far_board.log(number, &line));
            }
            Heard::Question(message) => self.on_question(at_us, &message),
            Heard::Stopped(id, trip) => {
                if locked(&self.stops).on_outcome(id) {
                    self.tell(Notice::StopHeard(self.other_role, trip));
                }
            }
        }
    }

    /// Bytes came from an operator who has no board.
    fn hear_operator(&self, bytes: &[u8]) {
        if let Ok(envelope) = Envelope::from_bytes(bytes)
            && let Content::Stop { id, stop } = envelope.content
        {
            self.on_stop(Role::Host, id, stop);
        }
    }

    /// Bytes came from a bridge that calls itself like this one.
    fn hear_rival(&self, bytes: &[u8]) {
        if let Ok(envelope) = Envelope::from_bytes(bytes)
            && envelope.session != self.session
            && locked(&self.rival).hear(self.now_us())
        {
            self.tell(Notice::Rival(self.settings.role));
        }
    }

    fn on_stop(&self, by: Role, id: u64, stop: Stop) {
        let standing = locked(&self.stops).hear(id, stop);
        let content = match standing {
            Standing::New => {
                // An operator may be gone before the other site can hear him.
                if by == Role::Host {
                    locked(&self.stops).pass_on(id, stop);
                }
                self.tell_board(id, stop);
                self.tell(Notice::StopSaid(by));
                return;
            }
            Standing::Pending { is_told } => Content::Stopping { id, is_told },
            Standing::Done(trip) => Content::Stopped { id, trip },
        };
        self.say(Channel::Stop, content);
    }

    /// Says to the board what is due, until the bridge ends.
    fn write(&self, sender: &LinkSender) {
        loop {
            match self.outbox.take(self.now_us().saturating_add(micros(IDLE))) {
                Due::Closed => return,
                Due::Nothing => {}
                Due::Message(waiting) if self.now_us() < waiting.from_us => {
                    let left_us = waiting.from_us.saturating_sub(self.now_us());
                    self.pause(Duration::from_micros(left_us));
                    if self.outbox.put_back(waiting) {
                        locked(&self.inward).counts_mut().replaced += 1;
                    }
                }
                Due::Message(waiting) if self.now_us() > waiting.until_us => {
                    locked(&self.inward).counts_mut().stale += 1;
                }
                Due::Message(waiting) => match sender.post(&waiting.message) {
                    Ok(()) => locked(&self.inward).on_passed(&waiting, self.now_us()),
                    Err(NotSent::NotKnown) => locked(&self.inward).counts_mut().boardless += 1,
                    // A newer one is on its way, and may find the line free.
                    Err(NotSent::Stuck) => locked(&self.inward).counts_mut().stuck += 1,
                },
            }
        }
    }

    /// Lets programs here watch the other site's board, unless another relay does.
    fn show_far_board(self: &Arc<Self>) {
        // It is in there.
        let shared = Arc::downgrade(self);
        let on_said = move |message| match (shared.upgrade(), message) {
            (Some(shared), Message::Stop(stop)) => shared.stop(stop),
            (Some(shared), question) if is_question(&question) => {
                shared.say(Channel::Clock, Content::Question(question));
            }
            _ => {}
        };
        let clock = Arc::clone(&self.settings.system.clock);
        if let Some(far_board) =
            FarBoard::open(&self.settings.name, self.other_role, clock, on_said)
        {
            let _ = self.far_board.set(far_board);
        }
    }

    fn hand_over(&self) {
        locked(&self.hand).hand_over(self.now_us());
    }

    fn stop(&self, stop: Stop) {
        let (id, is_new) = locked(&self.stops).say(random_number(), stop);
        self.tell_board(id, stop);
        if is_new {
            self.tell(Notice::StopSaid(self.settings.role));
            self.say(Channel::Stop, Content::Stop { id, stop });
        }
    }

    /// Words of the boards that have not answered: this site's, and the other site's.
    fn not_stopped(&self, [here, there]: [bool; 2]) -> Vec<Notice> {
        let each = [
            (here, self.settings.role, true),
            (there, self.other_role, false),
        ];
        let unstopped = each.into_iter().filter(|(is_unstopped, ..)| *is_unstopped);
        unstopped
            .map(|(_, role, is_here)| Notice::NotStopped { role, is_here })
            .collect()
    }

    /// Says Stop to the board, whose link says it again until it is answered.
    fn tell_board(&self, id: u64, stop: Stop) {
        let Some(board) = self.board.get() else {
            return;
        };
        // The lock keeps an answer that is quicker than this thread from being heard before.
        let mut stops = locked(&self.stops);
        let told_us = self.now_us();
        if board.stop(stop).is_ok() && stops.tell(id, told_us) {
            drop(stops);
            self.tell(Notice::StopPassed);
        }
    }
}
