//! How what has no form of its own is written with `serde`: NaN, and backends.

use crate::Backend;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number, or none for NaN, for formats that know finite numbers alone.
pub(crate) mod number_or_none {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    // The form that serde's `with` wants.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    pub(crate) fn serialize<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        (!x.is_nan()).then_some(x).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
    }
}

impl Serialize for Backend {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Backend {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}
