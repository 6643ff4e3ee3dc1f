//! The keys on the network that a bridge speaks on and listens to.

use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, Sample};
use zenoh::{Session, Wait};

use protocol::Role;

use crate::relay::envelope::{Envelope, MAX_ENVELOPE};
use crate::relay::name::{Channel, Name};
use crate::relay::network::NetworkError;

/// What happens with bytes that come; called from the engine's threads, which it holds up.
pub type Hear = Box<dyn Fn(&[u8]) + Send + Sync>;

/// Whom a program listens to.
pub struct Ear {
    /// The keys.
    pub keys: String,
    /// What happens with what they say.
    pub hear: Hear,
}

/// A bridge's, or an operator's, place on the network. Dropping it leaves the network.
pub struct Wire {
    session: Session,
    board: Publisher<'static>,
    clock: Publisher<'static>,
    stop: Publisher<'static>,
    _ears: Vec<Subscriber<()>>,
}

fn engine(error: zenoh::Error) -> NetworkError {
    NetworkError::Engine {
        reason: error.to_string(),
    }
}

impl Wire {
    /// Takes the place of the bridge of `role` at the bench called `name`.
    ///
    /// # Errors
    /// If the engine refuses.
    pub fn new(
        session: Session,
        name: &Name,
        role: Role,
        ears: Vec<Ear>,
    ) -> Result<Self, NetworkError> {
        let listen = |ear: Ear| {
            let Ear { keys, hear } = ear;
            let callback = move |sample: Sample| {
                // What is longer than any envelope is not even put together; it counts as malformed.
                let payload = sample.payload();
                if payload.len() <= MAX_ENVELOPE {
                    hear(&payload.to_bytes());
                } else {
                    hear(&[]);
                }
            };
            session
                .declare_subscriber(keys)
                .allowed_origin(Locality::Remote)
                .callback(callback)
                .wait()
                .map_err(engine)
        };
        let ears = ears.into_iter().map(listen).collect::<Result<_, _>>()?;
        let speak = |channel, priority, congestion| {
            session
                .declare_publisher(name.key(role, channel))
                .priority(priority)
                .congestion_control(congestion)
                // Each message leaves at once instead of waiting for company.
                .express(true)
                .allowed_destination(Locality::Remote)
                .wait()
                .map_err(engine)
        };
        let stream = (Priority::InteractiveHigh, CongestionControl::Drop);
        Ok(Self {
            board: speak(Channel::Board, stream.0, stream.1)?,
            clock: speak(Channel::Clock, stream.0, stream.1)?,
            stop: speak(Channel::Stop, Priority::RealTime, CongestionControl::Block)?,
            session,
            _ears: ears,
        })
    }

    /// Gives an envelope to the network. False if the network refuses it; true says nothing of whether
    /// anybody hears it.
    pub fn say(&self, channel: Channel, envelope: &Envelope) -> bool {
        let publisher = match channel {
            Channel::Board => &self.board,
            Channel::Clock => &self.clock,
            Channel::Stop => &self.stop,
        };
        publisher.put(envelope.to_bytes()).wait().is_ok()
    }

    /// How many routers and bridges one is connected to oneself; who connects as a client is not counted.
    pub fn neighbours(&self) -> usize {
        let info = self.session.info();
        info.routers_zid().wait().count() + info.peers_zid().wait().count()
    }

    /// Leaves the network, so that the others know at once.
    pub fn close(&self) {
        // One who leaves has nobody to complain to.
        let _ = self.session.close().wait();
    }
}
