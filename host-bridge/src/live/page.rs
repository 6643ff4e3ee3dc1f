//! The page of our own: what it is made of, what it is told, and its Stop; and as much of HTTP as it needs: one request a
//! connection.

use std::io::{BufRead, BufReader, Write};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{io, thread};

use super::foxglove_server::LiveError;
use crate::lock::locked;
use crate::relay::endpoint::Within;

const PAGE: &str = include_str!("page.html");
/// What a page of ours says with its Stop: no other site's page may, for its browser asks here first.
const STOP_HEADER: &str = "x-ridgelink-stop";
/// What asks for the next picture; the number of the last one stands behind it. Each takes a connection of its own and
/// not one for as long as somebody looks on: a browser has six to a place for all its tabs, and Stop needs one.
const PICTURE: &str = "/picture/";
const NOTHING: &[u8] = b"there is nothing\n";
/// Connections on which somebody may look on at once; more are answered, and sent away.
const MOST: usize = 32;
/// Connections that are looked after at once. Another waits until one of them has said what it wants, or its time is over.
const MOST_AT_ONCE: usize = 128;
/// How long a browser waits for a picture that does not change.
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
        .map_err(|source| LiveError::Page((address, port).into(), source))
}

/// Serves the page for as long as the program runs; `stop` is called at each Stop.
pub fn serve(listener: TcpListener, newest: Arc<Newest>, stop: Box<dyn Fn() + Send + Sync>) {
    let shared = Arc::new(Shared {
        newest,
        stop,
        connections: AtomicUsize::new(0),
    });
    thread::spawn(move || {
        loop {
            if shared.connections.load(Ordering::Relaxed) >= MOST_AT_ONCE {
                thread::park_timeout(PAUSE);
                continue;
            }
            let Ok((stream, _)) = listener.accept() else {
                // No more handles, most likely: one is given back when a browser goes.
                thread::park_timeout(PAUSE);
                continue;
            };
            let connection = Connection::new(&shared);
            // Without a thread for it, it is closed.
            let _ = thread::Builder::new().spawn(move || {
                // A browser that goes away in the middle is no error of ours.
                let _ = connection.0.speak(&stream);
            });
        }
    });
}

/// One that is looked after, until it is dropped.
struct Connection(Arc<Shared>);

impl Connection {
    fn new(shared: &Arc<Shared>) -> Self {
        shared.connections.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(shared))
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Shared {
    /// Answers one request. A Stop is heard however many look on.
    fn speak(&self, stream: &TcpStream) -> io::Result<()> {
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
            _ if self.connections.load(Ordering::Relaxed) > MOST => {
                answer(stream, "503 Service Unavailable", TEXT, b"too many\n")
            }
            ("GET", "/") => answer(
                stream,
                "200 OK",
                "text/html; charset=utf-8",
                PAGE.as_bytes(),
            ),
            ("GET", path) => {
                let Some(last) = path.strip_prefix(PICTURE).and_then(|n| n.parse().ok()) else {
                    return answer(stream, "404 Not Found", TEXT, NOTHING);
                };
                let (number, picture) = self.newest.after(last);
                let body = format!(r#"{{"number":{number},"picture":{picture}}}"#);
                answer(stream, "200 OK", "application/json", body.as_bytes())
            }
            _ => answer(stream, "404 Not Found", TEXT, NOTHING),
        }
    }
}

/// The longest head of a request, in bytes.
const LONGEST: u64 = 16_384;
/// Until another browser is let in after one could not be.
const PAUSE: Duration = Duration::from_millis(100);
/// How long a browser may take to say what it wants.
const HEAD_WITHIN: Duration = Duration::from_secs(2);
/// How long it may take to take what it gets.
const PATIENCE: Duration = Duration::from_secs(5);

/// What a browser asks for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Request {
    pub method: String,
    pub path: String,
    /// The names of its headers in lower case, and what they say.
    pub headers: Vec<(String, String)>,
}

impl Request {
    /// Reads one; none if it is no request. Fails if the connection fails.
    pub fn read(stream: &TcpStream) -> io::Result<Option<Self>> {
        stream.set_write_timeout(Some(PATIENCE))?;
        Self::parse(BufReader::new(Within {
            stream,
            end: Instant::now() + HEAD_WITHIN,
        }))
    }

    fn parse(reader: impl BufRead) -> io::Result<Option<Self>> {
        let mut lines = reader.take(LONGEST).lines();
        let Some(first) = lines.next().transpose()? else {
            return Ok(None);
        };
        let mut words = first.split(' ');
        let (Some(method), Some(path), Some(_)) = (words.next(), words.next(), words.next()) else {
            return Ok(None);
        };
        let mut request = Self {
            method: method.to_owned(),
            path: path.split('?').next().unwrap_or(path).to_owned(),
            headers: Vec::new(),
        };
        for line in lines {
            let line = line?;
            if line.is_empty() {
                return Ok(Some(request));
            }
            if let Some((name, value)) = line.split_once(':') {
                let name = name.trim().to_ascii_lowercase();
                request.headers.push((name, value.trim().to_owned()));
            }
        }
        Ok(None)
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        let mut headers = self.headers.iter();
        let found = headers.find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }

    /// Whether it was asked for by an address and not by a name: a name may be anybody's, and lead here
    /// all the same, so that another's page speaks with us (DNS rebinding).
    pub fn is_by_address(&self) -> bool {
        let Some(host) = self.header("host") else {
            return false;
        };
        let bare = match host.strip_prefix('[') {
            Some(rest) => rest.split(']').next().unwrap_or(rest),
            None => host.split(':').next().unwrap_or(host),
        };
        bare == "localhost" || bare.parse::<IpAddr>().is_ok()
    }
}

/// Answers with a whole body, and ends. Fails if the connection fails.
pub fn answer(mut stream: &TcpStream, status: &str, kind: &str, body: &[u8]) -> io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    )?;
    stream.write_all(body)?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::net::Ipv4Addr;
    use std::sync::atomic::AtomicBool;

    use super::*;

    fn request(text: &str) -> Option<Request> {
        Request::parse(text.as_bytes()).expect("memory can be read")
    }

    #[test]
    fn a_request_is_read_with_its_path_and_headers() {
        let read = request("POST /stop?x HTTP/1.1\r\nHost: 127.0.0.1:8766\r\nX-Stop: yes\r\n\r\n");
        let read = read.expect("a request");
        assert_eq!(
            (read.method.as_str(), read.path.as_str()),
            ("POST", "/stop")
        );
        assert_eq!(read.header("x-stop"), Some("yes"));
        assert!(read.is_by_address());
        for none in ["", "nonsense\r\n\r\n", "GET / HTTP/1.1\r\nHost: a"] {
            assert_eq!(request(none), None, "{none:?}");
        }
        // Endless heads end.
        let endless = format!("GET / HTTP/1.1\r\n{}", "X: y\r\n".repeat(10_000));
        assert_eq!(request(&endless), None);
    }

    #[test]
    fn names_of_others_are_not_answered() {
        for (host, is_ours) in [
            ("localhost:8766", true),
            ("[::1]:8766", true),
            ("192.168.0.7", true),
            ("evil.example:8766", false),
            ("127.0.0.1.evil.example", false),
        ] {
            let read = request(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n"));
            assert_eq!(read.expect("a request").is_by_address(), is_ours, "{host}");
        }
        let without = request("GET / HTTP/1.1\r\n\r\n").expect("a request");
        assert!(!without.is_by_address());
    }
    /// A server of its own, and whether it has heard a Stop.
    fn server() -> (SocketAddr, Arc<AtomicBool>) {
        let (listener, address) = listen(Ipv4Addr::LOCALHOST.into(), 0).expect("a free port");
        let heard = Arc::new(AtomicBool::new(false));
        let hear = Arc::clone(&heard);
        let stop = move || hear.store(true, Ordering::Release);
        serve(listener, Arc::default(), Box::new(stop));
        (address, heard)
    }

    #[test]
    fn whoever_says_what_he_wants_byte_by_byte_is_sent_away() {
        let (address, _) = server();
        let mut slow = TcpStream::connect(address).expect("it listens");
        // Ten times as long as it may take.
        let refused = (0..200).find(|_| {
            thread::park_timeout(HEAD_WITHIN / 20);
            slow.write_all(b"G").is_err()
        });
        assert!(refused.is_some(), "still listened to");
    }

    #[test]
    fn a_stop_is_heard_though_many_have_connected_and_say_nothing() {
        let (address, heard) = server();
        let silent: Vec<_> = (0..MOST_AT_ONCE + 100)
            .map_while(|_| TcpStream::connect(address).ok())
            .collect();
        let mut page = TcpStream::connect(address).expect("it listens");
        let request = format!("POST /stop HTTP/1.1\r\nHost: {address}\r\n{STOP_HEADER}: 1\r\n\r\n");
        page.write_all(request.as_bytes()).expect("it takes it");
        let mut said = String::new();
        page.read_to_string(&mut said).expect("it answers");
        assert!(said.starts_with("HTTP/1.1 200"), "{said}");
        assert!(heard.load(Ordering::Acquire));
        drop(silent);
    }
}
