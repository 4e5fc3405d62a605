//! Limits that may be infinite, in formats with finite numbers only (JSON): infinity is written as
//! none.
//!
//! For fields: `#[serde(with = "taut_model::unlimited")]`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Writes a limit; infinity is `None`.
///
/// # Errors
/// The serializer's.
pub fn serialize<S: Serializer>(limit: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    Some(*limit)
        .filter(|x| *x != f64::INFINITY)
        .serialize(serializer)
}

/// Reads a limit; `None` is infinity.
///
/// # Errors
/// The deserializer's.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// True if the number is +0, bit for bit: what a text leaves out.
pub(crate) fn is_zero(number: &f64) -> bool {
    number.to_bits() == 0
}
