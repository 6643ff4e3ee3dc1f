//! One frame: how a [`Message`] lies on the wire.
//!
//! ```text
//! COBS( sequence: u16 LE | payload | CRC-32: u32 LE ) 0x00
//! ```
//!
//! The payload is the message in postcard; the CRC is CRC-32/ISO-HDLC (Ethernet's, zip's) over the
//! sequence and the payload. COBS leaves 0x00 for the end of a frame alone, so that whoever joins
//! late or heard noise is in step again at the next 0x00.
//!
//! These never change, whatever [`PROTOCOL_VERSION`](crate::PROTOCOL_VERSION) says: COBS and CRC as above,
//! the sequence's place in front, and three payloads, which begin with a 0x00:
//!
//! | payload | bytes after the 0x00 |
//! | --- | --- |
//! | [`Hello`](crate::Hello) | the 35 of [`Hello::to_bytes`](crate::Hello::to_bytes) |
//! | [`Stop`](crate::Stop) | `STOP`, then the reason |
//! | [`Stopped`](crate::Stopped) | `HALT`, then the cause |
//!
//! By these, any two versions can count each other's frames, say that they differ, and stop each other.

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType};

use crate::checksum::CRC_32;
use crate::hello::Hello;
use crate::message::Message;
use crate::stop::{Stop, Stopped};

/// Bytes of the sequence number in front of the payload.
const SEQUENCE: usize = 2;
/// Bytes of the CRC behind the payload.
const CRC: usize = 4;

/// Longest payload of this version, in bytes: the longest postcard of any [`Message`].
pub const MAX_PAYLOAD: usize = max_encoded(Message::SCHEMA);

/// Longest frame of this version, in bytes, its closing 0x00 included.
pub const MAX_FRAME: usize = cobs::max_encoding_length(SEQUENCE + MAX_PAYLOAD + CRC) + 1;

/// Why a frame could not be taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// The bytes are not COBS.
    Cobs,
    /// Too short for a sequence and a CRC.
    Short {
        /// Bytes found after COBS.
        length: usize,
    },
    /// The CRC does not fit the bytes.
    Crc {
        /// The CRC that the frame carries.
        carried: u32,
        /// The CRC of the bytes that came.
        computed: u32,
    },
}

/// Encodes `message` as the frame numbered `sequence`. None only if it does not fit, which the
/// derivation of [`MAX_PAYLOAD`] rules out.
pub fn encode<'a>(
    sequence: u16,
    message: &Message,
    out: &'a mut [u8; MAX_FRAME],
) -> Option<&'a [u8]> {
    let mut content = [0; SEQUENCE + MAX_PAYLOAD + CRC];
    let length = match message {
        Message::Stop(stop) => return encode_payload(sequence, &stop.to_bytes(), out),
        Message::Stopped(stopped) => return encode_payload(sequence, &stopped.to_bytes(), out),
        // Where it is to lie: nothing is copied.
        message => postcard::to_slice(message, &mut content[SEQUENCE..SEQUENCE + MAX_PAYLOAD])
            .ok()?
            .len(),
    };
    seal(sequence, &mut content, length, out)
}

/// Reads a payload that every version says alike; None if it is of another kind.
pub fn frozen(payload: &[u8]) -> Option<Message> {
    let [0, fields @ ..] = payload else {
        return None;
    };
    Hello::from_bytes(fields)
        .map(Message::Hello)
        .or_else(|| Stop::from_bytes(payload).map(Message::Stop))
        .or_else(|| Stopped::from_bytes(payload).map(Message::Stopped))
}

/// Reads a payload of this version; None if it is no message of it.
pub fn message(payload: &[u8]) -> Option<Message> {
    frozen(payload).or_else(|| match postcard::take_from_bytes(payload) {
        // What is frozen is said in no other way.
        Ok((Message::Hello(_) | Message::Stop(_) | Message::Stopped(_), _)) => None,
        Ok((message, [])) => Some(message),
        _ => None,
    })
}

/// Encodes any payload of up to [`MAX_PAYLOAD`] bytes as the frame numbered `sequence`: also what
/// another version might say. None if it is longer.
pub fn encode_payload<'a>(
    sequence: u16,
    payload: &[u8],
    out: &'a mut [u8; MAX_FRAME],
) -> Option<&'a [u8]> {
    let mut content = [0; SEQUENCE + MAX_PAYLOAD + CRC];
    content
        .get_mut(SEQUENCE..SEQUENCE + payload.len())
        .filter(|_| payload.len() <= MAX_PAYLOAD)?
        .copy_from_slice(payload);
    seal(sequence, &mut content, payload.len(), out)
}

/// Puts number and CRC round the `length` bytes of payload that lie in `content`, and encodes it all.
fn seal<'a>(
    sequence: u16,
    content: &mut [u8; SEQUENCE + MAX_PAYLOAD + CRC],
    length: usize,
    out: &'a mut [u8; MAX_FRAME],
) -> Option<&'a [u8]> {
    let crc_at = SEQUENCE + length;
    let content = content.get_mut(..crc_at + CRC)?;
    content[..SEQUENCE].copy_from_slice(&sequence.to_le_bytes());
    let crc = CRC_32.checksum(&content[..crc_at]);
    content[crc_at..].copy_from_slice(&crc.to_le_bytes());

    let length = cobs::try_encode(content, out).ok()?;
    *out.get_mut(length)? = 0;
    out.get(..=length)
}

/// Takes a frame apart, in place: its sequence and its payload. `frame` is what stood before the
/// closing 0x00.
pub fn decode(frame: &mut [u8]) -> Result<(u16, &[u8]), FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Cobs)?;
    let content = frame.get(..length).ok_or(FrameError::Cobs)?;
    let short = FrameError::Short { length };
    let (numbered, crc) = content.split_last_chunk::<CRC>().ok_or(short)?;
    let (sequence, payload) = numbered.split_first_chunk::<SEQUENCE>().ok_or(short)?;

    let carried = u32::from_le_bytes(*crc);
    let computed = CRC_32.checksum(numbered);
    if carried != computed {
        return Err(FrameError::Crc { carried, computed });
    }
    Ok((u16::from_le_bytes(*sequence), payload))
}

/// The longest postcard of a type, in bytes. Does not compile for types that have none.
const fn max_encoded(named: &NamedType) -> usize {
    match named.ty {
        DataModelType::Bool | DataModelType::I8 | DataModelType::U8 => 1,
        DataModelType::I16 | DataModelType::U16 => varint(16),
        DataModelType::I32 | DataModelType::U32 => varint(32),
        DataModelType::I64 | DataModelType::U64 => varint(64),
        DataModelType::F32 => 4,
        DataModelType::F64 => 8,
        DataModelType::Unit | DataModelType::UnitStruct => 0,
        DataModelType::Option(inner) => 1 + max_encoded(inner),
        DataModelType::NewtypeStruct(inner) => max_encoded(inner),
        DataModelType::Tuple(items) | DataModelType::TupleStruct(items) => all(items),
        DataModelType::Struct(fields) => {
            let mut sum = 0;
            let mut at = 0;
            while at < fields.len() {
                sum += max_encoded(fields[at].ty);
                at += 1;
            }
            sum
        }
        DataModelType::Enum(variants) => {
            // Up to 128 variants, their index is one byte.
            assert!(variants.len() <= 128);
            let mut longest = 0;
            let mut at = 0;
            while at < variants.len() {
                let length = match variants[at].ty {
                    DataModelVariant::UnitVariant => 0,
                    DataModelVariant::NewtypeVariant(inner) => max_encoded(inner),
                    DataModelVariant::TupleVariant(items) => all(items),
                    DataModelVariant::StructVariant(_) => panic!("no message needs one so far"),
                };
                if length > longest {
                    longest = length;
                }
                at += 1;
            }
            1 + longest
        }
        _ => panic!("a message is made of bounded types only"),
    }
}

/// The longest postcard of a tuple's items, one after the other, in bytes.
const fn all(items: &[&NamedType]) -> usize {
    let mut sum = 0;
    let mut at = 0;
    while at < items.len() {
        sum += max_encoded(items[at]);
        at += 1;
    }
    sum
}

/// The longest varint of an integer of `bits` bits, in bytes: seven bits a byte.
const fn varint(bits: usize) -> usize {
    bits.div_ceil(7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Schema)]
    struct Wrapped(#[expect(dead_code, reason = "its type counts")] u32);

    #[test]
    fn the_longest_postcard_of_each_sort_of_type_is_known() {
        for (named, longest) in [
            (bool::SCHEMA, 1),
            (u16::SCHEMA, 3),
            (i32::SCHEMA, 5),
            (u64::SCHEMA, 10),
            (f32::SCHEMA, 4),
            (f64::SCHEMA, 8),
            (<()>::SCHEMA, 0),
            (<Option<u16>>::SCHEMA, 4),
            (<(u8, u16, f64)>::SCHEMA, 12),
            (Wrapped::SCHEMA, 5),
        ] {
            assert_eq!(max_encoded(named), longest, "{}", named.name);
        }
    }
}
