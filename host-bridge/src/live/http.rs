//! As much of HTTP as a page needs that is served to a few browsers: one request a connection.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{IpAddr, TcpStream};
use std::time::Duration;

/// The longest head of a request, in bytes.
const LONGEST: u64 = 16_384;
/// How long a browser may take to say what it wants, or to take what it gets.
const PATIENCE: Duration = Duration::from_secs(5);

/// What a browser asks for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// `GET`, `POST` and so on.
    pub method: String,
    /// The path.
    pub path: String,
    /// The names of its headers in lower case, and what they say.
    pub headers: Vec<(String, String)>,
}

impl Request {
    /// Reads one; none if it is no request. Fails if the connection fails.
    pub fn read(stream: &TcpStream) -> io::Result<Option<Self>> {
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Self::parse(BufReader::new(stream))
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

    /// What a header says.
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

/// Begins a stream of events, each to be said by [`event`]. Fails if the connection fails.
pub fn begin_events(mut stream: &TcpStream) -> io::Result<()> {
    write!(
        stream,
        "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
    )?;
    stream.flush()
}

/// Says an event of one line. Fails if the connection fails.
pub fn event(mut stream: &TcpStream, line: &str) -> io::Result<()> {
    stream.write_all(format!("data: {line}\n\n").as_bytes())?;
    stream.flush()
}

#[cfg(test)]
mod tests {
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
}
