//! What the boards say, in Foxglove's WebSocket protocol: the topics, schemas and bytes of a recording.

use std::collections::HashMap;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
};
use protocol::Role;
use tokio::runtime::Builder;
use tokio::time::timeout;

use crate::link::Event;
use crate::recording::{CdrEncoder, Note, RowBuilder, SchemaError};

/// How long those who listen may take to hear that nothing more comes.
const FAREWELL: Duration = Duration::from_millis(500);

/// Why nothing can be shown.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    #[error("port {0} for Foxglove: {1}: give another one with --port")]
    Foxglove(u16, #[source] Box<FoxgloveError>),
    #[error("port at {0} for the page: {1}: {advice}", advice = advice(.1))]
    Page(SocketAddr, #[source] io::Error),
    #[error(transparent)]
    Schema(#[from] SchemaError),
}

fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::AddrNotAvailable => {
            "this computer has no such address: give one of its own with --listen"
        }
        _ => "give another one with --port",
    }
}

/// A server that says everything to whoever asks, and hears nothing.
pub struct FoxgloveServer {
    server: WebSocketServerHandle,
    /// The channels are closed when it goes.
    _context: Arc<Context>,
    encoder: CdrEncoder,
    channels: Vec<Arc<RawChannel>>,
    rows: RowBuilder,
    cdr: Vec<u8>,
}

impl FoxgloveServer {
    /// Begins to listen. Fails if the port can't be had.
    pub fn start(address: IpAddr, port: u16) -> Result<Self, LiveError> {
        let encoder = CdrEncoder::new()?;
        // Its own, so that two in one program don't mix.
        let context = Context::new();
        let refused = |source| LiveError::Foxglove(port, Box::new(source));
        let mut channels = Vec::new();
        for channel in encoder.channels() {
            let text = channel.schema.clone().into_bytes();
            let schema = Schema::new(channel.schema_name.clone(), "ros2msg", text);
            let built = ChannelBuilder::new(channel.topic.clone())
                .context(&context)
                .message_encoding("cdr")
                .schema(schema)
                .build_raw();
            channels.push(built.map_err(refused)?);
        }
        let about = HashMap::from([("program".to_owned(), crate::PROGRAM.to_owned())]);
        let server = WebSocketServer::new()
            .context(&context)
            .name("Ridgelink")
            .server_info(about)
            .bind(address.to_string(), port)
            .start_blocking()
            .map_err(refused)?;
        Ok(Self {
            server,
            _context: context,
            encoder,
            channels,
            rows: RowBuilder::default(),
            cdr: Vec::new(),
        })
    }

    /// The port that it listens on.
    pub fn port(&self) -> u16 {
        self.server.port()
    }

    /// Says what a link told at `at_us` of this host's clock.
    pub fn on_event(&mut self, role: Role, event: &Event, at_us: u64) {
        self.say(role, at_us, &Note::Event(event.clone()));
    }

    /// Says a line of the log of the board of `role`, read at `at_us` of this host's clock.
    pub fn on_log(&mut self, role: Role, level: Option<&'static str>, text: String, at_us: u64) {
        self.say(role, at_us, &Note::Log(level, text));
    }

    fn say(&mut self, role: Role, at_us: u64, note: &Note) {
        for entry in self.rows.enter(role, at_us, note) {
            self.cdr.clear();
            // A row that can't be said is none of this program's.
            if let Ok(Some(at)) = self.encoder.encode(&entry, &mut self.cdr) {
                let time = PartialMetadata::with_log_time(entry.log_ns);
                self.channels[at].log_with_meta(&self.cdr, time);
            }
        }
    }

    /// Takes leave of who listens, and waits for nobody who takes nothing.
    pub fn stop(self) {
        let left = self.server.stop().wait();
        // Dropped unfinished, it ends the connections that are left.
        if let Ok(runtime) = Builder::new_current_thread().enable_time().build() {
            let _ = runtime.block_on(async { timeout(FAREWELL, left).await });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::net::TcpStream;
    use std::sync::mpsc::channel;
    use std::thread;

    use super::*;

    /// Only what hangs takes so long.
    const LIMIT: Duration = Duration::from_secs(60);

    #[test]
    fn who_is_connected_and_neither_speaks_nor_listens_does_not_keep_it_from_ending() {
        let here = IpAddr::from([127, 0, 0, 1]);
        let server = FoxgloveServer::start(here, 0).expect("any port will do");
        let connect = || TcpStream::connect((here, server.port())).expect("it listens");
        let silent = connect();
        // Who comes later is let in: so was the first one.
        let mut later = connect();
        let request = "GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";
        later.write_all(request.as_bytes()).expect("it reads");
        let mut answer = String::new();
        let mut reader = BufReader::new(&later);
        reader.read_line(&mut answer).expect("it answers");
        assert!(answer.starts_with("HTTP/1.1 101 "), "{answer}");
        let (ending, ended) = channel();
        thread::spawn(move || {
            server.stop();
            ending.send(())
        });
        assert_eq!(ended.recv_timeout(LIMIT), Ok(()));
        drop((silent, later));
    }
}
