//! What only the newest of matters, in datagrams beside the engine's stream: what is lost is not sent again, and
//! holds up nothing.
//!
//! A datagram is the key, a zero byte and the envelope. Who connects sends to the port of the one who listens; that one
//! answers whoever it has heard lately. While no datagram comes, the stream carries the same: a network that lets none
//! through costs nothing but them.

mod plain;
mod quic;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

pub use self::quic::Identity;
use crate::clock::now_us;
use crate::relay::endpoint::{Carrier, Endpoint};

/// Who has not been heard for so long, in µs, is taken not to be reached by datagrams.
const SILENCE_US: u64 = 2_000_000;
/// Peers that are answered at most.
const PEERS: usize = 8;
/// Longest key, in bytes.
const MAX_KEY: usize = 128;

/// What happens with a key and bytes that come.
pub type OnDatagram = Box<dyn Fn(&str, &[u8]) + Send + Sync>;

/// A way for datagrams. Dropping it ends it.
pub struct Datagrams {
    ends: Vec<Box<dyn End>>,
    shared: Arc<Shared>,
    /// Whether others come here; they are told by datagrams and, unless all of them hear those, by the stream.
    is_listening: bool,
    /// When one that may be lost came by the stream.
    streamed_us: AtomicU64,
}

/// A port, and who is told by it. Dropping it ends it.
trait End: Send + Sync {
    /// Sends it to all that are there. False if it is too long.
    fn send(&self, datagram: &[u8]) -> bool;
}

/// What all ends do with what comes.
struct Shared {
    heard_us: AtomicU64,
    on_datagram: OnDatagram,
}

impl Shared {
    /// Somebody who is listened to has said something.
    fn hear(&self, key: &str, envelope: &[u8]) {
        self.heard_us.store(now_us(), Ordering::Relaxed);
        (self.on_datagram)(key, envelope);
    }
}

impl Datagrams {
    /// Listens at those of `endpoints` that have datagrams, or connects to them; with `identity`, by QUIC. None if there
    /// are none. Fails with the system's reason, if it has no such port.
    pub fn open(
        endpoints: &[Endpoint],
        is_listening: bool,
        identity: Option<&Identity>,
        on_datagram: OnDatagram,
    ) -> io::Result<Option<Self>> {
        let shared = Arc::new(Shared {
            heard_us: AtomicU64::new(0),
            on_datagram,
        });
        let open = |endpoint: &Endpoint| -> Option<io::Result<Box<dyn End>>> {
            let shared = Arc::clone(&shared);
            Some(match (endpoint.carrier, identity) {
                (Carrier::Udp, _) => plain::Plain::open(endpoint, is_listening, shared)
                    .map(|end| -> Box<dyn End> { Box::new(end) }),
                (Carrier::Quic, Some(identity)) => {
                    quic::Quic::open(endpoint, is_listening, identity.clone(), shared)
                        .map(|end| -> Box<dyn End> { Box::new(end) })
                }
                _ => return None,
            })
        };
        let ends = endpoints
            .iter()
            .filter_map(open)
            .collect::<io::Result<Vec<_>>>()?;
        Ok((!ends.is_empty()).then(|| Self {
            ends,
            shared,
            is_listening,
            streamed_us: AtomicU64::new(0),
        }))
    }

    /// Sends something to all that are there. True if that is enough: otherwise the stream is to carry it as well.
    pub fn send(&self, key: &str, bytes: &[u8]) -> bool {
        let datagram = [key.as_bytes(), &[0], bytes].concat();
        let too_long = self.ends.iter().filter(|end| !end.send(&datagram)).count();
        let was_lately = |at: &AtomicU64| {
            let at_us = at.load(Ordering::Relaxed);
            at_us > 0 && now_us().saturating_sub(at_us) < SILENCE_US
        };
        let needs_stream = self.is_listening && was_lately(&self.streamed_us);
        too_long == 0 && was_lately(&self.shared.heard_us) && !needs_stream
    }

    /// Something came by the stream that could have come by a datagram.
    pub fn on_stream(&self) {
        self.streamed_us.store(now_us(), Ordering::Relaxed);
    }
}

/// The key and the envelope in a datagram; none if it is not one of ours.
fn parts(datagram: &[u8]) -> Option<(&str, &[u8])> {
    let mut parts = datagram.splitn(2, |&byte| byte == 0);
    let (key, envelope) = (parts.next()?, parts.next()?);
    Some((std::str::from_utf8(key).ok()?, envelope))
}
