//! Whom the engine's access control refuses: it throws away what a certificate may not say, and only mentions it to
//! those who follow its traces. This does, and keeps what a person should know of it: who, and what, once. So it does
//! of datagrams.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::fmt::{Debug, Write};
use std::sync::{Mutex, Once};

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::{self, Interest};
use tracing::{Event, Metadata, Subscriber};

use crate::clock;
use crate::lock::locked;

/// Where the engine traces what it allows and what not.
const TARGET: &str = "zenoh::net::routing::interceptor::access_control";
/// Pairs of a peer and a key that are named within one [`WINDOW_US`]; of the rest only the number is told.
const NAMED: usize = 16;
/// After so long, in µs, whoever goes on is named again.
const WINDOW_US: u64 = 60_000_000;
/// Longest word of another's that is repeated, in bytes.
const LONGEST: usize = 80;

/// Something that was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refused {
    /// A peer may not speak on a key.
    Named {
        /// The peer: its certificate's name, or else what the engine calls it.
        peer: String,
        /// The key; none if it may not speak at all.
        key: Option<String>,
    },
    /// So many more were refused, by whomever.
    More(u64),
}

/// What was refused lately. However many and however various it is, no more than [`NAMED`] are told in a window.
#[derive(Debug, Default)]
struct Ledger {
    since_us: u64,
    /// Certificates' names by the engine's.
    names: HashMap<String, String>,
    named: HashSet<(String, Option<String>)>,
    untold: Vec<Refused>,
    more: u64,
}

impl Ledger {
    fn note(&mut self, now_us: u64, peer: &str, key: Option<&str>) {
        if now_us.saturating_sub(self.since_us) >= WINDOW_US {
            self.since_us = now_us;
            self.named.clear();
            self.names.clear();
            if self.more > 0 {
                self.untold.push(Refused::More(self.more));
                self.more = 0;
            }
        }
        let peer = cut(self.names.get(peer).map_or(peer, String::as_str));
        let key = key.map(cut);
        // Who may speak on no key at all is not named once more for each of them.
        let is_known = self.named.contains(&(peer.clone(), None));
        let is_news =
            !is_known && self.named.len() < NAMED && self.named.insert((peer.clone(), key.clone()));
        if is_news {
            self.untold.push(Refused::Named { peer, key });
        } else {
            self.more += 1;
        }
    }

    fn name(&mut self, peer: &str, name: &str) {
        if self.names.len() < NAMED {
            self.names.insert(peer.to_owned(), name.to_owned());
        }
    }
}

/// No more of a stranger's word than is needed to know it.
fn cut(word: &str) -> String {
    let printable = word.chars().filter(|letter| !letter.is_control());
    printable.take(LONGEST).collect()
}

/// What the engine says of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Denial<'a> {
    /// The engine's name of the peer.
    peer: &'a str,
    /// The name in its certificate, if that is said.
    name: Option<&'a str>,
    /// What it wanted, in the engine's words; empty if it may nothing at all.
    what: &'a str,
    key: &'a str,
    /// Whether it was judged before: then it is something that was really said.
    is_cached: bool,
}

impl<'a> Denial<'a> {
    fn read(text: &'a str) -> Option<Self> {
        if let Some((peer, _)) = text.split_once(" did not match any configured ACL subject") {
            return Some(Self {
                peer,
                name: None,
                what: "",
                key: "",
                is_cached: true,
            });
        }
        let judged = text.strip_prefix("Using cached result: ");
        let (who, rest) = judged.unwrap_or(text).split_once(" is unauthorized to ")?;
        let (what, key) = rest.rsplit_once(" on ")?;
        let (peer, subject) = who.split_once(" on ").unwrap_or((who, ""));
        let name_in = |part: &'a str| part.strip_prefix("CertCommonName(")?.strip_suffix(')');
        Some(Self {
            peer,
            name: subject.split('+').find_map(name_in),
            what,
            key,
            is_cached: judged.is_some(),
        })
    }
}

static LEDGER: Mutex<Option<Ledger>> = Mutex::new(None);

/// From now on, what is refused is kept for [`take`].
pub fn watch() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // A program that has a subscriber of its own goes without.
        let _ = subscriber::set_global_default(Watcher);
    });
}

/// What was refused since this was last asked, as far as a person should know.
pub fn take() -> Vec<Refused> {
    locked(&LEDGER)
        .as_mut()
        .map(|ledger| std::mem::take(&mut ledger.untold))
        .unwrap_or_default()
}

/// A peer, by its certificate's name, has sent a datagram on a key that is not its own; no key if it has none at all.
pub fn note(name: &str, key: Option<&str>) {
    locked(&LEDGER)
        .get_or_insert_default()
        .note(clock::now_us(), name, key);
}

thread_local! {
    /// For which peer and key it is being judged beforehand what may be said: a question is judged first, and of what is
    /// judged in the same go nothing was said.
    static JUDGED: RefCell<Option<(String, String)>> = const { RefCell::new(None) };
}

fn hear(denial: Denial<'_>) {
    let Denial {
        peer,
        name,
        what,
        key,
        is_cached,
    } = denial;
    let mut ledger = locked(&LEDGER);
    let ledger = ledger.get_or_insert_default();
    if let Some(name) = name {
        ledger.name(peer, name);
    }
    let pair = (peer.to_owned(), key.to_owned());
    let is_said = match what.split(' ').next() {
        Some("Query") if !is_cached => {
            JUDGED.set(Some(pair));
            false
        }
        Some("Put") if !is_cached => JUDGED.take() != Some(pair),
        Some("Put" | "Delete" | "") => is_cached,
        _ => false,
    };
    if is_said {
        let key = (!key.is_empty()).then_some(key);
        ledger.note(clock::now_us(), peer, key);
    }
}

struct Watcher;

impl Subscriber for Watcher {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        if metadata.target() == TARGET {
            Interest::always()
        } else {
            Interest::never()
        }
    }

    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target() == TARGET
    }

    fn event(&self, event: &Event<'_>) {
        let mut text = Text::default();
        event.record(&mut text);
        if let Some(denial) = Denial::read(&text.0) {
            hear(denial);
        }
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// The message of an event.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // A string takes everything.
            let _ = write!(self.0, "{value:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_read_from_the_engines_words_and_a_permission_is_none() {
        let key = "ridgelink/bench/display/board";
        let said = Denial {
            peer: "4f2a",
            name: None,
            what: "Put (ingress)",
            key,
            is_cached: true,
        };
        let words = format!("Using cached result: 4f2a is unauthorized to Put (ingress) on {key}");
        assert_eq!(Denial::read(&words), Some(said));
        let words = format!(
            "4f2a on lo+CertCommonName(bench.operator)+tls+4f2a is unauthorized to Put (ingress) on {key}"
        );
        let judged = Denial {
            name: Some("bench.operator"),
            is_cached: false,
            ..said
        };
        assert_eq!(Denial::read(&words), Some(judged));
        let words = "4f2a did not match any configured ACL subject. Default permission `Deny`";
        let nobody = Denial::read(words).expect("a refusal");
        assert_eq!((nobody.peer, nobody.key), ("4f2a", ""));
        assert_eq!(
            Denial::read("4f2a is authorized to Put (ingress) on a"),
            None
        );
    }

    #[test]
    fn a_flood_of_refusals_is_told_in_a_few_words() {
        let mut ledger = Ledger::default();
        for round in 0..100_000_u64 {
            let key = format!("k/{}", round % 1_000);
            ledger.note(round, "peer", Some(&key));
        }
        assert_eq!(ledger.untold.len(), NAMED);
        ledger.note(WINDOW_US, "peer", Some("k/0"));
        let more = 100_000 - NAMED as u64;
        assert_eq!(ledger.untold[NAMED], Refused::More(more));
        assert_eq!(ledger.untold.len(), NAMED + 2, "it is named again");
    }

    #[test]
    fn who_may_speak_on_no_key_is_named_once_whatever_it_tries() {
        let mut ledger = Ledger::default();
        ledger.note(0, "4f2a", None);
        ledger.note(0, "4f2a", Some("ridgelink/bench/display/stop"));
        ledger.note(0, "4f2a", None);
        ledger.note(0, "8c01", Some("ridgelink/bench/display/stop"));
        let keys: Vec<_> = ledger
            .untold
            .iter()
            .map(|refused| match refused {
                Refused::Named { peer, key } => (peer.as_str(), key.is_some()),
                Refused::More(_) => panic!("nothing is kept back yet"),
            })
            .collect();
        assert_eq!(keys, [("4f2a", false), ("8c01", true)]);
        assert_eq!(ledger.more, 2);
    }

    #[test]
    fn a_strangers_word_is_cut_and_cleaned() {
        let mut ledger = Ledger::default();
        ledger.note(0, &"p".repeat(1_000), Some("k\n\u{1b}[2J"));
        let Some(Refused::Named { peer, key, .. }) = ledger.untold.first() else {
            panic!("nothing was told");
        };
        assert_eq!((peer.len(), key.as_deref()), (LONGEST, Some("k[2J")));
    }
}
