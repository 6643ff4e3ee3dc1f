//! The keys on the network that a bridge speaks on and listens to, over the engine.

use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, Sample};
use zenoh::{Session, Wait};

use protocol::Role;

use crate::relay::envelope::{Envelope, MAX_ENVELOPE};
use crate::relay::name::{Channel, Name};
use crate::relay::transport::{Connection, NetworkError, Subscription};

/// A bridge's, or an operator's, place on the network. Dropping it leaves the network.
pub struct Wire {
    session: Session,
    board: Publisher<'static>,
    clock: Publisher<'static>,
    stop: Publisher<'static>,
    shown: Publisher<'static>,
    _subscribers: Vec<Subscriber<()>>,
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
        subscriptions: Vec<Subscription>,
    ) -> Result<Self, NetworkError> {
        let subscribe = |subscription: Subscription| {
            let Subscription { keys, on_bytes } = subscription;
            let callback = move |sample: Sample| {
                // What is longer than any envelope is not even put together; it counts as malformed.
                let payload = sample.payload();
                if payload.len() <= MAX_ENVELOPE {
                    on_bytes(&payload.to_bytes());
                } else {
                    on_bytes(&[]);
                }
            };
            session
                .declare_subscriber(keys)
                .allowed_origin(Locality::Remote)
                .callback(callback)
                .wait()
                .map_err(engine)
        };
        let subscribers = subscriptions
            .into_iter()
            .map(subscribe)
            .collect::<Result<_, _>>()?;
        let publisher = |channel, priority, congestion| {
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
            board: publisher(Channel::Board, stream.0, stream.1)?,
            clock: publisher(Channel::Clock, stream.0, stream.1)?,
            // It is said again until it is answered: whoever says it is never held up by a network that stands still.
            stop: publisher(Channel::Stop, Priority::RealTime, CongestionControl::Drop)?,
            // After all that the boards need.
            shown: publisher(Channel::Shown, Priority::DataLow, CongestionControl::Drop)?,
            session,
            _subscribers: subscribers,
        })
    }
}

impl Connection for Wire {
    fn publish(&self, channel: Channel, envelope: &Envelope) -> bool {
        let publisher = match channel {
            Channel::Board => &self.board,
            Channel::Clock => &self.clock,
            Channel::Stop => &self.stop,
            Channel::Shown => &self.shown,
        };
        publisher.put(envelope.to_bytes()).wait().is_ok()
    }

    /// Who connects as a client is not counted.
    fn neighbours(&self) -> usize {
        let info = self.session.info();
        info.routers_zid().wait().count() + info.peers_zid().wait().count()
    }

    fn close(&self) {
        // One who leaves has nobody to complain to.
        let _ = self.session.close().wait();
    }
}
