//! Scenes as TOML text for people: keys in the order of the documentation, one a line, each with its meaning.

use serde::Serialize;
use std::fmt::Write;
use toml::{Table, Value};

use super::keys::{self, Described, Key};
use super::{SceneSource, SceneText, unwritten};
use crate::error::SceneError;
use crate::params::Parameters;

/// Columns that comments are wrapped at.
const WIDTH: usize = 110;

/// A scene's own parameters, in the table `name`, with every key: those that are not given are comments. Keys that the
/// scene has no use for are left out, unless they have another value than by default, for the text to read back.
pub(super) fn commented<P: Parameters + Serialize + Default>(
    source: &SceneSource,
    parameters: &P,
) -> Result<String, SceneError> {
    let (default, table) = (table(&P::default())?, table(parameters)?);
    let name = parameters.scene_name();
    let mut out = String::new();
    comment(&mut out, &keys::about(source));
    let _ = writeln!(out, "[{name}]");
    for key in keys::of_source(source) {
        let value = table.get(&key.name);
        if value == default.get(&key.name) && !keys::has_use(name, &key) {
            continue;
        }
        comment(&mut out, &key.meaning);
        match value {
            Some(value) => line(&mut out, &key.name, value),
            None => _ = writeln!(out, "# {} =    (not given)", key.name),
        }
    }
    Ok(out)
}

/// An explicit scene; with comments the keys of each list are explained before its first entry.
pub(super) fn explicit(scene: &SceneText, comments: bool) -> Result<String, SceneError> {
    let mut table = table(scene)?;
    let lists = keys::LISTS.map(|(list, keys)| (list, keys, table.remove(list)));
    let mut out = String::new();
    for (key, value) in ordered(&table, &keys::of(SceneText::KEYS)) {
        if comments {
            comment(&mut out, &key.meaning);
        }
        line(&mut out, &key.name, value);
    }
    for (list, keys, entries) in lists {
        let Some(Value::Array(entries)) = entries else {
            continue;
        };
        let known = keys::of(keys);
        if comments && !entries.is_empty() {
            out.push('\n');
            for key in &known {
                if entries.iter().any(|entry| entry.get(&key.name).is_some()) {
                    comment(&mut out, &format!("{}: {}", key.name, key.meaning));
                }
            }
        }
        for entry in entries.iter().filter_map(Value::as_table) {
            let _ = writeln!(out, "\n[[{list}]]");
            for (key, value) in ordered(entry, &known) {
                line(&mut out, &key.name, value);
            }
        }
    }
    Ok(out)
}

/// The keys and values that are there, in the order of `known`.
fn ordered<'a>(table: &'a Table, known: &'a [Key]) -> impl Iterator<Item = (&'a Key, &'a Value)> {
    known
        .iter()
        .filter_map(|key| Some((key, table.get(&key.name)?)))
}

fn table(value: &impl Serialize) -> Result<Table, SceneError> {
    Table::try_from(value).map_err(|e| unwritten(&e))
}

fn line(out: &mut String, key: &str, value: &Value) {
    let _ = writeln!(out, "{key} = {}", inline(value));
}

/// A value on one line. Numbers in the fewest digits that read back to the same bits.
fn inline(value: &Value) -> String {
    match value {
        Value::Float(x) if x.is_finite() => format!("{x:?}"),
        Value::Array(list) => {
            let items: Vec<String> = list.iter().map(inline).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Table(table) => {
            let items = table
                .iter()
                .map(|(key, item)| format!("{key} = {}", inline(item)));
            format!("{{ {} }}", items.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

/// `text` as comment lines.
fn comment(out: &mut String, text: &str) {
    let mut width = 0;
    for word in text.split_whitespace() {
        let length = word.chars().count() + 1;
        if width == 0 || width + length > WIDTH {
            out.push_str(if width == 0 { "#" } else { "\n#" });
            width = 1;
        }
        let _ = write!(out, " {word}");
        width += length;
    }
    out.push_str(if width == 0 { "" } else { "\n" });
}
