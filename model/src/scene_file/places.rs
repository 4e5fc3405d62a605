//! Where in its text a fault stands: faults are found while building, long after the text was read.
//!
//! A place is a path of keys and numbers from 0, such as `joint.2.point_a`. The text is kept as it was read and looked
//! at again only when something is wrong, so that a sound scene costs nothing but the memory of its text.

use toml::de::{DeTable, DeValue};

use super::{SceneSource, SceneText, fault_at, keys, one_line, write};
use crate::error::SceneError;

/// A fault with the paths of the keys that it may stand at, the likeliest first.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) paths: Vec<String>,
    pub(super) error: SceneError,
}

impl Fault {
    pub(super) fn new(path: impl Into<String>, error: SceneError) -> Self {
        let paths = vec![path.into()];
        Self { paths, error }
    }

    /// A fault at one of some keys.
    pub(super) fn at(keys: &[&str], error: SceneError) -> Self {
        let paths = keys.iter().map(|key| (*key).to_owned()).collect();
        Self { paths, error }
    }

    /// A fault of what was validated, at the key that the name of the quantity ends with.
    pub(super) fn named(error: SceneError) -> Self {
        let (SceneError::BadValue { what, .. } | SceneError::Conflict { what, .. }) = &error else {
            return Self::at(&[], error);
        };
        let key = what.rsplit(' ').next().unwrap_or_default().to_owned();
        // What has no quantity ends with a name.
        if key.contains('`') {
            return Self::at(&[], error);
        }
        Self::new(key, error)
    }

    /// Adds `path` as another place of the fault.
    pub(super) fn or_at(mut self, path: &str) -> Self {
        self.paths.push(path.to_owned());
        self
    }

    /// Puts the fault into the entry at `path`.
    pub(super) fn within(mut self, path: &str) -> Self {
        for inner in &mut self.paths {
            *inner = format!("{path}.{inner}");
        }
        if self.paths.is_empty() {
            self.paths.push(path.to_owned());
        }
        self
    }
}

/// Does something with each entry of a list, in which its faults then stand.
pub(super) fn each<'a, T>(
    list: &str,
    entries: &'a [T],
    mut with: impl FnMut(usize, &'a T) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut numbered = entries.iter().enumerate();
    numbered.try_for_each(|(i, entry)| {
        with(i, entry).map_err(|fault| fault.within(&format!("{list}.{i}")))
    })
}

/// The text and the overrides that a scene was read from. No part of the scene: any two are equal.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    text: String,
    overrides: Vec<(String, String)>,
}

impl PartialEq for Places {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Places {
    pub(super) fn new(text: &str, overrides: &[(&str, &str)]) -> Self {
        let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        Self {
            text: text.to_owned(),
            overrides: overrides.iter().map(owned).collect(),
        }
    }

    /// The fault of `scene` with its line and key, or the override that brought it in.
    pub(super) fn located(&self, scene: &SceneText, fault: Fault) -> SceneError {
        // A scene that was changed after it was read has no lines any more. Compared as text, for NaN's sake.
        let count = self.overrides.len();
        let same = |read: &SceneText| {
            write::explicit(read, false).ok() == write::explicit(scene, false).ok()
        };
        if !self.read(count).is_some_and(|read| same(&read)) {
            return fault.error;
        }
        let sound = |n: &usize| self.read(*n).is_some_and(|s| s.assemble().is_ok());
        if let Some(last_sound) = (0..count).rev().find(sound) {
            return SceneError::Override {
                key: self.overrides[last_sound].0.clone(),
                message: one_line(&fault.error.to_string()),
            };
        }
        let found: Vec<_> = fault.paths.iter().map(|p| locate(&self.text, p)).collect();
        let exact = found.iter().position(|place| matches!(place, (_, true)));
        let best = exact.unwrap_or(0);
        let Some((Some(start), _)) = found.get(best) else {
            return fault.error;
        };
        let (line, column) = line_column(&self.text, *start);
        let key = fault.paths[best].rsplit('.').find(|part| !is_number(part));
        SceneError::InText {
            line,
            column,
            key: key.unwrap_or_default().to_owned(),
            fault: Box::new(fault.error),
        }
    }

    /// The scene as read with the first `n` overrides.
    fn read(&self, n: usize) -> Option<SceneText> {
        let overrides = self.overrides[..n].iter();
        let overrides: Vec<_> = overrides.map(|(k, v)| (k.as_str(), v.as_str())).collect();
        match SceneSource::parse(&self.text, &overrides) {
            Ok(SceneSource::Explicit(scene)) => Some(*scene),
            _ => None,
        }
    }
}

fn is_number(part: &str) -> bool {
    part.parse::<usize>().is_ok()
}

/// Byte at which the key of `path` starts, or else the innermost part of it that is there; and whether all of it is.
fn locate(text: &str, path: &str) -> (Option<usize>, bool) {
    let Ok(root) = DeTable::parse(text) else {
        return (None, false);
    };
    let (mut table, mut list) = (Some(root.get_ref()), None);
    let mut start = None;
    for part in path.split('.') {
        let found = match (table, list) {
            (Some(table), _) => key_value(table, part),
            (None, Some(list)) => part.parse().ok().and_then(|i| item(list, i)),
            (None, None) => None,
        };
        let Some((at, value)) = found else {
            return (start, false);
        };
        start = Some(at);
        (table, list) = (value.as_table(), Some(value));
    }
    (start, true)
}

fn key_value<'a>(table: &'a DeTable<'_>, key: &str) -> Option<(usize, &'a DeValue<'a>)> {
    let found = table.iter().find(|(k, _)| k.get_ref().as_ref() == key);
    found.map(|(k, v)| (k.span().start, v.get_ref()))
}

fn item<'a>(list: &'a DeValue<'_>, i: usize) -> Option<(usize, &'a DeValue<'a>)> {
    let value = list.as_array()?.get(i)?;
    Some((value.span().start, value.get_ref()))
}

/// Line and column from 1 of the byte `at`, columns in characters.
pub(super) fn line_column(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    (line, column)
}

/// A reader's error with its place, the key that it is about, and a cure where the reader gives none.
pub(super) fn located(error: &toml::de::Error, text: &str) -> SceneError {
    let mut message = one_line(error.message());
    let start = error.span().map(|span| span.start);
    if message.starts_with("missing field") {
        message.push_str(": add it");
    } else if message == "duplicate key" {
        let key = error.span().and_then(|span| text.get(span));
        message = format!("the key `{}` is there twice: remove one", key.unwrap_or(""));
    } else if message.starts_with("unknown field `through`") {
        message.push_str(" (a cable through points without mass is a [[massless_cable]])");
    } else if let Some(list) = single(text, start) {
        message = format!("`{list}` is a list of tables: write [[{list}]]");
    } else if let Some(start) = start
        && let Ok(root) = DeTable::parse(text)
        && let Some(key) = key_around(root.get_ref(), start)
    {
        message = crate::error::naming(message, &key);
    }
    fault_at(start, text, &message)
}

/// The list of an explicit scene that the text has as one table, which starts at the byte `at`.
fn single(text: &str, at: Option<usize>) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let mut tables = root
        .get_ref()
        .iter()
        .filter(|(_, v)| v.get_ref().is_table());
    let (list, _) = tables.find(|(_, table)| at == Some(table.span().start))?;
    let list: &str = list.get_ref().as_ref();
    keys::LISTS
        .iter()
        .any(|(known, _)| *known == list)
        .then(|| list.to_owned())
}

/// The key whose value holds the byte `at`.
fn key_around(table: &DeTable<'_>, at: usize) -> Option<String> {
    fn within(value: &DeValue<'_>, at: usize) -> Option<String> {
        match value {
            DeValue::Table(table) => key_around(table, at),
            DeValue::Array(list) => list.iter().find_map(|v| within(v.get_ref(), at)),
            _ => None,
        }
    }
    table.iter().find_map(|(key, value)| {
        // The span of a list of tables, or of a table, says nothing: only what is inside counts.
        let plain = !value.get_ref().is_table() && !is_list_of_tables(value.get_ref());
        let here = plain && value.span().contains(&at);
        within(value.get_ref(), at).or_else(|| here.then(|| key.get_ref().as_ref().to_owned()))
    })
}

fn is_list_of_tables(value: &DeValue<'_>) -> bool {
    let first = value.as_array().and_then(|list| list.iter().next());
    first.is_some_and(|v| v.get_ref().is_table())
}
