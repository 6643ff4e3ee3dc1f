//! Two sites over a network: one bridge at each, each with one board on its console.
//!
//! ```text
//! sensor ─ link ─> envelope ─ network ─> gate, age ─> outbox ─ link ─> display
//! sensor <─ link ─ outbox <─ age, gate <─ network ─ envelope <─ link ─ display
//! ```
//!
//! The sensor's estimates cross one way and the display's motions the other. The latest value wins: there
//! is no queue between the network and a board's line, what is older than something that was passed on is
//! dropped, and so is what was too long on its way. Nothing here keeps the operator safe: the display's
//! supervisor does that, on its board, whatever the network does.

pub(crate) mod age;
pub mod credentials;
pub(crate) mod datagrams;
pub mod endpoint;
pub mod envelope;
pub(crate) mod far_board;
pub mod flow;
pub(crate) mod gate;
pub(crate) mod hand;
pub(crate) mod inward;
pub mod name;
pub mod network;
pub mod operator;
pub(crate) mod outward;
pub(crate) mod refused;
pub(crate) mod remote;
pub mod report;
pub mod site;
pub(crate) mod stops;
pub mod transport;
