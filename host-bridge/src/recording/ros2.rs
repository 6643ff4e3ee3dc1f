//! From a row's shape to its `ros2msg` schema, and from rows to what that schema says and back: so that a
//! recording's schema cannot disagree with what is written.
//!
//! | shape | `ros2msg` |
//! | --- | --- |
//! | number, boolean, text, array | the same |
//! | struct | a message of its own |
//! | enum | `uint8`, with a constant for each variant above it |
//! | a field `x` that may be missing | `bool has_x`, then `x`: NaN, 0 or empty where it is missing |
//!
//! The comments are the types' own.

use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType};
use ros2msg::{Definition, DefinitionError, EncodeError, encode};
use serde_json::{Map, Value};

use super::descriptions::{field as described, item};
use super::row::{CHANNELS, LEVELS, channel, topic};
use super::row_builder::Entry;

/// What stands between two definitions of a schema.
const RULE: &str =
    "================================================================================";
/// Comments are broken here, in characters.
const WIDTH: usize = 100;

/// A type's name in ROS 2: `package/msg/Name`.
pub fn name(named: &NamedType) -> String {
    match named.name {
        // So that tools that know logs know these.
        "LogRow" => "rcl_interfaces/msg/Log".to_owned(),
        "Time" => "builtin_interfaces/msg/Time".to_owned(),
        name => format!(
            "ridgelink_msgs/msg/{}",
            name.strip_suffix("Row").unwrap_or(name)
        ),
    }
}

/// The schema of a struct: its definition and those of all structs within it. Fails with the name of a type that
/// has no place in a recording.
pub fn schema(named: &'static NamedType) -> Result<String, &'static str> {
    let mut text = definition(named)?;
    let mut known = Vec::new();
    collect(named, &mut known);
    for inner in known {
        let name = name(inner).replace("/msg/", "/");
        text += &format!("{RULE}\nMSG: {name}\n{}", definition(inner)?);
    }
    Ok(text)
}

/// The structs within a type, each once.
fn collect(named: &'static NamedType, known: &mut Vec<&'static NamedType>) {
    match named.ty {
        DataModelType::Option(inner) | DataModelType::NewtypeStruct(inner) => found(inner, known),
        DataModelType::Tuple(items) => items.iter().for_each(|item| found(item, known)),
        DataModelType::Struct(fields) => {
            fields.iter().for_each(|field| found(field.ty, known));
        }
        _ => {}
    }
}

fn found(named: &'static NamedType, known: &mut Vec<&'static NamedType>) {
    if matches!(named.ty, DataModelType::Struct(_)) {
        if known.contains(&named) {
            return;
        }
        known.push(named);
    }
    collect(named, known);
}

fn definition(named: &'static NamedType) -> Result<String, &'static str> {
    let DataModelType::Struct(fields) = named.ty else {
        return Err(named.name);
    };
    let mut text = comment(&item(named.name).unwrap_or_default());
    if named.name == "LogRow" {
        for (level, number) in LEVELS {
            text += &format!("byte {level}={number}\n");
        }
    }
    for field in *fields {
        let of = unwrapped(field.ty);
        let (kind, is_optional) = match of.ty {
            DataModelType::Option(inner) => (unwrapped(inner), true),
            _ => (of, false),
        };
        text += &comment(&described(named.name, field.name).unwrap_or_default());
        if is_optional {
            text += &format!("bool has_{}\n", field.name);
        }
        let (item, count) = match kind.ty {
            DataModelType::Tuple(items) => {
                let first = items.first().ok_or(named.name)?;
                (unwrapped(first), format!("[{}]", items.len()))
            }
            _ => (kind, String::new()),
        };
        if let DataModelType::Enum(variants) = item.ty {
            text += &constants(field.name, item.name, variants)?;
        }
        text += &format!("{}{count} {}\n", kind_name(item)?, field.name);
    }
    Ok(text)
}

fn unwrapped(named: &'static NamedType) -> &'static NamedType {
    match named.ty {
        DataModelType::NewtypeStruct(inner) => unwrapped(inner),
        _ => named,
    }
}

fn kind_name(named: &'static NamedType) -> Result<String, &'static str> {
    let name = match named.ty {
        DataModelType::Bool => "bool",
        DataModelType::I8 => "int8",
        DataModelType::I16 => "int16",
        DataModelType::I32 => "int32",
        DataModelType::I64 => "int64",
        DataModelType::U8 | DataModelType::Enum(_) => "uint8",
        DataModelType::U16 => "uint16",
        DataModelType::U32 => "uint32",
        DataModelType::U64 => "uint64",
        DataModelType::F32 => "float32",
        DataModelType::F64 => "float64",
        DataModelType::String => "string",
        DataModelType::Struct(_) => return Ok(name(named).replace("/msg/", "/")),
        _ => return Err(named.name),
    };
    Ok(name.to_owned())
}

/// A constant for each variant: the field's name, then the variant's.
fn constants(
    field: &str,
    name: &'static str,
    variants: &'static [&'static postcard_schema::schema::NamedVariant],
) -> Result<String, &'static str> {
    let mut text = String::new();
    for (at, variant) in variants.iter().enumerate() {
        let DataModelVariant::UnitVariant = variant.ty else {
            return Err(name);
        };
        let constant = format!("{}_{}", field.to_uppercase(), upper(variant.name));
        let told = described(name, variant.name).unwrap_or_default();
        text += &format!("uint8 {constant}={at}  # {told}\n");
    }
    Ok(text)
}

/// `StickSlip` as `STICK_SLIP`.
fn upper(name: &str) -> String {
    let mut upper = String::new();
    for (at, c) in name.chars().enumerate() {
        if at > 0 && c.is_ascii_uppercase() {
            upper.push('_');
        }
        upper.extend(c.to_uppercase());
    }
    upper
}

/// A text as lines of comment.
fn comment(text: &str) -> String {
    let mut lines = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        if !line.is_empty() && line.chars().count() + word.chars().count() > WIDTH {
            lines += &format!("#{line}\n");
            line.clear();
        }
        line += &format!(" {word}");
    }
    if !line.is_empty() {
        lines += &format!("#{line}\n");
    }
    lines
}

/// A value of the type, as JSON writes it, in the form of its schema.
pub fn outward(named: &'static NamedType, value: &Value) -> Value {
    match (named.ty, value) {
        (DataModelType::NewtypeStruct(inner), _) => outward(inner, value),
        (DataModelType::Struct(fields), Value::Object(from)) => {
            let mut map = Map::new();
            for field in *fields {
                let value = from.get(field.name);
                let kind = match field.ty.ty {
                    DataModelType::Option(inner) => {
                        // A number that is none is null, and yet there.
                        let may_be_null =
                            matches!(unwrapped(inner).ty, DataModelType::F32 | DataModelType::F64);
                        let value = value.filter(|value| may_be_null || !value.is_null());
                        map.insert(format!("has_{}", field.name), value.is_some().into());
                        inner
                    }
                    _ => field.ty,
                };
                if let Some(value) = value {
                    map.insert(field.name.to_owned(), outward(kind, value));
                }
            }
            Value::Object(map)
        }
        (DataModelType::Tuple(items), Value::Array(values)) => items
            .iter()
            .zip(values)
            .map(|(item, value)| outward(item, value))
            .collect(),
        (DataModelType::Enum(variants), Value::String(name)) => variants
            .iter()
            .position(|variant| variant.name == name)
            .into(),
        _ => value.clone(),
    }
}

/// A value in the form of its schema, as JSON writes it. Fields that the type has not are left out; what
/// names no variant of an enum stays a number, which no row takes.
pub fn inward(named: &'static NamedType, value: Value) -> Value {
    match (named.ty, value) {
        (DataModelType::NewtypeStruct(inner), value) => inward(inner, value),
        (DataModelType::Struct(fields), Value::Object(mut from)) => {
            let mut map = Map::new();
            for field in *fields {
                let kind = match field.ty.ty {
                    DataModelType::Option(inner) => {
                        let flag = from.get(&format!("has_{}", field.name));
                        if flag.and_then(Value::as_bool) != Some(true) {
                            continue;
                        }
                        inner
                    }
                    _ => field.ty,
                };
                if let Some(value) = from.remove(field.name) {
                    map.insert(field.name.to_owned(), inward(kind, value));
                }
            }
            Value::Object(map)
        }
        (DataModelType::Tuple(items), Value::Array(values)) => items
            .iter()
            .zip(values)
            .map(|(item, value)| inward(item, value))
            .collect(),
        (DataModelType::Enum(variants), Value::Number(number)) => {
            let at = number.as_u64().and_then(|at| usize::try_from(at).ok());
            let variant = at.and_then(|at| variants.get(at));
            variant.map_or(Value::Number(number), |variant| variant.name.into())
        }
        (_, value) => value,
    }
}

/// Why a row's shape makes no schema.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum SchemaError {
    #[error("{0} has no place in a recording")]
    Shape(&'static str),
    #[error("{0}: {1}")]
    Definition(String, #[source] DefinitionError),
}

/// Why a row can't be said.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum SayError {
    #[error(transparent)]
    Value(#[from] serde_json::Error),
    #[error(transparent)]
    Bytes(#[from] EncodeError),
}

/// A channel, and how what is said on it is written.
#[derive(Clone, Debug)]
pub struct ChannelSchema {
    /// Its topic.
    pub topic: String,
    /// The type of its messages, `package/msg/Name`.
    pub schema_name: String,
    /// Their definition, in `ros2msg`.
    pub schema: String,
    definition: Definition,
}

/// Writes entries as CDR, one channel for each of [`CHANNELS`].
#[derive(Clone, Debug)]
pub struct CdrEncoder {
    channels: Vec<ChannelSchema>,
}

impl CdrEncoder {
    /// With all schemas. Fails if a row's shape makes none.
    pub fn new() -> Result<Self, SchemaError> {
        let channels = CHANNELS.into_iter().map(|(role, kind)| {
            let shape = kind.shape();
            let name = name(shape);
            let schema = schema(shape).map_err(SchemaError::Shape)?;
            match Definition::parse(&name, &schema) {
                Ok(definition) => Ok(ChannelSchema {
                    topic: topic(role, kind),
                    schema_name: name,
                    schema,
                    definition,
                }),
                Err(source) => Err(SchemaError::Definition(name, source)),
            }
        });
        Ok(Self {
            channels: channels.collect::<Result<_, _>>()?,
        })
    }

    /// All channels, in their order.
    pub fn channels(&self) -> &[ChannelSchema] {
        &self.channels
    }

    /// Appends an entry's message to `out`; the index of its channel, none if that board says no such things. Fails
    /// if the row is not as its own schema says.
    pub fn encode(&self, entry: &Entry, out: &mut Vec<u8>) -> Result<Option<usize>, SayError> {
        let kind = entry.row.kind();
        let Some(at) = channel(entry.role, kind) else {
            return Ok(None);
        };
        let value = outward(kind.shape(), &entry.row.value()?);
        encode(&self.channels[at].definition, &value, out)?;
        Ok(Some(at))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use ros2msg::Definition;

    use super::super::row::CHANNELS;
    use super::*;

    #[test]
    fn every_row_has_a_schema_and_every_field_of_it_a_description() {
        let mut names = BTreeMap::new();
        for (_, kind) in CHANNELS {
            let shape = kind.shape();
            let text = schema(shape).unwrap_or_else(|name| panic!("{name} has no place"));
            Definition::parse(&name(shape), &text).unwrap_or_else(|error| panic!("{error}"));
            let mut known = vec![shape];
            collect(shape, &mut known);
            for named in known {
                // Two types of one name would be one in ROS 2.
                let other = names.insert(name(named), named);
                assert!(other.is_none_or(|other| other == named), "{}", named.name);
                let DataModelType::Struct(fields) = named.ty else {
                    panic!("{} is no struct", named.name);
                };
                assert!(
                    item(named.name).is_some(),
                    "no description of {}",
                    named.name
                );
                for field in *fields {
                    let told = described(named.name, field.name);
                    assert!(
                        told.is_some(),
                        "no description of {}.{}",
                        named.name,
                        field.name
                    );
                }
            }
        }
    }

    #[test]
    fn names_are_such_as_ros_allows() {
        for (_, kind) in CHANNELS {
            let text = schema(kind.shape()).expect("a schema");
            for line in text
                .lines()
                .filter(|line| !line.starts_with(['#', '=', 'M']))
            {
                let bare = line.split("  #").next().unwrap_or(line);
                let (_, name) = bare.split_once(' ').expect("a kind and a name");
                let is_constant = name.contains('=');
                let name = name.split('=').next().unwrap_or(name);
                let fits = |c: char| {
                    c == '_'
                        || c.is_ascii_digit()
                        || (if is_constant {
                            c.is_ascii_uppercase()
                        } else {
                            c.is_ascii_lowercase()
                        })
                };
                assert!(name.chars().all(fits) && !name.contains("__"), "{line}");
                assert!(!name.ends_with('_'), "{line}");
                assert!(
                    name.starts_with(|c: char| c.is_ascii_alphabetic()),
                    "{line}"
                );
            }
        }
    }
}
