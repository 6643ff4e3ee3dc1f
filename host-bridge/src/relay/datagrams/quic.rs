//! QUIC's datagrams: both ends prove who they are, and a certificate's name decides on which keys its owner is heard.
//!
//! It goes at the rate at which it is told to: [`super::super::flow`] sees to it that a network that carries less is
//! given less. A congestion control such as TCP's takes each loss for a queue that is full; at a round trip of a second
//! and 5 % of loss it let less through than the stream.

use std::any::Any;
use std::io;
use std::net::UdpSocket;
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
    pub fn new(
        mut connecting: rustls::ClientConfig,
        mut listening: rustls::ServerConfig,
        names: Vec<Name>,
    ) -> Self {
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
            thread: Some(thread::spawn(move || run(&runtime, work, ended))),
        })
    }
}

/// Does `work` until it `ended`. What it has begun ends with the runtime.
fn run(runtime: &Runtime, work: impl Future<Output = ()>, ended: oneshot::Receiver<()>) {
    runtime.block_on(async {
        tokio::select! {
            () = work => {}
            // Whether it is said or the one who could say it is gone.
            _ = ended => {}
        }
    });
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
        .congestion_controller_factory(Arc::new(Steady))
        // There is the other stream for that.
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
            // Whoever is where he says gets in at the second try; only one that was tried is not tried again.
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
            && let Some(&address) = addresses.first()
            && let Ok(connecting) = port.connect_with(client.clone(), address, &towards.host)
            && let Ok(Ok(connection)) = timeout(2 * IDLE, connecting).await
        {
            peers.hear(connection).await;
        }
        sleep(AGAIN).await;
    }
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
    let mut names = certificate.subject().iter_common_name();
    let (Some(common_name), None) = (names.next(), names.next()) else {
        return None;
    };
    let end_s = u64::try_from(certificate.validity().not_after.timestamp()).ok()?;
    let end = UNIX_EPOCH + Duration::from_secs(end_s);
    let valid = end.duration_since(SystemTime::now()).ok()?;
    Some((common_name.as_str().ok()?.to_owned(), valid))
}

/// Lets everything go that is to go.
#[derive(Clone)]
struct Steady;

impl ControllerFactory for Steady {
    fn build(self: Arc<Self>, _: Instant, _: u16) -> Box<dyn Controller> {
        Box::new(Self)
    }
}

impl Controller for Steady {
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
    use std::sync::atomic::AtomicU64;
    use std::sync::mpsc::{Receiver, channel};

    use rcgen::{
        BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose,
        IsCa, Issuer, KeyPair, date_time_ymd,
    };
    use rustls::RootCertStore;
    use rustls::crypto::ring;
    use rustls::pki_types::PrivateKeyDer;
    use rustls::server::WebPkiClientVerifier;
    use rustls::version::TLS13;

    use super::*;
    use crate::relay::datagrams::End;

    const KEY: &str = "ridgelink/bench/display/board";
    /// Only what hangs takes so long.
    const LIMIT: Duration = Duration::from_secs(120);
    const YEAR: Duration = Duration::from_secs(365 * 86_400);

    struct Authority {
        root: CertificateDer<'static>,
        issuer: Issuer<'static, KeyPair>,
    }

    impl Authority {
        fn new() -> Self {
            let key = KeyPair::generate().expect("a key");
            let mut params = CertificateParams::default();
            params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
            let root = params.self_signed(&key).expect("it can be signed");
            Self {
                root: root.der().clone(),
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
            let chain = vec![certificate.der().clone()];
            let key = || PrivateKeyDer::Pkcs8(key.serialize_der().into());
            let mut roots = RootCertStore::empty();
            roots.add(self.root.clone()).expect("a root");
            let roots = Arc::new(roots);
            let provider = Arc::new(ring::default_provider());
            let verifier = WebPkiClientVerifier::builder_with_provider(
                Arc::clone(&roots),
                Arc::clone(&provider),
            );
            let connecting = rustls::ClientConfig::builder_with_provider(Arc::clone(&provider))
                .with_protocol_versions(&[&TLS13])
                .expect("a version")
                .with_root_certificates(roots)
                .with_client_auth_cert(chain.clone(), key())
                .expect("they fit");
            let listening = rustls::ServerConfig::builder_with_provider(provider)
                .with_protocol_versions(&[&TLS13])
                .expect("a version")
                .with_client_cert_verifier(verifier.build().expect("it has a root"))
                .with_single_cert(chain, key())
                .expect("they fit");
            let names = vec!["bench".parse().expect("a name")];
            Identity::new(connecting, listening, names)
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

    /// Sends what the display says until `enough`.
    fn speak_until(speaker: &Quic, mut enough: impl FnMut() -> bool) -> bool {
        let datagram = [KEY.as_bytes(), &[0, 1, 2, 3]].concat();
        let began = Instant::now();
        while !enough() {
            if began.elapsed() > LIMIT {
                return false;
            }
            speaker.send(&datagram);
            thread::sleep(Duration::from_millis(5));
        }
        true
    }

    #[test]
    fn a_connection_ends_with_the_certificate_of_its_other_end() {
        let ours = Authority::new();
        let at = free_port();
        let (listener, told) = open(&at, true, ours.identity("bench.sensor", YEAR));
        let short = ours.identity("bench.display", Duration::from_secs(4));
        let (display, _) = open(&at, false, short);
        assert!(speak_until(&display, || told
            .try_iter()
            .any(|key| key == KEY)));
        let peers = || locked(&listener.peers.connections).len();
        assert!(speak_until(&display, || peers() == 0));
        while told.try_recv().is_ok() {}
        // It comes again and again, and in no more, while another one does.
        let (good, _) = open(&at, false, ours.identity("bench.display", YEAR));
        assert!(speak_until(&good, || told.try_iter().count() > 0));
        drop(good);
        assert!(speak_until(&display, || peers() == 0));
    }

    #[test]
    fn who_is_of_another_authority_or_bench_is_not_heard_and_neither_is_another_boards_key() {
        let (ours, theirs) = (Authority::new(), Authority::new());
        let at = free_port();
        let (listener, told) = open(&at, true, ours.identity("bench.sensor", YEAR));
        let strangers = [
            theirs.identity("bench.display", YEAR),
            ours.identity("other.display", YEAR),
            ours.identity("bench.router", YEAR),
            // Let in, and not heard on the display's key.
            ours.identity("bench.sensor", YEAR),
        ]
        .map(|identity| open(&at, false, identity).0);
        let peers = || locked(&listener.peers.connections).len();
        let speaks = |mut enough: Box<dyn FnMut() -> bool + '_>| {
            speak_until(&strangers[3], || {
                for stranger in &strangers[..3] {
                    stranger.send(&[KEY.as_bytes(), &[0]].concat());
                }
                enough()
            })
        };
        assert!(speaks(Box::new(|| peers() == 1)));
        let (display, _) = open(&at, false, ours.identity("bench.display", YEAR));
        let began = Instant::now();
        assert!(speaks(Box::new(|| {
            assert!(told.try_recv().is_err(), "somebody else was heard");
            peers() == 2 && began.elapsed() > AGAIN
        })));
        assert!(speak_until(&display, || told
            .try_iter()
            .any(|key| key == KEY)));
    }
}
