//! The board at the other site, for programs at this one: they find it as `relay:NAME.ROLE`, hear all that it says and
//! logs, may ask it what changes nothing, and stop it. Nothing is carried for it while nobody listens.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU16, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use protocol::{Hello, MAX_FRAME, Message, Role, frame};

use crate::clock::Clock;
use crate::lock::locked;
use crate::monitor::log_entry::LogLine;
use crate::place::{FAR, log_of};
use crate::relay::name::Name;
use crate::shared_port::Outlet;

/// A program that listens says something once a second; after so long, in µs, nobody does.
pub const WATCH_US: u64 = 3_000_000;
/// Between two signs of life, in µs.
const BEAT_US: u64 = 100_000;

/// The board at the other site.
pub struct FarBoard {
    outlet: Outlet,
    log: Outlet,
    /// The line that comes next.
    next_line: Mutex<Option<u32>>,
    asked: Arc<Asked>,
    hello: Mutex<Option<Hello>>,
    sequence: AtomicU16,
    said_us: AtomicU64,
    clock: Arc<dyn Clock>,
}

/// What programs have asked.
#[derive(Default)]
struct Asked {
    /// When anything was said last, in µs; 0 for never.
    at_us: AtomicU64,
    wants_hello: AtomicBool,
}

impl FarBoard {
    /// Shows the board of `role` of the bench called `name`. `on_said` is called with what programs say to it, but for
    /// their Hellos. `None` if another relay shows it already.
    pub fn open(
        name: &Name,
        role: Role,
        clock: Arc<dyn Clock>,
        on_said: impl Fn(Message) + Send + Sync + 'static,
    ) -> Option<Self> {
        let asked = Arc::<Asked>::default();
        let (theirs, time) = (Arc::clone(&asked), Arc::clone(&clock));
        let port = port(name, role);
        let outlet = Outlet::open(&port, move |frames| {
            theirs.at_us.store(time.now_us().max(1), Ordering::Release);
            for given in frames.split(|&byte| byte == 0) {
                let mut content = given.to_vec();
                let Ok((_, payload)) = frame::decode(&mut content) else {
                    continue;
                };
                match frame::message(payload) {
                    Some(Message::Hello(_)) => theirs.wants_hello.store(true, Ordering::Release),
                    Some(message) => on_said(message),
                    None => {}
                }
            }
        })?;
        Some(Self {
            outlet,
            log: Outlet::open(&log_of(Path::new(&port)), |_| {})?,
            next_line: Mutex::new(None),
            asked,
            hello: Mutex::new(None),
            sequence: AtomicU16::new(0),
            said_us: AtomicU64::new(0),
            clock,
        })
    }

    pub fn is_watched(&self) -> bool {
        let at_us = self.asked.at_us.load(Ordering::Acquire);
        at_us > 0 && self.clock.now_us().saturating_sub(at_us) < WATCH_US
    }

    pub fn greet(&self, hello: Hello) {
        let is_other = locked(&self.hello).replace(hello) != Some(hello);
        if is_other {
            self.say(&Message::Hello(hello));
        }
    }

    pub fn say(&self, message: &Message) {
        let mut bytes = [0; MAX_FRAME];
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        if let Some(frame) = frame::encode(sequence, message, &mut bytes) {
            self.put(frame);
        }
    }

    /// Tells a line of its log, that with this `number` of those that were sent.
    pub fn log(&self, number: u32, line: &LogLine) {
        let next = locked(&self.next_line).replace(number.wrapping_add(1));
        // One that counts backwards has started anew.
        let lost = next.map_or(0, |next| number.wrapping_sub(next).cast_signed());
        if lost > 0 {
            self.tell(&LogLine::Lost(format!("{lost} lines were lost on the way")));
        }
        self.tell(line);
    }

    fn tell(&self, line: &LogLine) {
        // A text and a number are always written.
        let mut text = serde_json::to_string(line).unwrap_or_default();
        text.push('\n');
        self.log.say(text.as_bytes());
    }

    /// Says what is due; to be called every 25 ms or so.
    pub fn elapse(&self) {
        let hello = *locked(&self.hello);
        if let Some(hello) = hello
            && self.asked.wants_hello.swap(false, Ordering::AcqRel)
        {
            self.say(&Message::Hello(hello.asking(false)));
        }
        let said_us = self.said_us.load(Ordering::Relaxed);
        // Another thread may say something in between.
        if self.clock.now_us().saturating_sub(said_us) >= BEAT_US {
            self.put(&[]);
            self.log.say(&[]);
        }
    }

    fn put(&self, bytes: &[u8]) {
        self.said_us.store(self.clock.now_us(), Ordering::Relaxed);
        self.outlet.say(bytes);
    }
}

/// What programs call the board of `role` of the bench called `name`.
pub fn port(name: &Name, role: Role) -> String {
    format!("{FAR}{name}.{}", role.name())
}

#[cfg(test)]
mod tests {
    use std::thread::JoinHandle;

    use super::*;
    use crate::clock::{Notify, SystemClock};

    /// A clock that each time was read just before another thread read it.
    struct Behind(AtomicU64);

    impl Clock for Behind {
        fn now_us(&self) -> u64 {
            self.0.fetch_sub(1, Ordering::Relaxed)
        }

        fn notify(&self) -> Arc<dyn Notify> {
            SystemClock.notify()
        }

        fn spawn(&self, work: Box<dyn FnOnce() + Send>) -> JoinHandle<()> {
            SystemClock.spawn(work)
        }

        fn join(&self, thread: JoinHandle<()>) {
            SystemClock.join(thread);
        }
    }

    #[test]
    fn what_another_thread_says_meanwhile_ends_no_relay() {
        let name: Name = format!("far-{}", std::process::id()).parse().unwrap();
        let clock = Arc::new(Behind(AtomicU64::new(1_000_000)));
        let board = FarBoard::open(&name, Role::Sensor, clock, |_| {}).unwrap();
        board.put(&[]);
        board.elapse();
    }
}
