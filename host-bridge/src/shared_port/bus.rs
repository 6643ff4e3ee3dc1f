//! How an owner and its guests hear each other: the network's engine on a socket of this computer.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crossbeam_channel::{Receiver, bounded};
use serde_json::json;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::engine::Setup;

const SAID: &str = "ridgelink/port/said";
const ASKED: &str = "ridgelink/port/asked";
/// Reads that may wait for a guest, some seconds of everything; one that is slower misses some, and sees that
/// it does.
const WAITING: usize = 8_192;
/// How long an owner may take to answer, in ms: one that is halted never does.
const ANSWER_MS: u64 = 1_000;

fn failed(error: zenoh::Error) -> io::Error {
    io::Error::other(error.to_string())
}

fn open(mode: &str, end: &str, socket: &Path) -> io::Result<Session> {
    let socket = format!("unixsock-stream/{}", socket.display());
    let (listen, connect) = match end {
        "listen" => (vec![socket], Vec::new()),
        _ => (Vec::new(), vec![socket]),
    };
    let timeouts = ["open_timeout", "accept_timeout"];
    let more = timeouts.map(|key| (format!("transport/unicast/{key}"), json!(ANSWER_MS)));
    let more = more.into();
    Setup {
        mode,
        listen,
        connect,
        more,
    }
    .open()
    .map_err(failed)
}

fn publisher(session: &Session, key: &'static str) -> io::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .priority(Priority::InteractiveHigh)
        .congestion_control(CongestionControl::Drop)
        .express(true)
        .wait()
        .map_err(failed)
}

/// The owner's end.
pub struct Host {
    /// None if it could not be opened: then the port is the owner's alone.
    end: Option<(Publisher<'static>, Subscriber<()>, Session)>,
}

impl Host {
    /// Listens at `socket`; `on_asked` is called with what guests say to the board.
    pub fn open(socket: PathBuf, on_asked: impl Fn(&[u8]) + Send + Sync + 'static) -> Self {
        // Left over by an owner that was killed.
        let _ = fs::remove_file(&socket);
        let end = open("peer", "listen", &socket).and_then(|session| {
            let asked = session
                .declare_subscriber(ASKED)
                .callback(move |sample: Sample| on_asked(&sample.payload().to_bytes()))
                .wait()
                .map_err(failed)?;
            Ok((publisher(&session, SAID)?, asked, session))
        });
        Self { end: end.ok() }
    }

    /// Lets the guests hear what the board said, maybe nothing.
    pub fn say(&self, bytes: &[u8]) {
        if let Some((said, ..)) = &self.end {
            // Who is too slow misses it.
            let _ = said.put(bytes).wait();
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        if let Some((.., session)) = self.end.take() {
            let _ = session.close().wait();
        }
    }
}

/// A guest's end.
pub struct Guest {
    session: Session,
    asked: Arc<Publisher<'static>>,
    said: Receiver<Vec<u8>>,
    _subscriber: Subscriber<()>,
}

impl Guest {
    /// Joins the owner at `socket`. Fails if nobody answers there.
    pub fn open(socket: &Path) -> io::Result<Self> {
        if !socket.exists() {
            return Err(ErrorKind::NotFound.into());
        }
        let session = open("client", "connect", socket)?;
        let (hears, said) = bounded(WAITING);
        let subscriber = session
            .declare_subscriber(SAID)
            .callback(move |sample: Sample| {
                // What there is no room for is missing, and seen to be by the frames' numbers.
                let _ = hears.try_send(sample.payload().to_bytes().into_owned());
            })
            .wait()
            .map_err(failed)?;
        Ok(Self {
            asked: Arc::new(publisher(&session, ASKED)?),
            said,
            session,
            _subscriber: subscriber,
        })
    }

    /// Whether the owner that was joined is still there.
    pub fn is_joined(&self) -> bool {
        let info = self.session.info();
        info.peers_zid().wait().count() + info.routers_zid().wait().count() > 0
    }

    /// What the board says, read by read; an empty one is a sign of life of the owner's.
    pub const fn said(&self) -> &Receiver<Vec<u8>> {
        &self.said
    }

    /// A way to say things to the board.
    pub fn asker(&self) -> Asker {
        Asker(Arc::clone(&self.asked))
    }

    /// Leaves when all that was said is with the owner.
    pub fn leave(self) {
        let _ = self.session.close().wait();
    }
}

/// Says things to the board by way of the owner.
pub struct Asker(Arc<Publisher<'static>>);

impl Asker {
    /// Says whole frames. Fails if the owner is gone.
    pub fn ask(&self, frames: Vec<u8>) -> io::Result<()> {
        self.0.put(frames).wait().map_err(failed)
    }
}
