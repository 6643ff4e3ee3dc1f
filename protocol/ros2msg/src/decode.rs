//! From CDR to a JSON value.

use serde_json::{Map, Number, Value};

use crate::definition::{Definition, Kind};
use crate::{BIG_ENDIAN, LITTLE_ENDIAN};

/// Why bytes are no message of a definition.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum DecodeError {
    #[error("is no plain CDR: it begins with {0:02x?}")]
    Encapsulation(Vec<u8>),
    #[error("ends within {field}, after {length} bytes")]
    Short {
        field: String,
        /// How many bytes there are.
        length: usize,
    },
    #[error("{0} is no text")]
    Text(String),
}

/// A message's value. Fails if the bytes are none of that definition. What is behind the last field is not looked
/// at.
pub fn decode(definition: &Definition, bytes: &[u8]) -> Result<Value, DecodeError> {
    let (head, body) = bytes.split_at_checked(4).unwrap_or((bytes, &[]));
    let is_big = head.get(..2) == BIG_ENDIAN.get(..2);
    if !is_big && head.get(..2) != LITTLE_ENDIAN.get(..2) {
        return Err(DecodeError::Encapsulation(head.to_vec()));
    }
    let mut cursor = Cursor {
        body,
        at: 0,
        is_big,
        field: "",
    };
    cursor.message(definition)
}

struct Cursor<'b, 'd> {
    body: &'b [u8],
    at: usize,
    is_big: bool,
    /// The field that is being read, for error messages.
    field: &'d str,
}

impl<'d> Cursor<'_, 'd> {
    fn short(&self) -> DecodeError {
        DecodeError::Short {
            field: self.field.to_owned(),
            length: self.body.len(),
        }
    }

    fn take(&mut self, count: usize) -> Result<&[u8], DecodeError> {
        let end = self.at.checked_add(count);
        match end.and_then(|end| self.body.get(self.at..end)) {
            Some(found) => {
                self.at += count;
                Ok(found)
            }
            None => Err(self.short()),
        }
    }

    /// A number of `size` bytes at a multiple of `size`, as little-endian bytes with zeros behind them.
    fn aligned(&mut self, size: usize) -> Result<[u8; 8], DecodeError> {
        self.at = self.at.next_multiple_of(size);
        let is_big = self.is_big;
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(self.take(size)?);
        if is_big {
            bytes[..size].reverse();
        }
        Ok(bytes)
    }

    fn whole(&mut self, size: usize) -> Result<u64, DecodeError> {
        Ok(u64::from_le_bytes(self.aligned(size)?))
    }

    fn count(&mut self) -> Result<usize, DecodeError> {
        Ok(self.whole(4)? as usize)
    }

    fn message(&mut self, definition: &'d Definition) -> Result<Value, DecodeError> {
        let mut map = Map::new();
        for field in &definition.fields {
            self.field = &field.name;
            map.insert(field.name.clone(), self.value(&field.kind)?);
        }
        Ok(Value::Object(map))
    }

    fn list(&mut self, kind: &'d Kind, count: usize) -> Result<Value, DecodeError> {
        // A length may be damaged: no item takes less than a byte but one without fields.
        if count > self.body.len() {
            return Err(self.short());
        }
        let items: Result<Vec<Value>, DecodeError> = (0..count).map(|_| self.value(kind)).collect();
        items.map(Value::Array)
    }

    fn value(&mut self, kind: &'d Kind) -> Result<Value, DecodeError> {
        Ok(match kind {
            Kind::Bool => Value::Bool(self.whole(1)? != 0),
            Kind::Signed(size) => {
                // The sign is that of the highest byte there is.
                let unused = 64 - 8 * *size as u32;
                ((self.whole(*size)? << unused).cast_signed() >> unused).into()
            }
            Kind::Unsigned(size) => self.whole(*size)?.into(),
            Kind::F32 => float(f32::from_bits(self.whole(4)? as u32).into()),
            Kind::F64 => float(f64::from_bits(self.whole(8)?)),
            Kind::Text => self.text()?,
            Kind::Message(definition) => self.message(definition)?,
            Kind::Array(kind, count) => self.list(kind, *count)?,
            Kind::Sequence(kind) => {
                let count = self.count()?;
                self.list(kind, count)?
            }
        })
    }

    /// A length with the closing zero in it, the text, the zero; some writers leave an empty one's zero out.
    fn text(&mut self) -> Result<Value, DecodeError> {
        let count = self.count()?;
        let field = self.field;
        let bytes = self.take(count)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        let text = str::from_utf8(bytes).map_err(|_| DecodeError::Text(field.to_owned()))?;
        Ok(Value::String(text.to_owned()))
    }
}

fn float(number: f64) -> Value {
    Number::from_f64(number).map_or(Value::Null, Value::Number)
}
