//! Overrides `KEY=VALUE`, merged into a text before its keys are checked.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

use super::places::located;
use super::{one_line, whole_of};
use crate::error::SceneError;

/// Merges the overrides into `table` and deserialises it. When the text alone is sound, the overrides are tried one
/// after the other, so that the one at fault can be named.
pub(super) fn merge<T: DeserializeOwned>(
    text: &str,
    table: &mut Table,
    overrides: &[(&str, &str)],
) -> Result<T, SceneError> {
    let read = toml::from_str::<T>(text).map_err(|e| located(&e, text));
    // A reader of text leaves the rest of a list that is too long; one of values does not.
    let mut scene = match (read, table.clone().try_into::<T>()) {
        (Ok(_), Err(e)) => Err(SceneError::Toml {
            place: None,
            message: one_line(&e.to_string()),
        }),
        (read, _) => read,
    };
    let sound = scene.is_ok();
    for (key, value) in overrides {
        let at_fault = |message: String| SceneError::Override {
            key: (*key).to_owned(),
            message,
        };
        let value = value
            .parse::<Value>()
            .unwrap_or_else(|_| Value::String((*value).to_owned()));
        insert(table, key, value).map_err(at_fault)?;
        if sound {
            let read = table.clone().try_into::<T>();
            scene = Ok(read.map_err(|e| at_fault(one_line(e.message())))?);
        }
    }
    if !sound && !overrides.is_empty() {
        // The overrides may have mended the text; if not, the text's own error knows the line.
        return table.clone().try_into::<T>().or(scene);
    }
    scene
}

/// Puts `value` at the path `key`. Entries of lists are found by their `name` or their number.
fn insert(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    let mut parts: Vec<&str> = key.trim().split('.').map(str::trim).collect();
    let whole = whole_of(table);
    if let Some((whole, _)) = &whole
        && parts[0] != whole
    {
        parts.insert(0, whole);
    }
    let Some((last, path)) = parts.split_last() else {
        return Err("the key is empty".into());
    };
    let mut parts = path.iter();
    let mut here = table;
    while let Some(part) = parts.next() {
        here = match here.get_mut(*part) {
            Some(Value::Table(inner)) => inner,
            Some(Value::Array(list)) => {
                let Some(name) = parts.next() else {
                    return Err(format!("say which entry: {part}.NAME.{last}"));
                };
                let index = position(list, name)
                    .ok_or_else(|| format!("`{part}` has no entry called `{name}`"))?;
                match &mut list[index] {
                    Value::Table(inner) => inner,
                    _ => return Err(format!("`{part}.{name}` has no keys")),
                }
            }
            Some(_) => return Err(format!("`{part}` has no keys")),
            None => return Err(format!("there is no `{part}` to hold `{last}`")),
        };
    }
    here.insert((*last).to_owned(), value);
    Ok(())
}

fn position(list: &[Value], name: &str) -> Option<usize> {
    let named = |entry: &Value| entry.get("name").and_then(Value::as_str) == Some(name);
    let by_number = || name.parse().ok().filter(|i| *i < list.len());
    list.iter().position(named).or_else(by_number)
}
