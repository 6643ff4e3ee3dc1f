//! From entries to messages of ROS 2, for whatever takes them: a file, or who watches.

use ros2msg::{Definition, DefinitionError, EncodeError, encode};

use super::ros2;
use super::row::{CHANNELS, channel, topic};
use super::row_builder::Entry;

/// Why a row's shape makes no schema.
#[derive(Debug, thiserror::Error)]
pub enum SchemaError {
    /// A type has no place in a recording.
    #[error("{0} has no place in a recording")]
    Shape(&'static str),
    /// What was made of the shape is no definition.
    #[error("{0}: {1}")]
    Definition(String, #[source] DefinitionError),
}

/// Why a row can't be said.
#[derive(Debug, thiserror::Error)]
pub enum SayError {
    /// It can't be said in JSON.
    #[error(transparent)]
    Value(#[from] serde_json::Error),
    /// It is not as its schema says.
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
            let name = ros2::name(shape);
            let schema = ros2::schema(shape).map_err(SchemaError::Shape)?;
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
        let value = ros2::outward(kind.shape(), &entry.row.value()?);
        encode(&self.channels[at].definition, &value, out)?;
        Ok(Some(at))
    }
}
