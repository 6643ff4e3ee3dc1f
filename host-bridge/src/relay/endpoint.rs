//! Where a bridge listens or connects: `tcp/HOST:PORT`, `udp/HOST:PORT`, or with certificates `tls/HOST:PORT`.

use std::fmt;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs, UdpSocket};
use std::str::FromStr;

/// How bytes travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// One stream, open: whoever reaches the port takes part.
    Tcp,
    /// One stream, encrypted, with certificates on both ends.
    Tls,
    /// The same, and beside it UDP datagrams at the same port for what only the newest of matters: what is lost holds
    /// up nothing.
    Udp,
}

impl Carrier {
    /// All.
    const ALL: [Self; 3] = [Self::Tcp, Self::Tls, Self::Udp];

    /// What endpoints of it begin with.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tcp => "tcp",
            Self::Tls => "tls",
            Self::Udp => "udp",
        }
    }
}

/// One end of a connection, by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// How bytes travel.
    pub carrier: Carrier,
    /// A name, an IPv4 address, or an IPv6 address in brackets.
    pub host: String,
    /// The port, 1 or above.
    pub port: u16,
}

/// Why a word is no endpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// None of `tcp/`, `udp/` and `tls/` is in front.
    #[error(
        "say tcp/HOST:PORT or udp/HOST:PORT, or tls/HOST:PORT with certificates, e.g. tcp/192.168.1.20:7447"
    )]
    Transport,
    /// There is no port behind the last colon.
    #[error("no port from 1 to 65535 behind the host, e.g. tcp/192.168.1.20:7447")]
    Port,
    /// The host is none.
    #[error("{0:?} is no host: a name, an IPv4 address, or an IPv6 address in [ ]")]
    Host(String),
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(given: &str) -> Result<Self, EndpointError> {
        let (name, rest) = given.split_once('/').ok_or(EndpointError::Transport)?;
        let carrier = Carrier::ALL
            .into_iter()
            .find(|carrier| carrier.name() == name)
            .ok_or(EndpointError::Transport)?;
        let (host, port) = rest.rsplit_once(':').ok_or(EndpointError::Port)?;
        let port = port.parse().map_err(|_| EndpointError::Port)?;
        if port == 0 {
            return Err(EndpointError::Port);
        }
        let bracketed = host
            .strip_prefix('[')
            .and_then(|host| host.strip_suffix(']'));
        let is_host = match bracketed {
            Some(address) => address.parse::<std::net::Ipv6Addr>().is_ok(),
            None => {
                let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
                !host.is_empty() && host.bytes().all(is_plain)
            }
        };
        if !is_host {
            return Err(EndpointError::Host(host.to_owned()));
        }
        Ok(Self {
            carrier,
            host: host.to_owned(),
            port,
        })
    }
}

impl Endpoint {
    /// Whether only this computer reaches it.
    pub fn is_loopback(&self) -> bool {
        let host = self.host.trim_start_matches('[').trim_end_matches(']');
        host == "localhost"
            || host
                .parse::<IpAddr>()
                .is_ok_and(|address| address.is_loopback())
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}:{}", self.carrier.name(), self.host, self.port)
    }
}

impl Endpoint {
    /// Where its stream goes, in the engine's words.
    pub fn locator(&self) -> String {
        let stream = match self.carrier {
            Carrier::Udp => Carrier::Tcp,
            stream => stream,
        };
        format!("{}/{}:{}", stream.name(), self.host, self.port)
    }

    /// The addresses behind the name, at this moment. Fails if the name can't be resolved.
    pub fn resolve(&self) -> io::Result<Vec<SocketAddr>> {
        let found = format!("{}:{}", self.host, self.port).to_socket_addrs()?;
        Ok(found.collect())
    }

    /// Tries whether one may listen here, so that who may not is told why in plain words. Fails with the system's reason.
    pub fn try_listening(&self) -> io::Result<()> {
        let addresses = &self.resolve()?[..];
        if self.carrier == Carrier::Udp {
            UdpSocket::bind(addresses)?;
        }
        TcpListener::bind(addresses).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_read_and_written_alike() {
        for good in [
            "tcp/localhost:7447",
            "tls/10.0.0.7:1",
            "tcp/[::1]:65535",
            "udp/localhost:7447",
        ] {
            let endpoint: Endpoint = good.parse().expect("an endpoint");
            assert_eq!(endpoint.to_string(), good);
        }
    }

    #[test]
    fn what_is_wrong_with_an_endpoint_is_named() {
        let error = |given: &str| given.parse::<Endpoint>().expect_err("no endpoint");
        assert_eq!(error("localhost:7447"), EndpointError::Transport);
        assert_eq!(error("ws/localhost:7447"), EndpointError::Transport);
        assert_eq!(error("tcp/localhost"), EndpointError::Port);
        assert_eq!(error("tcp/localhost:0"), EndpointError::Port);
        assert_eq!(error("tcp/localhost:65536"), EndpointError::Port);
        for host in ["", "a b", "a#iface=eth0", "[::", "::1"] {
            let host = host.to_owned();
            assert_eq!(error(&format!("tls/{host}:1")), EndpointError::Host(host));
        }
    }

    #[test]
    fn a_port_in_use_is_noticed_before_the_engine_is_started() {
        let tcp = TcpListener::bind("127.0.0.1:0").expect("a port");
        let udp = UdpSocket::bind("127.0.0.1:0").expect("a port");
        for (name, taken) in [("tcp", tcp.local_addr()), ("udp", udp.local_addr())] {
            let taken = taken.expect("an address");
            let endpoint: Endpoint = format!("{name}/{taken}").parse().expect("one");
            let error = endpoint.try_listening().expect_err("it is taken");
            assert_eq!(error.kind(), io::ErrorKind::AddrInUse);
        }
    }
}
