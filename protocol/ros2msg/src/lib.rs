//! ROS 2 messages without ROS: definitions from `ros2msg` text, and CDR to and from JSON values.
//!
//! ```text
//! ros2msg text ─> Definition ─┬─> decode: CDR ─> JSON value
//!                             └─> encode: JSON value ─> CDR
//! ```
//!
//! The text is that of an MCAP schema with the encoding `ros2msg`: the message's own definition, then each
//! definition that it needs behind a line of `=` and a line `MSG: package/Name`
//! (<https://mcap.dev/spec/registry#ros2msg>). The bytes are those of a message with the encoding `cdr`: plain
//! CDR of either byte order (OMG CORBA 3.4, part 2, section 9.3), behind four bytes that name it (OMG DDSI-RTPS
//! 2.5, section 10.2).
//!
//! A JSON value of a message is an object with the fields in their order. JSON has no NaN and no infinity:
//! they become `null`, and `null` becomes NaN.

mod decode;
mod definition;
mod encode;

pub use decode::{DecodeError, decode};
pub use definition::{Definition, DefinitionError, Field, Kind};
pub use encode::{EncodeError, encode};

/// What a message begins with: plain CDR, little endian, no options.
pub const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
/// The same, big endian.
pub const BIG_ENDIAN: [u8; 4] = [0, 0, 0, 0];
