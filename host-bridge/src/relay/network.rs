//! The network's engine, set up for two bridges, and the keys that a bridge speaks on and listens to: nothing is looked
//! for, lost connections come back soon, little waits to be sent.

use std::sync::{Arc, Weak};
use std::time::Duration;

use protocol::Role;
use rustls::ClientConfig;
use serde_json::json;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, Sample};
use zenoh::{Session, Wait};

use crate::engine::Setup;
use crate::relay::credentials::Credentials;
use crate::relay::datagrams::Datagrams;
use crate::relay::endpoint::{Carrier, Endpoint, Reach};
use crate::relay::envelope::{Envelope, MAX_ENVELOPE};
use crate::relay::name::{Channel, Name};
pub use crate::relay::transport::NetworkError;
use crate::relay::transport::{Connection, Subscription, Transport};
use crate::relay::{name, refused};

/// First wait before a lost connection is tried again.
const RETRY_FIRST: Duration = Duration::from_millis(100);
/// Longest wait between two tries: a router that is back is found well within a second.
const RETRY_LONGEST: Duration = Duration::from_millis(300);
/// After this long without a word a connection is given up. What a lossy network holds up for a while
/// comes well before; a computer whose address changed, or one that was switched off, does not.
pub const LEASE: Duration = Duration::from_secs(4);
/// What may be sent at once, in bytes: far more than any of ours.
const BATCH_BYTES: u16 = 4_096;
/// Longest message that is taken from the network, in bytes: far more than any of ours.
const MAX_MESSAGE_BYTES: u32 = 65_536;

/// How a program takes part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Others connect to it.
    Listening(Vec<Endpoint>),
    /// It connects to the first of these that answers, and to another one when it is lost.
    Connecting(Vec<Endpoint>),
}

/// What a program needs to take part.
#[derive(Clone)]
pub struct Network {
    ends: Ends,
    credentials: Option<Credentials>,
    tls: Option<Arc<ClientConfig>>,
    /// The benches that it takes part in, as far as certificates decide it.
    names: Vec<Name>,
}

impl Transport for Network {
    fn connect(
        &self,
        name: &Name,
        role: Role,
        subscriptions: Vec<Subscription>,
    ) -> Result<Box<dyn Connection>, NetworkError> {
        let (Ends::Listening(endpoints) | Ends::Connecting(endpoints)) = &self.ends;
        let by_datagrams: Vec<&Endpoint> = endpoints
            .iter()
            .filter(|endpoint| endpoint.carrier == Carrier::Udp)
            .collect();
        let is_listening = matches!(self.ends, Ends::Listening(_));
        let subscriptions = Arc::new(subscriptions);
        let heard = Arc::clone(&subscriptions);
        let on_datagram = move |key: &str, bytes: &[u8]| {
            for subscription in heard.iter() {
                if subscription.hears(key) {
                    (subscription.on_bytes)(bytes);
                }
            }
        };
        let session = self.open()?;
        let datagrams = Datagrams::open(&by_datagrams, is_listening, Box::new(on_datagram))
            .map_err(|error| NetworkError::Engine(format!("datagrams: {error}")))?;
        let wire = Wire::new(session, datagrams, name, role, &subscriptions)?;
        Ok(Box::new(wire))
    }

    fn endpoints(&self) -> &[Endpoint] {
        match &self.ends {
            Ends::Listening(_) => &[],
            Ends::Connecting(endpoints) => endpoints,
        }
    }

    fn reach(&self, endpoint: &Endpoint) -> Reach {
        Reach::of(endpoint, self.tls.as_ref())
    }
}

impl Network {
    /// Looks at everything that can be looked at before anybody is talked to. With credentials, certificates decide
    /// who may speak for which board of the benches `names`: see [`access`]. Without, nobody listens beyond this
    /// computer unless it `is_insecure` on purpose. Fails if endpoints and credentials don't fit, credentials can't
    /// be used, or one can't listen.
    pub fn new(
        ends: Ends,
        credentials: Option<Credentials>,
        names: Vec<Name>,
        is_insecure: bool,
    ) -> Result<Self, NetworkError> {
        let (Ends::Listening(endpoints) | Ends::Connecting(endpoints)) = &ends;
        for endpoint in endpoints {
            let endpoint = endpoint.clone();
            match (endpoint.carrier == Carrier::Tls, &credentials) {
                (true, None) => {
                    return Err(NetworkError::WithoutCertificates(endpoint));
                }
                (false, Some(_)) => return Err(NetworkError::Open(endpoint)),
                (false, None)
                    if matches!(ends, Ends::Listening(_))
                        && !endpoint.is_loopback()
                        && !is_insecure =>
                {
                    return Err(NetworkError::Insecure(endpoint));
                }
                (true, Some(_))
                    if endpoint.host.starts_with('[') && matches!(ends, Ends::Connecting(_)) =>
                {
                    return Err(NetworkError::Unmatched(endpoint));
                }
                _ => {}
            }
        }
        let tls = match &credentials {
            Some(credentials) => Some(Arc::new(credentials.load()?)),
            None => None,
        };
        if let Ends::Listening(endpoints) = &ends {
            for endpoint in endpoints {
                endpoint
                    .try_listening()
                    .map_err(|reason| NetworkError::Listening(endpoint.clone(), reason))?;
            }
        }
        Ok(Self {
            ends,
            credentials,
            tls,
            names,
        })
    }

    fn open(&self) -> Result<Session, NetworkError> {
        let mode = match self.ends {
            // What connects is a client: a router carries on what clients say, but takes peers for
            // neighbours who hear each other.
            Ends::Connecting(_) => "client",
            Ends::Listening(_) => "peer",
        };
        self.take_part(mode)
    }

    /// Takes part as a router: carries on what bridges say. Fails if one can't listen.
    pub fn open_router(&self) -> Result<Session, NetworkError> {
        self.take_part("router")
    }

    fn take_part(&self, mode: &str) -> Result<Session, NetworkError> {
        let locators = |endpoints: &[Endpoint]| -> Vec<String> {
            endpoints.iter().map(Endpoint::locator).collect()
        };
        let (listen, connect) = match &self.ends {
            Ends::Listening(endpoints) => (locators(endpoints), Vec::new()),
            Ends::Connecting(endpoints) => (Vec::new(), locators(endpoints)),
        };
        let mut more = vec![
            (
                "connect/retry",
                json!({
                    "period_init_ms": RETRY_FIRST.as_millis(),
                    "period_max_ms": RETRY_LONGEST.as_millis(),
                    "period_increase_factor": 1.5,
                }),
            ),
            ("transport/link/tx/lease", json!(LEASE.as_millis())),
            ("transport/link/tx/batch_size", json!(BATCH_BYTES)),
            (
                "transport/link/rx/max_message_size",
                json!(MAX_MESSAGE_BYTES),
            ),
        ];
        if let Some(credentials) = &self.credentials {
            refused::watch();
            more.extend([
                (
                    "transport/link/tls/root_ca_certificate",
                    json!(credentials.ca),
                ),
                (
                    "transport/link/tls/listen_certificate",
                    json!(credentials.certificate),
                ),
                (
                    "transport/link/tls/listen_private_key",
                    json!(credentials.key),
                ),
                (
                    "transport/link/tls/connect_certificate",
                    json!(credentials.certificate),
                ),
                (
                    "transport/link/tls/connect_private_key",
                    json!(credentials.key),
                ),
                (
                    "access_control",
                    name::rules(&self.names, matches!(self.ends, Ends::Connecting(_))),
                ),
                ("transport/link/tls/enable_mtls", json!(true)),
                // Never without: the engine also believes the CAs of the web, so that any of their
                // customers could listen in place of the other site. That one would still have to be called
                // as the rules want it.
                ("transport/link/tls/verify_name_on_connect", json!(true)),
                ("transport/link/tls/close_link_on_expiration", json!(true)),
            ]);
        }
        let setup = Setup {
            mode,
            listen,
            connect,
            more,
        };
        setup
            .open()
            .map_err(|error| NetworkError::Engine(error.to_string()))
    }
}

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
