//! What only the newest of matters, in UDP datagrams beside the engine's stream: what is lost is not sent again, and
//! holds up nothing.
//!
//! A datagram is the key, a zero byte and the envelope. Who connects sends to the port of the one who listens; that one
//! answers whoever it has heard lately. While no datagram comes, the stream carries the same: a network that lets none
//! through costs nothing but them.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use std::{io, iter};

use crate::clock::now_us;
use crate::lock::locked;
use crate::relay::endpoint::Endpoint;
use crate::relay::envelope::MAX_ENVELOPE;

/// Who has not been heard for so long, in µs, is taken not to be reached by datagrams.
const SILENCE_US: u64 = 2_000_000;
/// Peers that are answered at most.
const PEERS: usize = 8;
/// Longest key, in bytes.
const MAX_KEY: usize = 128;
/// How often who waits for datagrams looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);

/// What happens with a key and bytes that come.
pub type OnDatagram = Box<dyn Fn(&str, &[u8]) + Send + Sync>;

/// A way for datagrams. Dropping it ends it.
pub struct Datagrams {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

struct Shared {
    ends: Vec<End>,
    /// Whether others come here; they are told by datagrams and, unless all of them hear those, by the stream.
    is_listening: bool,
    heard_us: AtomicU64,
    /// When one that may be lost came by the stream.
    streamed_us: AtomicU64,
    is_ended: AtomicBool,
}

/// A socket, and who is told by it.
struct End {
    socket: UdpSocket,
    /// Where it connects; none if others come.
    towards: Option<Endpoint>,
    peers: Mutex<Vec<(SocketAddr, u64)>>,
}

impl Datagrams {
    /// Listens at `endpoints`, or connects to them. None if there are none. Fails with the system's reason, if it has no
    /// such port.
    pub fn open(
        endpoints: &[&Endpoint],
        is_listening: bool,
        on_datagram: OnDatagram,
    ) -> io::Result<Option<Self>> {
        let open = |endpoint: &&Endpoint| -> io::Result<End> {
            let addresses = endpoint.resolve()?;
            let socket = if is_listening {
                UdpSocket::bind(&addresses[..])?
            } else {
                UdpSocket::bind(any_port(addresses.first().copied()))?
            };
            socket.set_read_timeout(Some(LOOK))?;
            Ok(End {
                socket,
                towards: (!is_listening).then(|| (*endpoint).clone()),
                peers: Mutex::default(),
            })
        };
        let ends = endpoints.iter().map(open).collect::<io::Result<Vec<_>>>()?;
        if ends.is_empty() {
            return Ok(None);
        }
        let shared = Arc::new(Shared {
            ends,
            is_listening,
            heard_us: AtomicU64::new(0),
            streamed_us: AtomicU64::new(0),
            is_ended: AtomicBool::new(false),
        });
        let on_datagram = Arc::new(on_datagram);
        let threads = (0..shared.ends.len()).map(|end| {
            let (shared, on_datagram) = (Arc::clone(&shared), Arc::clone(&on_datagram));
            thread::spawn(move || shared.hear(end, &on_datagram))
        });
        Ok(Some(Self {
            threads: threads.collect(),
            shared,
        }))
    }

    /// Sends something to all that are there. True if that is enough: otherwise the stream is to carry it as well.
    pub fn send(&self, key: &str, bytes: &[u8]) -> bool {
        let shared = &self.shared;
        let datagram: Vec<u8> = key
            .bytes()
            .chain(iter::once(0))
            .chain(bytes.iter().copied())
            .collect();
        for end in &shared.ends {
            for &(peer, _) in locked(&end.peers).iter() {
                // Who is not there misses it.
                let _ = end.socket.send_to(&datagram, peer);
            }
        }
        let was_lately = |at: &AtomicU64| {
            let at_us = at.load(Ordering::Relaxed);
            at_us > 0 && now_us().saturating_sub(at_us) < SILENCE_US
        };
        let needs_stream = shared.is_listening && was_lately(&shared.streamed_us);
        was_lately(&shared.heard_us) && !needs_stream
    }

    /// Something came by the stream that could have come by a datagram.
    pub fn on_stream(&self) {
        self.shared.streamed_us.store(now_us(), Ordering::Relaxed);
    }
}

impl Drop for Datagrams {
    fn drop(&mut self) {
        self.shared.is_ended.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn hear(&self, end: usize, on_datagram: &OnDatagram) {
        let end = &self.ends[end];
        let mut bytes = [0; MAX_KEY + 1 + MAX_ENVELOPE];
        let mut looked_us = 0;
        while !self.is_ended.load(Ordering::Relaxed) {
            let at_us = now_us();
            if at_us.saturating_sub(looked_us) > SILENCE_US {
                looked_us = at_us;
                end.look(at_us);
            }
            let Ok((count, peer)) = end.socket.recv_from(&mut bytes) else {
                continue;
            };
            let mut parts = bytes[..count].splitn(2, |&byte| byte == 0);
            let (Some(key), Some(envelope)) = (parts.next(), parts.next()) else {
                continue;
            };
            let Ok(key) = std::str::from_utf8(key) else {
                continue;
            };
            if end.meet(peer, now_us()) {
                self.heard_us.store(now_us(), Ordering::Relaxed);
                on_datagram(key, envelope);
            }
        }
    }
}

impl End {
    /// Looks up where it connects if nothing comes from there, since its address may have changed; forgets who is gone.
    fn look(&self, at_us: u64) {
        let mut peers = locked(&self.peers);
        let is_gone = |heard_us: u64| at_us.saturating_sub(heard_us) >= SILENCE_US;
        if let Some(towards) = &self.towards {
            if peers.iter().any(|&(_, heard_us)| !is_gone(heard_us)) {
                return;
            }
            drop(peers);
            // A name look-up may take its time, in which nothing is heard.
            let Some(address) = towards.resolve().ok().and_then(|all| all.first().copied()) else {
                return;
            };
            *locked(&self.peers) = vec![(address, at_us)];
        } else {
            peers.retain(|&(_, heard_us)| !is_gone(heard_us));
        }
    }

    /// Somebody was heard: whether he is listened to.
    fn meet(&self, peer: SocketAddr, at_us: u64) -> bool {
        let mut peers = locked(&self.peers);
        let known = peers.iter_mut().find(|(known, _)| *known == peer);
        if let Some((_, heard_us)) = known {
            *heard_us = at_us;
            return true;
        }
        let has_room = self.towards.is_none() && peers.len() < PEERS;
        if has_room {
            peers.push((peer, at_us));
        }
        has_room
    }
}

fn any_port(address: Option<SocketAddr>) -> SocketAddr {
    let any: IpAddr = match address {
        Some(SocketAddr::V6(_)) => Ipv6Addr::UNSPECIFIED.into(),
        _ => Ipv4Addr::UNSPECIFIED.into(),
    };
    (any, 0).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_looked_up_while_nobody_answers_and_not_otherwise() {
        let towards: Endpoint = "udp/127.0.0.1:7".parse().expect("an endpoint");
        let end = End {
            socket: UdpSocket::bind("127.0.0.1:0").expect("a socket"),
            towards: Some(towards),
            peers: Mutex::default(),
        };
        let addresses =
            || -> Vec<SocketAddr> { locked(&end.peers).iter().map(|peer| peer.0).collect() };
        let looked_up = ["127.0.0.1:7".parse().expect("an address")];
        let answering: SocketAddr = "127.0.0.1:8".parse().expect("an address");
        end.look(SILENCE_US);
        assert_eq!(addresses(), looked_up);
        // The name means another address by now, which the one that answers does not care for.
        *locked(&end.peers) = vec![(answering, 0)];
        assert!(end.meet(answering, 10 * SILENCE_US));
        end.look(11 * SILENCE_US - 1);
        assert_eq!(addresses(), [answering]);
        end.look(11 * SILENCE_US);
        assert_eq!(addresses(), looked_up);
    }
}
