//! QUIC's datagrams: both ends prove who they are, and a certificate's name decides on which keys its owner is heard.
//!
//! It goes at the rate at which it is told to: [`super::super::flow`] sees to it that a network that carries less is
//! given less. A congestion control such as TCP's takes each loss for a queue that is full; at a round trip of a second
//! and 5 % of loss it let less through than the stream.

use std::any::Any;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use quinn::congestion::{Controller, ControllerFactory};
use quinn::crypto::rustls::{QuicClientConfig, QuicServerConfig};
use quinn::{
    ClientConfig, Connection, EndpointConfig, Incoming, SendDatagramError, ServerConfig,
    TokioRuntime, TransportConfig, VarInt,
};
use rustls::pki_types::CertificateDer;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::oneshot;
use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};

use crate::lock::locked;
use crate::relay::credentials::{Loaded, common_name};
use crate::relay::datagrams::{self, PEERS, Shared};
use crate::relay::endpoint::Endpoint;
use crate::relay::name::{self, Name};
use crate::relay::refused;

/// What both ends say that they speak, before anything else.
const PROTOCOL: &[u8] = b"ridgelink";
/// A connection on which nothing comes for so long is given up, as the stream is.
const IDLE: Duration = Duration::from_secs(4);
/// How often each end says that it is there, if it has nothing else to say.
const KEEP_ALIVE: Duration = Duration::from_millis(500);
/// Between two tries to connect.
const AGAIN: Duration = Duration::from_secs(1);
/// What may be on its way, in bytes: far more than both boards say in the longest round trip.
const WINDOW: u64 = 1 << 20;
/// What may wait to be sent, in bytes; older datagrams make room for newer ones.
const WAITING: usize = 1 << 14;
/// Connections that are made at the same time at most; whoever comes then is refused.
const HANDSHAKES: usize = 64;

/// Who one is, and on which benches one listens to whom.
#[derive(Clone)]
pub struct Identity {
    connecting: Arc<rustls::ClientConfig>,
    listening: Arc<rustls::ServerConfig>,
    names: Vec<Name>,
}

impl Identity {
    /// One that takes part in the benches `names`.
    pub fn new(loaded: Loaded, names: Vec<Name>) -> Self {
        let Loaded {
            mut connecting,
            mut listening,
        } = loaded;
        connecting.alpn_protocols = vec![PROTOCOL.to_vec()];
        listening.alpn_protocols = vec![PROTOCOL.to_vec()];
        Self {
            connecting: Arc::new(connecting),
            listening: Arc::new(listening),
            names,
        }
    }
}

/// A port that is open.
pub struct Quic {
    peers: Arc<Peers>,
    /// Dropped, it ends the thread.
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Who is told.
struct Peers {
    connections: Mutex<Vec<Connection>>,
    names: Vec<Name>,
    shared: Arc<Shared>,
}

impl Quic {
    /// Listens at `endpoint`, or connects to it. Fails with the system's reason, if it has no such port.
    pub fn open(
        endpoint: &Endpoint,
        is_listening: bool,
        identity: Identity,
        shared: Arc<Shared>,
    ) -> io::Result<Self> {
        let socket = UdpSocket::bind(&endpoint.addresses_to_bind(is_listening)?[..])?;
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let peers = Arc::new(Peers {
            connections: Mutex::default(),
            names: identity.names,
            shared,
        });
        let server = is_listening
            .then(|| serving(identity.listening))
            .transpose()?;
        let client = connecting(identity.connecting)?;
        let port = {
            let _inside = runtime.enter();
            quinn::Endpoint::new(
                EndpointConfig::default(),
                server,
                socket,
                Arc::new(TokioRuntime),
            )?
        };
        let (end, ended) = oneshot::channel();
        let meeting = Arc::clone(&peers);
        let towards = endpoint.clone();
        let work = async move {
            if is_listening {
                listen(&port, &meeting).await;
            } else {
                connect(&port, client, &towards, &meeting).await;
            }
        };
        Ok(Self {
            peers,
            end: Some(end),
            thread: Some(thread::spawn(move || run(runtime, work, ended))),
        })
    }
}

/// Does `work` until it `ended`. What it has begun ends with it; a name that is being looked up is not waited for.
fn run(runtime: Runtime, work: impl Future<Output = ()>, ended: oneshot::Receiver<()>) {
    runtime.block_on(async {
        tokio::select! {
            () = work => {}
            // Whether it is said or the one who could say it is gone.
            _ = ended => {}
        }
    });
    runtime.shutdown_background();
}

impl datagrams::End for Quic {
    fn send(&self, datagram: &[u8]) -> bool {
        let is_too_long = |connection: &&Connection| {
            let sent = connection.send_datagram(datagram.to_vec().into());
            // Who is not there misses it.
            matches!(sent, Err(SendDatagramError::TooLarge))
        };
        locked(&self.peers.connections)
            .iter()
            .filter(is_too_long)
            .count()
            == 0
    }
}

impl Drop for Quic {
    fn drop(&mut self) {
        for connection in locked(&self.peers.connections).drain(..) {
            connection.close(VarInt::default(), b"");
        }
        self.end = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn transport() -> Arc<TransportConfig> {
    let mut transport = TransportConfig::default();
    let idle = VarInt::from_u32(IDLE.as_millis() as u32);
    transport
        .max_idle_timeout(Some(idle.into()))
        .keep_alive_interval(Some(KEEP_ALIVE))
        .datagram_send_buffer_size(WAITING)
        .congestion_controller_factory(Arc::new(FixedWindow))
        // The stream over TLS is for what has to come.
        .max_concurrent_bidi_streams(VarInt::default())
        .max_concurrent_uni_streams(VarInt::default());
    Arc::new(transport)
}

fn serving(tls: Arc<rustls::ServerConfig>) -> io::Result<ServerConfig> {
    let tls = QuicServerConfig::try_from(tls).map_err(io::Error::other)?;
    let mut server = ServerConfig::with_crypto(Arc::new(tls));
    server.transport_config(transport());
    Ok(server)
}

fn connecting(tls: Arc<rustls::ClientConfig>) -> io::Result<ClientConfig> {
    let tls = QuicClientConfig::try_from(tls).map_err(io::Error::other)?;
    let mut client = ClientConfig::new(Arc::new(tls));
    client.transport_config(transport());
    Ok(client)
}

async fn listen(port: &quinn::Endpoint, peers: &Arc<Peers>) {
    while let Some(incoming) = port.accept().await {
        if port.open_connections() >= HANDSHAKES {
            incoming.refuse();
        } else if incoming.remote_address_validated() {
            tokio::spawn(welcome(incoming, Arc::clone(peers)));
        } else {
            // Whoever forges his address does not get this answer. It can be given once, and was not.
            let _ = incoming.retry();
        }
    }
}

async fn welcome(incoming: Incoming, peers: Arc<Peers>) {
    if let Ok(Ok(connection)) = timeout(IDLE, incoming).await {
        peers.hear(connection).await;
    }
}

/// Connects, again and again, for whoever is there may come and go, and his address may change.
async fn connect(
    port: &quinn::Endpoint,
    client: ClientConfig,
    towards: &Endpoint,
    peers: &Arc<Peers>,
) {
    loop {
        let looking = towards.clone();
        let addresses = spawn_blocking(move || looking.resolve()).await;
        if let Ok(Ok(addresses)) = addresses
            && let Some(connection) = reach(port, &client, &addresses, &towards.host).await
        {
            peers.hear(connection).await;
        }
        sleep(AGAIN).await;
    }
}

/// Connects to the first of the addresses of `host` that answers.
async fn reach(
    port: &quinn::Endpoint,
    client: &ClientConfig,
    addresses: &[SocketAddr],
    host: &str,
) -> Option<Connection> {
    for &address in addresses {
        if let Ok(connecting) = port.connect_with(client.clone(), address, host)
            && let Ok(Ok(connection)) = timeout(2 * IDLE, connecting).await
        {
            return Some(connection);
        }
    }
    None
}

impl Peers {
    /// Hears what comes on a connection, until it ends or the certificate of its other end does.
    async fn hear(&self, connection: Connection) {
        let Some((common_name, valid)) = identify(&connection) else {
            return;
        };
        let keys = name::keys_of_datagrams(&self.names, &common_name);
        if keys.is_empty() {
            refused::note(&common_name, None);
            return;
        }
        {
            let mut connections = locked(&self.connections);
            if connections.len() >= PEERS {
                return;
            }
            connections.push(connection.clone());
        }
        let hear = async {
            while let Ok(datagram) = connection.read_datagram().await {
                let Some((key, envelope)) = datagrams::parts(&datagram) else {
                    continue;
                };
                if keys.iter().any(|own| own == key) {
                    self.shared.hear(key, envelope);
                } else {
                    refused::note(&common_name, Some(key));
                }
            }
        };
        if timeout(valid, hear).await.is_err() {
            connection.close(VarInt::default(), b"the certificate has expired");
        }
        locked(&self.connections).retain(|other| other.stable_id() != connection.stable_id());
    }
}

/// The common name in the certificate of the other end, and how long that is valid still. None if it has not exactly one.
fn identify(connection: &Connection) -> Option<(String, Duration)> {
    let identity = connection.peer_identity()?;
    let chain = identity.downcast::<Vec<CertificateDer<'_>>>().ok()?;
    let (_, certificate) = x509_parser::parse_x509_certificate(chain.first()?).ok()?;
    let end_s = u64::try_from(certificate.validity().not_after.timestamp()).ok()?;
    let end = UNIX_EPOCH + Duration::from_secs(end_s);
    let valid = end.duration_since(SystemTime::now()).ok()?;
    Some((common_name(&certificate)?, valid))
}

/// A congestion window that no loss narrows.
#[derive(Clone)]
struct FixedWindow;

impl ControllerFactory for FixedWindow {
    fn build(self: Arc<Self>, _: Instant, _: u16) -> Box<dyn Controller> {
        Box::new(Self)
    }
}

impl Controller for FixedWindow {
    fn on_congestion_event(&mut self, _: Instant, _: Instant, _: bool, _: u64) {}

    fn on_mtu_update(&mut self, _: u16) {}

    fn window(&self) -> u64 {
        WINDOW
    }

    fn clone_box(&self) -> Box<dyn Controller> {
        Box::new(self.clone())
    }

    fn initial_window(&self) -> u64 {
        WINDOW
    }

    fn into_any(self: Box<Self>) -> Box<dyn Any> {
        self
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::PathBuf;
    use std::sync::atomic::AtomicU64;
    use std::sync::mpsc::{Receiver, channel};

    use rcgen::{
        BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose,
        IsCa, Issuer, KeyPair, date_time_ymd,
    };

    use super::*;
    use crate::relay::credentials::Credentials;
    use crate::relay::datagrams::End;
    use crate::relay::refused::Refused;

    const KEY: &str = "ridgelink/bench/display/board";
    /// Only what hangs takes so long.
    const LIMIT: Duration = Duration::from_secs(120);
    /// When what was said is said again, unless it is heard.
    const UNHEARD: Duration = Duration::from_millis(5);
    const YEAR: Duration = Duration::from_secs(365 * 86_400);

    struct Authority {
        folder: PathBuf,
        issuer: Issuer<'static, KeyPair>,
    }

    impl Authority {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("quic-{}-{name}", std::process::id()));
            fs::create_dir_all(&folder).expect("a folder");
            let key = KeyPair::generate().expect("a key");
            let mut params = CertificateParams::default();
            params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
            let root = params.self_signed(&key).expect("it can be signed");
            fs::write(folder.join("ca.pem"), root.pem()).expect("it can be written");
            Self {
                folder,
                issuer: Issuer::new(params, key),
            }
        }

        /// Somebody's whose certificate of that common name is valid for so long still.
        fn identity(&self, common_name: &str, valid: Duration) -> Identity {
            let mut params = CertificateParams::new(["localhost".to_owned()]).expect("a name");
            params.distinguished_name = DistinguishedName::new();
            params
                .distinguished_name
                .push(DnType::CommonName, common_name);
            params.extended_key_usages = vec![
                ExtendedKeyUsagePurpose::ServerAuth,
                ExtendedKeyUsagePurpose::ClientAuth,
            ];
            let now = SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .expect("a date");
            params.not_after = date_time_ymd(1970, 1, 1) + now + valid;
            let key = KeyPair::generate().expect("a key");
            let certificate = params.signed_by(&key, &self.issuer).expect("it is signed");
            let write = |file: &str, pem: String| {
                let path = self.folder.join(file);
                fs::write(&path, pem).expect("it can be written");
                path
            };
            let credentials = Credentials {
                ca: self.folder.join("ca.pem"),
                certificate: write("own.pem", certificate.pem()),
                key: write("own.key", key.serialize_pem()),
            };
            let names = vec!["bench".parse().expect("a name")];
            Identity::new(credentials.load().expect("they fit"), names)
        }
    }

    impl Drop for Authority {
        fn drop(&mut self) {
            // Left there, it is in nobody's way.
            let _ = fs::remove_dir_all(&self.folder);
        }
    }

    fn open(at: &Endpoint, is_listening: bool, identity: Identity) -> (Quic, Receiver<String>) {
        let (heard, told) = channel();
        let shared = Shared {
            heard_us: AtomicU64::new(0),
            on_datagram: Box::new(move |key, _| {
                // Whoever asked may have gone.
                let _ = heard.send(key.to_owned());
            }),
        };
        let end = Quic::open(at, is_listening, identity, Arc::new(shared));
        (end.expect("a port"), told)
    }

    fn free_port() -> Endpoint {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("the system has ports");
        let port = socket.local_addr().expect("an address").port();
        let endpoint = format!("quic/localhost:{port}");
        endpoint.parse().expect("an endpoint")
    }

    /// All of them say what the display says, again whenever it is heard or was not for a while, until it is `enough`,
    /// asked with what was heard.
    fn speak_until(
        speakers: &[&Quic],
        told: &Receiver<String>,
        mut enough: impl FnMut(Option<&str>) -> bool,
    ) {
        let datagram = [KEY.as_bytes(), &[0, 1, 2, 3]].concat();
        let began = Instant::now();
        let mut heard = None;
        while !enough(heard.as_deref()) {
            assert!(began.elapsed() < LIMIT, "not enough after {LIMIT:?}");
            for speaker in speakers {
                speaker.send(&datagram);
            }
            heard = told.recv_timeout(UNHEARD).ok();
        }
    }

    #[test]
    fn a_connection_ends_with_the_certificate_of_its_other_end() {
        let ours = Authority::new("expiry");
        let at = free_port();
        let (listener, told) = open(&at, true, ours.identity("bench.sensor", YEAR));
        let short = ours.identity("bench.display", Duration::from_secs(4));
        let (display, _) = open(&at, false, short);
        let peers = || locked(&listener.peers.connections).len();
        speak_until(&[&display], &told, |heard| heard == Some(KEY));
        speak_until(&[&display], &told, |_| peers() == 0);
        // Another one gets in where it does not any more.
        while told.try_recv().is_ok() {}
        let (good, _) = open(&at, false, ours.identity("bench.display", YEAR));
        speak_until(&[&good], &told, |heard| heard == Some(KEY));
    }

    #[test]
    fn each_address_of_a_host_is_tried_until_one_answers() {
        let ours = Authority::new("addresses");
        let at = Endpoint {
            host: "127.0.0.1".to_owned(),
            ..free_port()
        };
        let (_listener, _told) = open(&at, true, ours.identity("bench.sensor", YEAR));
        let identity = ours.identity("bench.display", YEAR);
        let client = connecting(identity.connecting).expect("a configuration");
        let runtime = Builder::new_current_thread().enable_all().build();
        let connection = runtime.expect("a runtime").block_on(async {
            let any = "127.0.0.1:0".parse().expect("an address");
            let port = quinn::Endpoint::client(any).expect("a port");
            // Nobody gets to the first one from there.
            let mut addresses = vec!["[::1]:7".parse().expect("an address")];
            addresses.extend(at.resolve().expect("an address"));
            reach(&port, &client, &addresses, "localhost").await
        });
        assert!(connection.is_some());
    }

    #[test]
    fn who_is_of_another_authority_or_bench_is_not_heard_and_neither_is_another_boards_key() {
        let (ours, theirs) = (Authority::new("ours"), Authority::new("theirs"));
        let at = free_port();
        let (_listener, told) = open(&at, true, ours.identity("bench.sensor", YEAR));
        let strangers = [
            theirs.identity("bench.display", YEAR),
            ours.identity("other.display", YEAR),
            ours.identity("bench.router", YEAR),
            // Let in, and not heard on the display's key.
            ours.identity("bench.sensor", YEAR),
        ]
        .map(|identity| open(&at, false, identity).0);
        let mut refused = Vec::new();
        let mut is_named = |name: &str, on: Option<&str>| {
            refused.extend(refused::take());
            refused.iter().any(|one| {
                matches!(one, Refused::Named { peer, key } if peer == name && key.as_deref() == on)
            })
        };
        speak_until(&strangers.each_ref(), &told, |heard| {
            assert_eq!(heard, None, "a stranger is heard");
            is_named("other.display", None)
                && is_named("bench.router", None)
                && is_named("bench.sensor", Some(KEY))
        });
        let (display, _) = open(&at, false, ours.identity("bench.display", YEAR));
        speak_until(&[&display], &told, |heard| heard == Some(KEY));
    }
}
