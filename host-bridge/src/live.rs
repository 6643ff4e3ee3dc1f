//! Live views: what the boards say, for Foxglove and for a page of our own.
//!
//! ```text
//! links ─┬─> row builder ─> CDR ─> Foxglove's protocol, on a port: the topics and schemas of a recording
//!        └─> dashboard ─> JSON, 20 times a second ─> the page, on the port beside it; its Stop ─> both boards
//! ```
//!
//! Two ports, for the server of Foxglove's crate answers nothing but its own protocol.

mod foxglove_server;
mod page;
mod viewer;

pub use viewer::{PORT, Settings, Viewer};
