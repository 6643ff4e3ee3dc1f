//! Texts and numbers as rows have them: texts with a shape, and numbers that may be none.

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, NamedType};
use serde::{Deserialize, Deserializer, Serialize};

/// A text.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Text(pub String);

impl Schema for Text {
    const SCHEMA: &'static NamedType = &NamedType {
        name: "Text",
        ty: &DataModelType::String,
    };
}

impl<T: Into<String>> From<T> for Text {
    fn from(text: T) -> Self {
        Self(text.into())
    }
}

/// A number; null is NaN, which JSON has not.
pub fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f32::NAN))
}

/// A number that is there; null is NaN. To be used with `default`: a number that is not there is none.
pub fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f32>, D::Error> {
    number(deserializer).map(Some)
}
