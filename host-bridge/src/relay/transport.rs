//! What a bridge wants of a network: the engine's, or one of a test's own.

use std::io;

use protocol::Role;

use crate::relay::credentials::CredentialsError;
use crate::relay::endpoint::Endpoint;
use crate::relay::endpoint::Reach;
use crate::relay::envelope::Envelope;
use crate::relay::name::{Channel, Name};

/// Why a program can't take part.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum NetworkError {
    #[error(transparent)]
    Credentials(#[from] CredentialsError),
    #[error("{0} wants certificates on both ends: give --ca, --certificate and --key")]
    WithoutCertificates(Endpoint),
    #[error("{0} would leave certificates unused and let anybody in: say {safe}/{host}:{port}, or leave out --ca, --certificate and --key", safe = .0.carrier.with_certificates().name(), host = .0.host, port = .0.port)]
    Open(Endpoint),
    #[error(
        "{0} would let anybody who reaches it move the arm: say {safe}/{host}:{port} with --ca, --certificate and --key; or --insecure, where the network itself lets nobody in", safe = .0.carrier.with_certificates().name(), host = .0.host, port = .0.port
    )]
    Insecure(Endpoint),
    #[error("{0}: an IPv6 address can't be matched with a certificate: give the host's name")]
    Unmatched(Endpoint),
    #[error("{0}: can't listen: {1}: {advice}", advice = advice(.1))]
    Listening(Endpoint, io::Error),
    #[error("the network's engine refuses: {0}")]
    Engine(String),
}

fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::AddrInUse => "another program listens there: end it, or take another port",
        io::ErrorKind::AddrNotAvailable => {
            "this computer has no such address: take one of its own, or 0.0.0.0 for all of them"
        }
        io::ErrorKind::PermissionDenied => "take a port above 1023",
        _ => "see the host's name and the port",
    }
}

/// What happens with bytes that come; called from the network's threads, which it holds up.
pub type OnBytes = Box<dyn Fn(&[u8]) + Send + Sync>;

/// Whom a program listens to.
pub struct Subscription {
    /// The keys: one of [`Name::key`], or [`Name::keys`].
    pub keys: String,
    /// What happens with what is published there.
    pub on_bytes: OnBytes,
}

impl Subscription {
    /// Whether it is for what is said on `key`.
    pub fn hears(&self, key: &str) -> bool {
        match self.keys.strip_suffix('*') {
            Some(start) => key.starts_with(start),
            None => self.keys == key,
        }
    }
}

/// A way to the other site.
pub trait Transport: Send + Sync {
    /// Takes part as the bridge of `role` at the bench called `name`. Where it connects, this returns when somebody
    /// has answered or all have been tried in vain: to be tried again then. Afterwards the connection is kept up.
    /// Fails if nobody is reached, or one can't listen.
    fn connect(
        &self,
        name: &Name,
        role: Role,
        subscriptions: Vec<Subscription>,
    ) -> Result<Box<dyn Connection>, NetworkError>;

    /// Where it connects; empty if it listens.
    fn endpoints(&self) -> &[Endpoint];

    /// How far one gets with an endpoint; takes some seconds at most.
    fn reach(&self, endpoint: &Endpoint) -> Reach;
}

/// A place on the network. Dropping it leaves the network.
pub trait Connection: Send + Sync {
    /// Gives an envelope to the network. False if the network refuses it; true says nothing of whether
    /// anybody hears it.
    fn publish(&self, channel: Channel, envelope: &Envelope) -> bool;

    /// How many routers and bridges one is connected to oneself.
    fn neighbours(&self) -> usize;

    /// Leaves the network, so that the others know at once.
    fn close(&self);
}
