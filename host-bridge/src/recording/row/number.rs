//! Numbers that are none: JSON has no NaN and writes null.

use serde::{Deserialize, Deserializer};

/// A number; null is NaN.
pub fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f32::NAN))
}

/// A number that is there; null is NaN. To be used with `default`: a number that is not there is none.
pub fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f32>, D::Error> {
    number(deserializer).map(Some)
}
