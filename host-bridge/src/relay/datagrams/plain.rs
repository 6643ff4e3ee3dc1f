//! UDP as it is: whoever reaches the port takes part.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::clock::now_us;
use crate::lock::locked;
use crate::relay::datagrams::{self, MAX_KEY, PEERS, SILENCE_US, Shared};
use crate::relay::endpoint::Endpoint;
use crate::relay::envelope::MAX_ENVELOPE;

/// How often who waits for datagrams looks whether it is to end.
const LOOK: Duration = Duration::from_millis(100);

/// A port that is open.
pub struct Plain {
    port: Arc<Port>,
    thread: Option<JoinHandle<()>>,
}

/// A socket, and who is told by it.
struct Port {
    socket: UdpSocket,
    /// Where it connects; none if others come.
    towards: Option<Endpoint>,
    peers: Mutex<Vec<(SocketAddr, u64)>>,
    is_ended: AtomicBool,
}

impl Plain {
    /// Listens at `endpoint`, or connects to it. Fails with the system's reason, if it has no such port.
    pub fn open(endpoint: &Endpoint, is_listening: bool, shared: Arc<Shared>) -> io::Result<Self> {
        let socket = UdpSocket::bind(&endpoint.addresses_to_bind(is_listening)?[..])?;
        socket.set_read_timeout(Some(LOOK))?;
        let port = Arc::new(Port {
            socket,
            towards: (!is_listening).then(|| endpoint.clone()),
            peers: Mutex::default(),
            is_ended: AtomicBool::new(false),
        });
        let hearing = Arc::clone(&port);
        Ok(Self {
            port,
            thread: Some(thread::spawn(move || hearing.hear(&shared))),
        })
    }
}

impl datagrams::End for Plain {
    fn send(&self, datagram: &[u8]) -> bool {
        for &(peer, _) in locked(&self.port.peers).iter() {
            // Who is not there misses it.
            let _ = self.port.socket.send_to(datagram, peer);
        }
        true
    }
}

impl Drop for Plain {
    fn drop(&mut self) {
        self.port.is_ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Port {
    fn hear(&self, shared: &Shared) {
        let mut bytes = [0; MAX_KEY + 1 + MAX_ENVELOPE];
        let mut looked_us = 0;
        while !self.is_ended.load(Ordering::Relaxed) {
            let at_us = now_us();
            if at_us.saturating_sub(looked_us) > SILENCE_US {
                looked_us = at_us;
                self.look(at_us);
            }
            let Ok((count, peer)) = self.socket.recv_from(&mut bytes) else {
                continue;
            };
            if let Some((key, envelope)) = datagrams::parts(&bytes[..count])
                && self.meet(peer, now_us())
            {
                shared.hear(key, envelope);
            }
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_looked_up_while_nobody_answers_and_not_otherwise() {
        let towards: Endpoint = "udp/127.0.0.1:7".parse().expect("an endpoint");
        let port = Port {
            socket: UdpSocket::bind("127.0.0.1:0").expect("a socket"),
            towards: Some(towards),
            peers: Mutex::default(),
            is_ended: AtomicBool::new(false),
        };
        let addresses =
            || -> Vec<SocketAddr> { locked(&port.peers).iter().map(|peer| peer.0).collect() };
        let looked_up = ["127.0.0.1:7".parse().expect("an address")];
        let answering: SocketAddr = "127.0.0.1:8".parse().expect("an address");
        port.look(SILENCE_US);
        assert_eq!(addresses(), looked_up);
        // The name means another address by now, which the one that answers does not care for.
        *locked(&port.peers) = vec![(answering, 0)];
        assert!(port.meet(answering, 10 * SILENCE_US));
        port.look(11 * SILENCE_US - 1);
        assert_eq!(addresses(), [answering]);
        port.look(11 * SILENCE_US);
        assert_eq!(addresses(), looked_up);
    }
}
