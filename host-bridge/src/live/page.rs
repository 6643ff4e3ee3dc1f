//! The page of our own: what it is made of, what it is told, and its Stop.

use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::foxglove_server::LiveError;
use super::http::{Request, answer, begin_events, event};
use crate::lock::locked;

/// The page, in one file.
const PAGE: &str = include_str!("page.html");
/// What a page of ours says with its Stop: no other site's page may, for its browser asks here first.
const STOP_HEADER: &str = "x-ridgelink-stop";
/// Browsers at a time.
const MOST: usize = 32;
/// A browser that has gone is noticed at the next thing that is said to it.
const LOOK: Duration = Duration::from_secs(1);

/// The newest picture, and its number.
#[derive(Default)]
pub struct Newest {
    picture: Mutex<(u64, String)>,
    changed: Condvar,
}

impl Newest {
    /// Puts it in the place of the last.
    pub fn put(&self, picture: String) {
        let mut newest = locked(&self.picture);
        newest.0 += 1;
        newest.1 = picture;
        self.changed.notify_all();
    }

    /// The newest one, once it is another than that of `number`; the same after a second.
    fn after(&self, number: u64) -> (u64, String) {
        let waited = self
            .changed
            .wait_timeout_while(locked(&self.picture), LOOK, |newest| newest.0 == number);
        waited.unwrap_or_else(PoisonError::into_inner).0.clone()
    }
}

/// What all connections share.
struct Shared {
    newest: Arc<Newest>,
    stop: Box<dyn Fn() + Send + Sync>,
    connections: AtomicUsize,
}

/// Takes a port, and says where. Fails if it can't be had.
pub fn listen(address: IpAddr, port: u16) -> Result<(TcpListener, SocketAddr), LiveError> {
    let listener = TcpListener::bind((address, port));
    listener
        .and_then(|listener| Ok((listener.local_addr()?, listener)))
        .map(|(here, listener)| (listener, here))
        .map_err(|source| LiveError::Page(port, source))
}

/// Serves the page for as long as the program runs; `stop` is called at each Stop.
pub fn serve(listener: TcpListener, newest: Arc<Newest>, stop: Box<dyn Fn() + Send + Sync>) {
    let shared = Arc::new(Shared {
        newest,
        stop,
        connections: AtomicUsize::new(0),
    });
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let before = shared.connections.fetch_add(1, Ordering::Relaxed);
                // A browser that goes away in the middle is no error of ours.
                let _ = shared.speak(&stream, before >= MOST);
                shared.connections.fetch_sub(1, Ordering::Relaxed);
            });
        }
    });
}

impl Shared {
    /// Answers one request. A Stop is heard however many there are.
    fn speak(&self, stream: &TcpStream, is_full: bool) -> io::Result<()> {
        const TEXT: &str = "text/plain; charset=utf-8";
        let Some(request) = Request::read(stream)? else {
            return answer(stream, "400 Bad Request", TEXT, b"no request\n");
        };
        if !request.is_by_address() {
            let why = b"give this computer's address, not a name\n";
            return answer(stream, "403 Forbidden", TEXT, why);
        }
        match (request.method.as_str(), request.path.as_str()) {
            ("POST", "/stop") if request.header(STOP_HEADER).is_some() => {
                (self.stop)();
                answer(stream, "200 OK", TEXT, b"said\n")
            }
            ("POST", "/stop") => {
                answer(stream, "403 Forbidden", TEXT, b"not from a page of ours\n")
            }
            _ if is_full => answer(stream, "503 Service Unavailable", TEXT, b"too many\n"),
            ("GET", "/") => answer(
                stream,
                "200 OK",
                "text/html; charset=utf-8",
                PAGE.as_bytes(),
            ),
            ("GET", "/events") => {
                begin_events(stream)?;
                let mut last = 0;
                loop {
                    let (number, picture) = self.newest.after(last);
                    last = number;
                    event(stream, &picture)?;
                }
            }
            _ => answer(stream, "404 Not Found", TEXT, b"there is nothing\n"),
        }
    }
}
