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
    /// Whoever has several addresses is told at each of them until one answers.
    fn look(&self, at_us: u64) {
        let mut peers = locked(&self.peers);
        let is_gone = |heard_us: u64| at_us.saturating_sub(heard_us) >= SILENCE_US;
        if let Some(towards) = &self.towards {
            if peers.iter().any(|&(_, heard_us)| !is_gone(heard_us)) {
                return;
            }
            drop(peers);
            // A name look-up may take its time, in which nothing is heard.
            if let Ok(addresses) = towards.resolve() {
                self.reach_out(&addresses, at_us);
            }
        } else {
            peers.retain(|&(_, heard_us)| !is_gone(heard_us));
        }
    }

    /// Tells whoever is at one of these addresses, from `at_us` on.
    fn reach_out(&self, addresses: &[SocketAddr], at_us: u64) {
        let is_ipv6 = self.socket.local_addr().is_ok_and(|own| own.is_ipv6());
        // What a port of IPv6 calls an address of IPv4.
        let named = |address: &SocketAddr| match address {
            SocketAddr::V4(v4) if is_ipv6 => (v4.ip().to_ipv6_mapped(), v4.port()).into(),
            address => *address,
        };
        let named = addresses.iter().take(PEERS).map(named);
        *locked(&self.peers) = named.map(|address| (address, at_us)).collect();
    }

    /// Somebody was heard: whether he is listened to.
    fn meet(&self, peer: SocketAddr, at_us: u64) -> bool {
        let mut peers = locked(&self.peers);
        let known = peers.iter_mut().find(|(known, _)| *known == peer);
        if let Some((_, heard_us)) = known {
            *heard_us = at_us;
            if self.towards.is_some() {
                // His other addresses need not be tried any more.
                peers.retain(|(known, _)| *known == peer);
            }
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
    use crate::relay::datagrams::End;
    use crate::relay::endpoint::ports_towards;

    /// Only what hangs takes so long.
    const LIMIT: Duration = Duration::from_secs(120);

    fn port(socket: UdpSocket) -> Port {
        Port {
            socket,
            towards: Some("udp/127.0.0.1:7".parse().expect("an endpoint")),
            peers: Mutex::default(),
            is_ended: AtomicBool::new(false),
        }
    }

    fn addresses(port: &Port) -> Vec<SocketAddr> {
        locked(&port.peers).iter().map(|peer| peer.0).collect()
    }

    #[test]
    fn a_name_is_looked_up_while_nobody_answers_and_not_otherwise() {
        let port = port(UdpSocket::bind("127.0.0.1:0").expect("a socket"));
        let looked_up = ["127.0.0.1:7".parse().expect("an address")];
        let answering: SocketAddr = "127.0.0.1:8".parse().expect("an address");
        port.look(SILENCE_US);
        assert_eq!(addresses(&port), looked_up);
        // The name means another address by now, which the one that answers does not care for.
        *locked(&port.peers) = vec![(answering, 0)];
        assert!(port.meet(answering, 10 * SILENCE_US));
        port.look(11 * SILENCE_US - 1);
        assert_eq!(addresses(&port), [answering]);
        port.look(11 * SILENCE_US);
        assert_eq!(addresses(&port), looked_up);
    }

    #[test]
    fn whoever_has_several_addresses_is_told_at_each_until_one_answers() {
        let [deaf, there] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a socket"));
        let of = |socket: &UdpSocket| socket.local_addr().expect("it has one");
        // Nobody is at the first one, maybe not even this computer.
        let at = ["[::1]:7".parse().expect("one"), of(&deaf), of(&there)];
        let socket = UdpSocket::bind(&ports_towards(&at)[..]).expect("a socket");
        let plain = Plain {
            port: Arc::new(port(socket)),
            thread: None,
        };
        plain.port.reach_out(&at, 0);
        let send = |text: &[u8]| assert!(plain.send(text));
        for socket in [&there, &plain.port.socket] {
            socket.set_read_timeout(Some(LIMIT)).expect("it waits");
        }
        let is_heard = |text: &[u8]| {
            let mut bytes = [0; 8];
            let (count, from) = there.recv_from(&mut bytes).expect("it comes");
            assert_eq!(&bytes[..count], text);
            from
        };
        send(b"first");
        let client = is_heard(b"first");
        there.send_to(b"answer", client).expect("it goes back");
        let mut bytes = [0; 8];
        let (_, answering) = plain.port.socket.recv_from(&mut bytes).expect("it comes");
        assert!(plain.port.meet(answering, 1));
        assert_eq!(addresses(&plain.port), [answering]);
        send(b"second");
        is_heard(b"second");
        deaf.set_nonblocking(true).expect("it does not wait");
        let told = (0..2).filter(|_| deaf.recv_from(&mut [0; 8]).is_ok());
        assert_eq!(told.count(), 1, "the first one only");
    }
}
