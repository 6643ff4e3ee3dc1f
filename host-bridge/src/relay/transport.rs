//! What a bridge wants of a network: the engine's, or one of a test's own.

use protocol::Role;

use crate::relay::endpoint::Endpoint;
use crate::relay::envelope::Envelope;
use crate::relay::name::{Channel, Name};
use crate::relay::network::NetworkError;
use crate::relay::reach::Reach;

/// What happens with bytes that come; called from the network's threads, which it holds up.
pub type OnBytes = Box<dyn Fn(&[u8]) + Send + Sync>;

/// Whom a program listens to.
pub struct Subscription {
    /// The keys: one of [`Name::key`], or [`Name::keys`].
    pub keys: String,
    /// What happens with what is published there.
    pub on_bytes: OnBytes,
}

/// A way to the other site.
pub trait Transport: Send + Sync {
    /// Takes part as the bridge of `role` at the bench called `name`. Where it connects, this returns when
    /// somebody has answered or all have been tried in vain: to be tried again then. Afterwards the
    /// connection is kept up.
    ///
    /// # Errors
    /// If nobody is reached, or one can't listen.
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
