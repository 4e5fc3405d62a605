//! Records as JSON.

use ciborium::value::{Error, Value as Cbor};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Number, Value as Json};

/// A record as JSON, which knows no NaN and no infinity: they are texts that begin with `#`; a text that begins with one has
/// another before it. All bits of finite numbers are kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Record(pub(super) Json);

impl Record {
    pub(super) fn of(record: &impl Serialize) -> Result<Self, String> {
        let value = Cbor::serialized(record).map_err(|e| e.to_string())?;
        Ok(Self(json(value)?))
    }

    pub(super) fn read<T: DeserializeOwned>(&self) -> Result<T, String> {
        cbor(&self.0).deserialized().map_err(|e| match e {
            Error::Custom(why) => why,
        })
    }
}

fn json(value: Cbor) -> Result<Json, String> {
    Ok(match value {
        Cbor::Null => Json::Null,
        Cbor::Bool(is) => Json::Bool(is),
        Cbor::Integer(i) => {
            Json::Number(Number::from_i128(i.into()).ok_or("an integer is too large")?)
        }
        Cbor::Float(x) => {
            Number::from_f64(x).map_or_else(|| Json::String(format!("#{x}")), Json::Number)
        }
        Cbor::Text(text) if text.starts_with('#') => Json::String(format!("#{text}")),
        Cbor::Text(text) => Json::String(text),
        Cbor::Array(list) => Json::Array(list.into_iter().map(json).collect::<Result<_, _>>()?),
        Cbor::Map(fields) => {
            let field = |(key, value): (Cbor, Cbor)| {
                Ok::<_, String>((
                    key.into_text().map_err(|_| "a key is no text")?,
                    json(value)?,
                ))
            };
            Json::Object(fields.into_iter().map(field).collect::<Result<_, _>>()?)
        }
        _ => return Err("it holds bytes".to_owned()),
    })
}

fn cbor(value: &Json) -> Cbor {
    match value {
        Json::Null => Cbor::Null,
        Json::Bool(is) => Cbor::Bool(*is),
        Json::Number(x) => match (x.as_u64(), x.as_i64()) {
            (Some(i), _) => Cbor::Integer(i.into()),
            (_, Some(i)) => Cbor::Integer(i.into()),
            _ => x.as_f64().map_or(Cbor::Null, Cbor::Float),
        },
        Json::String(text) => match text.strip_prefix('#') {
            Some(rest) if !rest.starts_with('#') => rest
                .parse()
                .map_or_else(|_| Cbor::Text(text.clone()), Cbor::Float),
            rest => Cbor::Text(rest.unwrap_or(text).to_owned()),
        },
        Json::Array(list) => Cbor::Array(list.iter().map(cbor).collect()),
        Json::Object(fields) => Cbor::Map(
            fields
                .iter()
                .map(|(key, value)| (Cbor::Text(key.clone()), cbor(value)))
                .collect(),
        ),
    }
}
