//! Why nobody is reached: what the network's engine keeps to itself, found out by trying.

use std::fmt;
use std::io::{self, Read};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use rustls::pki_types::ServerName;
use rustls::{CertificateError, ClientConfig, ClientConnection, Error, StreamOwned};

use crate::relay::endpoint::Endpoint;

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
                    return tls.map_or(Self::Reached, |tls| shake_hands(endpoint, stream, tls));
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

fn shake_hands(endpoint: &Endpoint, mut stream: TcpStream, tls: &Arc<ClientConfig>) -> Reach {
    let Ok(name) = ServerName::try_from(endpoint.host.clone()) else {
        return Reach::Unresolved("no name that a certificate could have".to_owned());
    };
    let timed = stream
        .set_read_timeout(Some(PATIENCE))
        .and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
    let connection = ClientConnection::new(Arc::clone(tls), name);
    let (Ok(()), Ok(mut connection)) = (timed, connection) else {
        return Reach::NotTls;
    };
    while connection.is_handshaking() {
        if let Err(error) = connection.complete_io(&mut stream) {
            return Reach::from_tls(&error);
        }
    }
    // In TLS 1.3 the other end judges one's certificate after one's own handshake is over: what it thinks
    // of it can be read. One that is content waits for the engine's first words.
    let _ = stream.set_read_timeout(Some(Duration::from_millis(500)));
    match StreamOwned::new(connection, stream).read(&mut [0]) {
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
