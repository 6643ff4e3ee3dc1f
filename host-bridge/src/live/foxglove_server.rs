//! What the boards say, in Foxglove's WebSocket protocol: the topics, schemas and bytes of a recording.

use std::collections::HashMap;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
};
use protocol::Role;

use crate::link::Event;
use crate::recording::{CdrEncoder, Note, RowBuilder, SchemaError};

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
        for entry in self.rows.enter(role, at_us, &Note::Event(event.clone())) {
            self.cdr.clear();
            // A row that can't be said is none of this program's.
            if let Ok(Some(at)) = self.encoder.encode(&entry, &mut self.cdr) {
                let time = PartialMetadata::with_log_time(entry.log_ns);
                self.channels[at].log_with_meta(&self.cdr, time);
            }
        }
    }

    pub fn stop(self) {
        self.server.stop().wait_blocking();
    }
}
