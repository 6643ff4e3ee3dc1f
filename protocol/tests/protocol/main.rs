//! The wire: messages, frames, receiver, handshake, clock offset.

mod billion;
mod clock;
mod configuration;
mod console;
mod golden;
mod messages;
mod port;
mod properties;
mod receiver;
mod sender;
mod table;
