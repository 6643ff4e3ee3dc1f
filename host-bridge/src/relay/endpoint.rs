//! Where a bridge listens or connects: `tcp/HOST:PORT`, `udp/HOST:PORT`, or with certificates `tls/HOST:PORT`,
//! `quic/HOST:PORT`; and why nobody is reached there: what the network's engine keeps to itself, found out by trying.

use std::io::{Read, Write};
use std::net::{
    IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs, UdpSocket,
};
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{fmt, io};

use rustls::pki_types::ServerName;
use rustls::{CertificateError, ClientConfig, ClientConnection, Error, StreamOwned};

/// How bytes travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// One stream, open: whoever reaches the port takes part.
    Tcp,
    /// One stream, encrypted, with certificates on both ends.
    Tls,
    /// As [`Carrier::Tcp`], and beside it UDP datagrams at the same port for what only the newest of matters: what is
    /// lost holds up nothing.
    Udp,
    /// As [`Carrier::Tls`], and beside it QUIC's datagrams at the same port, with the same certificates.
    Quic,
}

impl Carrier {
    const ALL: [Self; 4] = [Self::Tcp, Self::Tls, Self::Udp, Self::Quic];

    /// What endpoints of it begin with.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tcp => "tcp",
            Self::Tls => "tls",
            Self::Udp => "udp",
            Self::Quic => "quic",
        }
    }

    /// Whether both ends have to prove who they are.
    pub const fn has_certificates(self) -> bool {
        matches!(self, Self::Tls | Self::Quic)
    }

    /// The one that does the same with certificates.
    pub const fn with_certificates(self) -> Self {
        match self {
            Self::Tcp | Self::Tls => Self::Tls,
            Self::Udp | Self::Quic => Self::Quic,
        }
    }

    const fn has_datagrams(self) -> bool {
        matches!(self, Self::Udp | Self::Quic)
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
#[expect(missing_docs, reason = "the messages say it")]
pub enum EndpointError {
    #[error(
        "say tcp/HOST:PORT or udp/HOST:PORT, or with certificates tls/HOST:PORT or quic/HOST:PORT, e.g. tcp/192.168.1.20:7447"
    )]
    Transport,
    #[error("no port from 1 to 65535 behind the host, e.g. tcp/192.168.1.20:7447")]
    Port,
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
            Some(address) => address.parse::<Ipv6Addr>().is_ok(),
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
    /// Whether whoever listens there lets in anybody beyond this computer who reaches it.
    pub fn is_open(&self) -> bool {
        let host = self.host.trim_start_matches('[').trim_end_matches(']');
        let is_loopback = host == "localhost"
            || host
                .parse::<IpAddr>()
                .is_ok_and(|address| address.is_loopback());
        !is_loopback && !self.carrier.has_certificates()
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
            Carrier::Quic => Carrier::Tls,
            stream => stream,
        };
        format!("{}/{}:{}", stream.name(), self.host, self.port)
    }

    /// The addresses behind the name, at this moment. Fails if the name can't be resolved.
    pub fn resolve(&self) -> io::Result<Vec<SocketAddr>> {
        let found = format!("{}:{}", self.host, self.port).to_socket_addrs()?;
        Ok(found.collect())
    }

    /// An endpoint for each address behind the name, at this moment. Fails if the name can't be resolved.
    pub fn each_address(&self) -> io::Result<Vec<Self>> {
        let at = |address: SocketAddr| {
            let text = address.to_string();
            let host = text
                .rsplit_once(':')
                .map_or(text.as_str(), |(host, _)| host);
            Self {
                host: host.to_owned(),
                ..self.clone()
            }
        };
        Ok(self.resolve()?.into_iter().map(at).collect())
    }

    /// Where a socket for its datagrams is bound: there, or to any port that can reach it. Fails if the name can't be
    /// resolved.
    pub fn addresses_to_bind(&self, is_listening: bool) -> io::Result<Vec<SocketAddr>> {
        let addresses = self.resolve()?;
        Ok(if is_listening {
            addresses
        } else {
            ports_towards(&addresses)
        })
    }

    /// Tries whether one may listen here, so that who may not is told why in plain words. Fails with the system's reason.
    pub fn try_listening(&self) -> io::Result<()> {
        let addresses = &self.resolve()?[..];
        if self.carrier.has_datagrams() {
            UdpSocket::bind(addresses)?;
        }
        TcpListener::bind(addresses).map(drop)
    }
}

/// Any port that reaches all of these: one of IPv6 reaches IPv4 as well, but not every system has it.
pub fn ports_towards(addresses: &[SocketAddr]) -> Vec<SocketAddr> {
    let mut ports = vec![(Ipv4Addr::UNSPECIFIED, 0).into()];
    if addresses.iter().any(SocketAddr::is_ipv6) {
        ports.insert(0, (Ipv6Addr::UNSPECIFIED, 0).into());
    }
    ports
}

/// Longest wait for the other end, at each step.
const PATIENCE: Duration = Duration::from_secs(3);

/// How far one gets with an endpoint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Somebody listens there and, with TLS, both ends believe each other.
    Reached,
    /// The name can't be resolved.
    Unresolved(String),
    /// Nobody listens.
    Refused,
    /// Nobody answers.
    Silent,
    /// The network says no.
    Unreachable(String),
    /// Somebody listens, but does not speak TLS.
    NotTls,
    /// The other end's certificate is not believed here.
    Distrusted(String),
    /// One's own certificate is not believed there.
    Rejected(String),
}

impl Reach {
    /// Tries an endpoint; takes some seconds at most. With `tls`, both ends have to prove who they are.
    pub fn of(endpoint: &Endpoint, tls: Option<&Arc<ClientConfig>>) -> Self {
        let addresses = match endpoint.resolve() {
            Ok(addresses) => addresses,
            Err(error) => {
                let reason = error.to_string();
                return Self::Unresolved(reason);
            }
        };
        let mut reach = Self::Silent;
        for address in addresses {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    return tls.map_or(Self::Reached, |tls| shake_hands(endpoint, &stream, tls));
                }
                Err(error) => reach = Self::from_io(&error),
            }
        }
        reach
    }

    fn from_io(error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::ConnectionRefused => Self::Refused,
            io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => Self::Silent,
            _ => Self::Unreachable(error.to_string()),
        }
    }

    fn from_tls(error: &io::Error) -> Self {
        let Some(error) = error.get_ref().and_then(|inner| inner.downcast_ref()) else {
            // What does not speak TLS hangs up when it is greeted, or waits for something else.
            return Self::NotTls;
        };
        match error {
            Error::InvalidCertificate(CertificateError::UnknownIssuer) => {
                Self::Distrusted("it was not made by the CA given with --ca".to_owned())
            }
            Error::InvalidCertificate(reason) => Self::Distrusted(reason.to_string()),
            Error::AlertReceived(alert) => Self::Rejected(format!("{alert:?}")),
            _ => Self::NotTls,
        }
    }
}

/// A stream that fails from an instant on, however little comes at a time.
pub(crate) struct Within<'a> {
    pub stream: &'a TcpStream,
    pub end: Instant,
}

impl Read for Within<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let left = self.end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        (&mut &*self.stream).read(bytes)
    }
}

impl Write for Within<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        (&mut &*self.stream).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn shake_hands(endpoint: &Endpoint, stream: &TcpStream, tls: &Arc<ClientConfig>) -> Reach {
    let Ok(name) = ServerName::try_from(endpoint.host.clone()) else {
        return Reach::Unresolved("no name that a certificate could have".to_owned());
    };
    let timed = stream.set_write_timeout(Some(PATIENCE));
    let connection = ClientConnection::new(Arc::clone(tls), name);
    let (Ok(()), Ok(mut connection)) = (timed, connection) else {
        return Reach::NotTls;
    };
    let within = |span| Within {
        stream,
        end: Instant::now() + span,
    };
    let mut timed = within(2 * PATIENCE);
    while connection.is_handshaking() {
        if let Err(error) = connection.complete_io(&mut timed) {
            return Reach::from_tls(&error);
        }
    }
    // In TLS 1.3 the other end judges one's certificate after one's own handshake is over: what it thinks
    // of it can be read. One that is content waits for the engine's first words.
    let timed = within(Duration::from_millis(500));
    match StreamOwned::new(connection, timed).read(&mut [0]) {
        Err(error) if error.get_ref().is_some_and(|inner| inner.is::<Error>()) => {
            Reach::from_tls(&error)
        }
        _ => Reach::Reached,
    }
}

impl fmt::Display for Reach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reached => f.write_str(
                "reached, but nobody there speaks to us: see whether a bridge or a router of Ridgelink is at this port, and whether it says tls/ or tcp/ as well",
            ),
            Self::Unresolved(reason) => write!(f, "{reason}: see the host's name"),
            Self::Refused => f.write_str("nobody listens there: start the bridge or router there, or see the port"),
            Self::Silent => f.write_str("no answer: see the address, the network and firewalls"),
            Self::Unreachable(reason) => write!(f, "{reason}: see the network"),
            Self::NotTls => f.write_str("somebody listens there, but without TLS: give the other end its certificates"),
            Self::Distrusted(reason) => write!(
                f,
                "its certificate is not believed: {reason}: give both sites certificates of one CA, made for the host's name"
            ),
            Self::Rejected(reason) => write!(
                f,
                "our certificate is rejected there ({reason}): give both sites certificates of one CA"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::thread;

    use rustls::RootCertStore;
    use rustls::crypto::ring;

    use super::*;

    #[test]
    fn endpoints_are_read_and_written_alike() {
        for good in [
            "tcp/localhost:7447",
            "tls/10.0.0.7:1",
            "tcp/[::1]:65535",
            "udp/localhost:7447",
            "quic/localhost:7447",
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
    fn who_answers_byte_by_byte_is_not_listened_to_for_ever() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let at = listener.local_addr().expect("an address");
        let (told, reached) = mpsc::channel();
        thread::spawn(move || {
            let endpoint: Endpoint = format!("tls/{at}").parse().expect("an endpoint");
            let mut roots = RootCertStore::empty();
            let own = rcgen::generate_simple_self_signed(["localhost".to_owned()]);
            let own = own.expect("a certificate").cert;
            roots.add(own.der().clone()).expect("it is one");
            let provider = Arc::new(ring::default_provider());
            let tls = ClientConfig::builder_with_provider(provider)
                .with_safe_default_protocol_versions()
                .expect("it has them")
                .with_root_certificates(roots)
                .with_no_client_auth();
            told.send(Reach::of(&endpoint, Some(&Arc::new(tls))))
        });
        let (mut slow, _) = listener.accept().expect("it comes");
        // The head of a record, which is as long as any, and then some of it, now and then.
        slow.write_all(&[22, 3, 3, 0x40, 0]).expect("it is there");
        let found = (0..200).find_map(|_| {
            let found = reached.recv_timeout(PATIENCE / 20).ok();
            if found.is_none() {
                let _ = slow.write_all(&[2]);
            }
            found
        });
        assert_eq!(found, Some(Reach::NotTls));
    }

    #[test]
    fn a_port_in_use_is_noticed_before_the_engine_is_started() {
        let tcp = TcpListener::bind("127.0.0.1:0").expect("a port");
        let udp = UdpSocket::bind("127.0.0.1:0").expect("a port");
        for (name, taken) in [
            ("tcp", &tcp.local_addr()),
            ("udp", &udp.local_addr()),
            ("quic", &udp.local_addr()),
        ] {
            let taken = taken.as_ref().expect("an address");
            let endpoint: Endpoint = format!("{name}/{taken}").parse().expect("one");
            let error = endpoint.try_listening().expect_err("it is taken");
            assert_eq!(error.kind(), io::ErrorKind::AddrInUse);
        }
    }
}
