//! Where a bridge listens or connects: `tcp/HOST:PORT` or `tls/HOST:PORT`.

use std::fmt;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, ToSocketAddrs};
use std::str::FromStr;

/// How bytes travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Security {
    /// Open: whoever reaches the port takes part.
    Tcp,
    /// Encrypted, with certificates on both ends.
    Tls,
}

/// One end of a connection, by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// How bytes travel.
    pub security: Security,
    /// A name, an IPv4 address, or an IPv6 address in brackets.
    pub host: String,
    /// The port, 1 or above.
    pub port: u16,
}

/// Why a word is no endpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// There is no `tcp/` or `tls/` in front.
    #[error("say tcp/HOST:PORT, or tls/HOST:PORT with certificates, e.g. tcp/192.168.1.20:7447")]
    Transport,
    /// There is no port behind the last colon.
    #[error("no port from 1 to 65535 behind the host, e.g. tcp/192.168.1.20:7447")]
    Port,
    /// The host is none.
    #[error("{host:?} is no host: a name, an IPv4 address, or an IPv6 address in [ ]")]
    Host {
        /// What stands in its place.
        host: String,
    },
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(given: &str) -> Result<Self, EndpointError> {
        let (security, rest) = match given.split_once('/') {
            Some(("tcp", rest)) => (Security::Tcp, rest),
            Some(("tls", rest)) => (Security::Tls, rest),
            _ => return Err(EndpointError::Transport),
        };
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
            return Err(EndpointError::Host {
                host: host.to_owned(),
            });
        }
        Ok(Self {
            security,
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
        let security = match self.security {
            Security::Tcp => "tcp",
            Security::Tls => "tls",
        };
        write!(f, "{security}/{}:{}", self.host, self.port)
    }
}

impl Endpoint {
    /// The addresses behind the name, at this moment.
    ///
    /// # Errors
    /// If the name can't be resolved.
    pub fn resolve(&self) -> io::Result<Vec<SocketAddr>> {
        let found = format!("{}:{}", self.host, self.port).to_socket_addrs()?;
        Ok(found.collect())
    }

    /// Tries whether one may listen here, so that who may not is told why in plain words.
    ///
    /// # Errors
    /// The system's.
    pub fn try_listening(&self) -> io::Result<()> {
        TcpListener::bind(&self.resolve()?[..]).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endpoints_are_read_and_written_alike() {
        for good in ["tcp/localhost:7447", "tls/10.0.0.7:1", "tcp/[::1]:65535"] {
            let endpoint: Endpoint = good.parse().expect("an endpoint");
            assert_eq!(endpoint.to_string(), good);
        }
    }

    #[test]
    fn what_is_wrong_with_an_endpoint_is_named() {
        let error = |given: &str| given.parse::<Endpoint>().expect_err("no endpoint");
        assert_eq!(error("localhost:7447"), EndpointError::Transport);
        assert_eq!(error("udp/localhost:7447"), EndpointError::Transport);
        assert_eq!(error("tcp/localhost"), EndpointError::Port);
        assert_eq!(error("tcp/localhost:0"), EndpointError::Port);
        assert_eq!(error("tcp/localhost:65536"), EndpointError::Port);
        for host in ["", "a b", "a#iface=eth0", "[::", "::1"] {
            let host = host.to_owned();
            assert_eq!(
                error(&format!("tls/{host}:1")),
                EndpointError::Host { host }
            );
        }
    }

    #[test]
    fn a_port_in_use_is_noticed_before_the_engine_is_started() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
        let port = taken.local_addr().expect("an address").port();
        let endpoint: Endpoint = format!("tcp/127.0.0.1:{port}").parse().expect("one");
        let error = endpoint.try_listening().expect_err("it is taken");
        assert_eq!(error.kind(), io::ErrorKind::AddrInUse);
    }
}
