//! From a type's shape to its JSON Schema and to its CSV columns, so that neither can disagree with what
//! is written.
//!
//! Only what Foxglove and PlotJuggler read is used: objects of numbers, booleans, texts, objects, and
//! arrays of them. A field that may be missing is left out where it is, and never null.

use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType};
use serde::Serialize;
use serde::ser::{Error, SerializeMap, Serializer};
use serde_json::Value;

/// The JSON Schema of a type, to be written as JSON.
pub struct JsonSchema(pub &'static NamedType);

impl Serialize for JsonSchema {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(named) = self;
        let mut map = match named.ty {
            DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
                return Self(inner).serialize(serializer);
            }
            _ => serializer.serialize_map(None)?,
        };
        match named.ty {
            DataModelType::Bool => map.serialize_entry("type", "boolean")?,
            DataModelType::I8
            | DataModelType::I16
            | DataModelType::I32
            | DataModelType::I64
            | DataModelType::U8
            | DataModelType::U16
            | DataModelType::U32
            | DataModelType::U64 => map.serialize_entry("type", "integer")?,
            DataModelType::F32 | DataModelType::F64 => map.serialize_entry("type", "number")?,
            DataModelType::String => map.serialize_entry("type", "string")?,
            DataModelType::Enum(variants) => {
                let mut words = Vec::new();
                for variant in *variants {
                    let DataModelVariant::UnitVariant = variant.ty else {
                        return Err(unreadable(named));
                    };
                    words.push(variant.name);
                }
                map.serialize_entry("type", "string")?;
                map.serialize_entry("enum", &words)?;
            }
            DataModelType::Tuple(items) => {
                let item = items.first().ok_or_else(|| unreadable(named))?;
                map.serialize_entry("type", "array")?;
                map.serialize_entry("items", &Self(item))?;
                map.serialize_entry("minItems", &items.len())?;
                map.serialize_entry("maxItems", &items.len())?;
            }
            DataModelType::Struct(fields) => {
                let required: Vec<&str> = fields
                    .iter()
                    .filter(|field| !matches!(field.ty.ty, DataModelType::Option(_)))
                    .map(|field| field.name)
                    .collect();
                map.serialize_entry("title", named.name)?;
                map.serialize_entry("type", "object")?;
                map.serialize_entry("properties", &Properties(named))?;
                map.serialize_entry("required", &required)?;
            }
            _ => return Err(unreadable(named)),
        }
        map.end()
    }
}

/// The fields of a struct, in its order.
struct Properties(&'static NamedType);

impl Serialize for Properties {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let DataModelType::Struct(fields) = self.0.ty else {
            return Err(unreadable(self.0));
        };
        serializer.collect_map(
            fields
                .iter()
                .map(|field| (field.name, JsonSchema(field.ty))),
        )
    }
}

fn unreadable<E: Error>(named: &NamedType) -> E {
    E::custom(format_args!("{} has no place in a recording", named.name))
}

/// The CSV columns of a type: fields within fields are joined by `_`, items are numbered from 0.
pub fn columns(named: &'static NamedType) -> Vec<String> {
    let mut names = Vec::new();
    add_columns(named, "", &mut names);
    names
}

fn add_columns(named: &'static NamedType, name: &str, names: &mut Vec<String>) {
    let within = |inner: &str| {
        if name.is_empty() {
            inner.to_owned()
        } else {
            format!("{name}_{inner}")
        }
    };
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
            add_columns(inner, name, names);
        }
        DataModelType::Struct(fields) => {
            for field in *fields {
                add_columns(field.ty, &within(field.name), names);
            }
        }
        DataModelType::Tuple(items) => {
            for (index, item) in items.iter().enumerate() {
                add_columns(item, &within(&index.to_string()), names);
            }
        }
        _ => names.push(name.to_owned()),
    }
}

/// The cells under [`columns`] of a value of the type; those of a field that is missing are empty.
pub fn cells(named: &'static NamedType, value: Option<&Value>, cells: &mut Vec<String>) {
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => {
            self::cells(inner, value, cells);
        }
        DataModelType::Struct(fields) => {
            for field in *fields {
                self::cells(
                    field.ty,
                    value.and_then(|value| value.get(field.name)),
                    cells,
                );
            }
        }
        DataModelType::Tuple(items) => {
            for (index, item) in items.iter().enumerate() {
                self::cells(item, value.and_then(|value| value.get(index)), cells);
            }
        }
        _ => cells.push(match value {
            None | Some(Value::Null) => String::new(),
            Some(Value::String(text)) => text.clone(),
            Some(value) => value.to_string(),
        }),
    }
}
