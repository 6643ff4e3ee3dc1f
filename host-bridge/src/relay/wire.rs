//! The keys on the network that a bridge speaks on and listens to, over the engine.

use std::sync::{Arc, Weak};

use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, Sample};
use zenoh::{Session, Wait};

use protocol::Role;

use crate::relay::datagrams::Datagrams;
use crate::relay::envelope::{Envelope, MAX_ENVELOPE};
use crate::relay::name::{Channel, Name};
use crate::relay::transport::{Connection, NetworkError, Subscription};

/// A bridge's, or an operator's, place on the network. Dropping it leaves the network.
pub struct Wire {
    session: Session,
    datagrams: Option<Arc<Datagrams>>,
    board: Publisher<'static>,
    clock: Publisher<'static>,
    stop: Publisher<'static>,
    shown: Publisher<'static>,
    _subscribers: Vec<Subscriber<()>>,
}

fn engine(error: zenoh::Error) -> NetworkError {
    NetworkError::Engine(error.to_string())
}

impl Wire {
    /// Takes the place of the bridge of `role` at the bench called `name`. Fails if the engine refuses.
    pub fn new(
        session: Session,
        datagrams: Option<Datagrams>,
        name: &Name,
        role: Role,
        subscriptions: &Arc<Vec<Subscription>>,
    ) -> Result<Self, NetworkError> {
        let datagrams = datagrams.map(Arc::new);
        let fleeting: Vec<String> = [Role::Sensor, Role::Display]
            .into_iter()
            .flat_map(|role| {
                [Channel::Board, Channel::Clock].map(|channel| name.key(role, channel))
            })
            .collect();
        let subscribe = |at: usize| {
            let subscriptions = Arc::clone(subscriptions);
            let keys = subscriptions[at].keys.clone();
            let (datagrams, fleeting) = (datagrams.as_ref().map(Arc::downgrade), fleeting.clone());
            let callback = move |sample: Sample| {
                let on_bytes = &subscriptions[at].on_bytes;
                if let Some(datagrams) = datagrams.as_ref().and_then(Weak::upgrade)
                    && fleeting.iter().any(|key| key == sample.key_expr().as_str())
                {
                    datagrams.on_stream();
                }
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
        let subscribers = (0..subscriptions.len())
            .map(subscribe)
            .collect::<Result<_, _>>()?;
        let publisher = |channel: Channel, priority| {
            session
                .declare_publisher(name.key(role, channel))
                .priority(priority)
                // Whoever speaks is never held up by a network that stands still: what has to come is said again
                // until it is answered.
                .congestion_control(CongestionControl::Drop)
                // Each message leaves at once instead of waiting for company.
                .express(true)
                .allowed_destination(Locality::Remote)
                .wait()
                .map_err(engine)
        };
        Ok(Self {
            board: publisher(Channel::Board, Priority::InteractiveHigh)?,
            clock: publisher(Channel::Clock, Priority::InteractiveHigh)?,
            stop: publisher(Channel::Stop, Priority::RealTime)?,
            // After all that the boards need.
            shown: publisher(Channel::Shown, Priority::DataLow)?,
            session,
            datagrams,
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
        let bytes = envelope.to_bytes();
        if channel.is_fleeting()
            && let Some(datagrams) = &self.datagrams
            && datagrams.send(publisher.key_expr(), &bytes)
        {
            return true;
        }
        publisher.put(bytes).wait().is_ok()
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
