//! From a JSON value to CDR.

use serde_json::Value;

use crate::LITTLE_ENDIAN;
use crate::definition::{Definition, Kind};

/// Why a value is none of a definition.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} can't be {value}")]
pub struct EncodeError {
    /// The field.
    pub field: String,
    /// What is there, as JSON.
    pub value: String,
}

/// Appends a message's bytes, little endian. Fields that the value lacks are 0, false, empty or, where a number has
/// a fraction, NaN. Fails if a field holds what is not of its kind.
pub fn encode(
    definition: &Definition,
    value: &Value,
    out: &mut Vec<u8>,
) -> Result<(), EncodeError> {
    out.extend(LITTLE_ENDIAN);
    let mut writer = Writer {
        start: out.len(),
        out,
        field: "",
    };
    writer.message(definition, value)
}

struct Writer<'o, 'd> {
    out: &'o mut Vec<u8>,
    /// Where the body starts: alignment counts from there.
    start: usize,
    /// The field that is being written, for error messages.
    field: &'d str,
}

impl<'d> Writer<'_, 'd> {
    fn aligned(&mut self, bytes: &[u8]) {
        let length = self.out.len() - self.start;
        let room = length.next_multiple_of(bytes.len()) - length;
        self.out.resize(self.out.len() + room, 0);
        self.out.extend(bytes);
    }

    fn message(&mut self, definition: &'d Definition, value: &Value) -> Result<(), EncodeError> {
        if !matches!(value, Value::Object(_) | Value::Null) {
            return Err(self.wrong(value));
        }
        for field in &definition.fields {
            self.field = &field.name;
            let value = value.get(&field.name).unwrap_or(&Value::Null);
            self.value(&field.kind, value)?;
        }
        Ok(())
    }

    fn wrong(&self, value: &Value) -> EncodeError {
        EncodeError {
            field: self.field.to_owned(),
            value: value.to_string(),
        }
    }

    /// The low `size` bytes of a whole number, if it has no more.
    fn whole(&mut self, value: &Value, size: usize, is_signed: bool) -> Result<(), EncodeError> {
        let bits = 8 * size as u32;
        let (low, high) = if is_signed {
            (-(1_i128 << (bits - 1)), 1_i128 << (bits - 1))
        } else {
            (0, 1_i128 << bits)
        };
        let number = match value {
            Value::Null => Some(0),
            value => value
                .as_i64()
                .map(i128::from)
                .or_else(|| value.as_u64().map(i128::from)),
        };
        let number = number.filter(|number| (low..high).contains(number));
        let number = number.ok_or_else(|| self.wrong(value))?;
        self.aligned(&number.to_le_bytes()[..size]);
        Ok(())
    }

    fn float(&self, value: &Value) -> Result<f64, EncodeError> {
        match value {
            Value::Null => Ok(f64::NAN),
            value => value.as_f64().ok_or_else(|| self.wrong(value)),
        }
    }

    fn text(&mut self, value: &Value) -> Result<(), EncodeError> {
        let text = match value {
            Value::Null => "",
            Value::String(text) => text,
            value => return Err(self.wrong(value)),
        };
        let length = u32::try_from(text.len() + 1).map_err(|_| self.wrong(value))?;
        self.aligned(&length.to_le_bytes());
        self.out.extend(text.as_bytes());
        self.out.push(0);
        Ok(())
    }

    fn value(&mut self, kind: &'d Kind, value: &Value) -> Result<(), EncodeError> {
        match kind {
            Kind::Bool => {
                let is = match value {
                    Value::Null => false,
                    Value::Bool(is) => *is,
                    value => return Err(self.wrong(value)),
                };
                self.aligned(&[u8::from(is)]);
            }
            Kind::Signed(size) => self.whole(value, *size, true)?,
            Kind::Unsigned(size) => self.whole(value, *size, false)?,
            Kind::F32 => self.aligned(&(self.float(value)? as f32).to_le_bytes()),
            Kind::F64 => self.aligned(&self.float(value)?.to_le_bytes()),
            Kind::Text => self.text(value)?,
            Kind::Message(definition) => self.message(definition, value)?,
            Kind::Array(kind, count) => {
                let items = self.items(value)?;
                if !value.is_null() && items.len() != *count {
                    return Err(self.wrong(value));
                }
                for at in 0..*count {
                    self.value(kind, items.get(at).unwrap_or(&Value::Null))?;
                }
            }
            Kind::Sequence(kind) => {
                let items = self.items(value)?;
                let length = u32::try_from(items.len()).map_err(|_| self.wrong(value))?;
                self.aligned(&length.to_le_bytes());
                for item in items {
                    self.value(kind, item)?;
                }
            }
        }
        Ok(())
    }

    fn items<'v>(&self, value: &'v Value) -> Result<&'v [Value], EncodeError> {
        match value {
            Value::Null => Ok(&[]),
            Value::Array(items) => Ok(items),
            value => Err(self.wrong(value)),
        }
    }
}
