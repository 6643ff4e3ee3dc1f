//! The network's engine, set up for two bridges, and the keys that a bridge speaks on and listens to: nothing is looked
//! for, lost connections come back soon, little waits to be sent.

use std::io;
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
use crate::relay::datagrams::{Datagrams, Identity};
use crate::relay::endpoint::{Endpoint, Reach};
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
    /// Others connect to it, at any address of these names.
    Listening(Vec<Endpoint>),
    /// It connects to the first of these that answers, and to another one when it is lost.
    Connecting(Vec<Endpoint>),
}

impl Ends {
    fn endpoints(&self) -> &[Endpoint] {
        let (Self::Listening(endpoints) | Self::Connecting(endpoints)) = self;
        endpoints
    }

    const fn is_listening(&self) -> bool {
        matches!(self, Self::Listening(_))
    }
}

/// What a program needs to take part.
#[derive(Clone)]
pub struct Network {
    ends: Ends,
    credentials: Option<Credentials>,
    tls: Option<Arc<ClientConfig>>,
    /// The same for datagrams.
    identity: Option<Identity>,
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
        let is_listening = self.ends.is_listening();
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
        let identity = self.identity.as_ref();
        let datagrams = Datagrams::open(
            self.ends.endpoints(),
            is_listening,
            identity,
            Box::new(on_datagram),
        )
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
    /// who may speak for which board of the benches `names`: see [`name::rules`]. Without, nobody listens beyond this
    /// computer unless it `is_insecure` on purpose. Fails if endpoints and credentials don't fit, credentials can't
    /// be used, or one can't listen.
    pub fn new(
        ends: Ends,
        credentials: Option<Credentials>,
        names: Vec<Name>,
        is_insecure: bool,
    ) -> Result<Self, NetworkError> {
        let is_listening = ends.is_listening();
        for endpoint in ends.endpoints() {
            let is_open = is_listening && endpoint.is_open() && !is_insecure;
            let is_numbered = !is_listening && endpoint.host.starts_with('[');
            let refusal = match (endpoint.carrier.has_certificates(), &credentials) {
                (true, None) => NetworkError::WithoutCertificates,
                (false, Some(_)) => NetworkError::Open,
                (false, None) if is_open => NetworkError::Insecure,
                (true, Some(_)) if is_numbered => NetworkError::Unmatched,
                _ => continue,
            };
            return Err(refusal(endpoint.clone()));
        }
        let loaded = credentials.as_ref().map(Credentials::load).transpose()?;
        let ends = match ends {
            Ends::Listening(endpoints) => Ends::Listening(listened_at(&endpoints, is_insecure)?),
            connecting @ Ends::Connecting(_) => connecting,
        };
        Ok(Self {
            ends,
            credentials,
            tls: loaded
                .as_ref()
                .map(|loaded| Arc::new(loaded.connecting.clone())),
            identity: loaded.map(|loaded| Identity::new(loaded, names.clone())),
            names,
        })
    }

    /// How it takes part: who listens does so at each address of his names that this computer has.
    pub const fn ends(&self) -> &Ends {
        &self.ends
    }

    fn open(&self) -> Result<Session, NetworkError> {
        // What connects is a client: a router carries on what clients say, but takes peers for neighbours who hear
        // each other.
        self.take_part(if self.ends.is_listening() {
            "peer"
        } else {
            "client"
        })
    }

    /// Takes part as a router: carries on what bridges say. Fails if one can't listen.
    pub fn open_router(&self) -> Result<Session, NetworkError> {
        self.take_part("router")
    }

    fn take_part(&self, mode: &str) -> Result<Session, NetworkError> {
        let locators = self
            .ends
            .endpoints()
            .iter()
            .map(Endpoint::locator)
            .collect();
        let (listen, connect) = if self.ends.is_listening() {
            (locators, Vec::new())
        } else {
            (Vec::new(), locators)
        };
        let retry = json!({
            "period_init_ms": RETRY_FIRST.as_millis(),
            "period_max_ms": RETRY_LONGEST.as_millis(),
            "period_increase_factor": 1.5,
        });
        let more = [
            ("connect/retry", retry),
            ("transport/link/tx/lease", json!(LEASE.as_millis())),
            ("transport/link/tx/batch_size", json!(BATCH_BYTES)),
            (
                "transport/link/rx/max_message_size",
                json!(MAX_MESSAGE_BYTES),
            ),
        ];
        let mut more = more.map(|(key, value)| (key.to_owned(), value)).to_vec();
        if let Some(credentials) = &self.credentials {
            refused::watch();
            let rules = name::rules(&self.names, !self.ends.is_listening());
            more.push(("access_control".to_owned(), rules));
            let tls = [
                ("root_ca_certificate", json!(credentials.ca)),
                ("listen_certificate", json!(credentials.certificate)),
                ("listen_private_key", json!(credentials.key)),
                ("connect_certificate", json!(credentials.certificate)),
                ("connect_private_key", json!(credentials.key)),
                ("enable_mtls", json!(true)),
                // Never without: the engine also believes the CAs of the web, so that any of their customers could
                // listen in place of the other site. That one would still have to be called as the rules want it.
                ("verify_name_on_connect", json!(true)),
                ("close_link_on_expiration", json!(true)),
            ];
            more.extend(tls.map(|(key, value)| (format!("transport/link/tls/{key}"), value)));
        }
        let setup = Setup {
            mode,
            listen,
            connect,
            more,
        };
        setup.open().map_err(engine)
    }
}

/// A bridge's, or an operator's, place on the network. Dropping it leaves the network.
pub struct Wire {
    session: Session,
    datagrams: Option<Arc<Datagrams>>,
    /// In the order of [`Channel::ALL`].
    publishers: [Publisher<'static>; 4],
    _subscribers: Vec<Subscriber<()>>,
}

/// Each address of these names at which one can listen here: whoever connects may try any of them. Fails if a name has
/// none, if another program listens at one of them, or one is beyond this computer and that is not meant.
fn listened_at(names: &[Endpoint], is_insecure: bool) -> Result<Vec<Endpoint>, NetworkError> {
    let mut all = Vec::new();
    for name in names {
        let addresses = name
            .each_address()
            .map_err(|reason| NetworkError::Listening(name.clone(), reason))?;
        all.extend(usable(addresses, is_insecure)?);
    }
    Ok(all)
}

/// Those of one name's addresses at which one can listen here.
fn usable(addresses: Vec<Endpoint>, is_insecure: bool) -> Result<Vec<Endpoint>, NetworkError> {
    let mut usable = Vec::new();
    let mut refused = None;
    for at in addresses {
        if usable.contains(&at) {
            continue;
        }
        if at.is_open() && !is_insecure {
            return Err(NetworkError::Insecure(at));
        }
        match at.try_listening() {
            Ok(()) => usable.push(at),
            // Whoever tries this one would find another.
            Err(reason) if reason.kind() == io::ErrorKind::AddrInUse => {
                return Err(NetworkError::Listening(at, reason));
            }
            // Another computer's of that name, most likely.
            Err(reason) => refused = Some(NetworkError::Listening(at, reason)),
        }
    }
    match refused {
        Some(refusal) if usable.is_empty() => Err(refusal),
        _ => Ok(usable),
    }
}

fn engine(error: zenoh::Error) -> NetworkError {
    let words = error.to_string();
    // After them it says where in its own source it was.
    let words = words.split(" at /").next().unwrap_or(&words);
    NetworkError::Engine(words.trim().to_owned())
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
        let fleeting = [Role::Sensor, Role::Display]
            .map(|role| [Channel::Board, Channel::Clock].map(|channel| name.key(role, channel)))
            .concat();
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
        let publisher = |channel: Channel| {
            let priority = match channel {
                Channel::Board | Channel::Clock => Priority::InteractiveHigh,
                Channel::Stop => Priority::RealTime,
                // After all that the boards need.
                Channel::Shown => Priority::DataLow,
            };
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
        let [board, clock, stop, shown] = Channel::ALL.map(publisher);
        Ok(Self {
            publishers: [board?, clock?, stop?, shown?],
            session,
            datagrams,
            _subscribers: subscribers,
        })
    }
}

impl Connection for Wire {
    fn publish(&self, channel: Channel, envelope: &Envelope) -> bool {
        let publisher = &self.publishers[channel as usize];
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

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    /// One end at each of these hosts, at a port that is free.
    fn at(carrier: &str, hosts: &[&str]) -> Vec<Endpoint> {
        let port = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
        let port = port.expect("a port is free").port();
        let of = |host: &&str| format!("{carrier}/{host}:{port}").parse();
        hosts.iter().map(|host| of(host).expect("one")).collect()
    }

    #[test]
    fn one_listens_at_each_address_of_a_name_that_this_computer_has() {
        for carrier in ["tcp", "udp", "tls", "quic"] {
            // The second one is nobody's (RFC 5737).
            let all = at(
                carrier,
                &["127.0.0.1", "192.0.2.1", "127.0.0.2", "127.0.0.1"],
            );
            let found = usable(all.clone(), true).expect("there are some");
            assert_eq!(found, [all[0].clone(), all[2].clone()]);
            let none = usable(all[1..2].to_vec(), true).expect_err("it is another's");
            assert!(none.to_string().contains("can't listen"), "{none}");
            // Whoever tries the one that is taken would find somebody else.
            let taken = TcpListener::bind(("127.0.0.2", all[2].port)).expect("it is free");
            let refused = usable(all.clone(), true).expect_err("one is taken");
            assert!(
                refused.to_string().starts_with(&all[2].to_string()),
                "{refused}"
            );
            drop(taken);
        }
    }

    #[test]
    fn no_address_of_a_name_is_open_beyond_this_computer_unless_that_is_meant() {
        let all = at("tcp", &["127.0.0.1", "0.0.0.0"]);
        let refused = usable(all.clone(), false).expect_err("the second one is open");
        assert!(
            matches!(&refused, NetworkError::Insecure(at) if *at == all[1]),
            "{refused}"
        );
        let safe = at("tls", &["127.0.0.1", "127.0.0.2"]);
        assert_eq!(usable(safe.clone(), false).expect("nobody is let in"), safe);
    }
}
