//! Rows of any experiment: what its records are as JSON, and how a value of theirs is written.
//!
//! The keys of an object in a record come after the outer key: `failure_time`.

use crate::notation::{number, plain};
use crate::settings::distinct;
use crate::table::nanoseconds;
use serde_json::{Map, Value};

/// A row: columns in order.
pub type Row = Map<String, Value>;

pub fn number_of(row: &Row, key: &str) -> Option<f64> {
    row.get(key).and_then(Value::as_f64)
}

/// A text of a row; an empty one where it has none.
pub fn text_of<'a>(row: &'a Row, key: &str) -> &'a str {
    row.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// The limit of iterations of a row, after those that it took where these are fewer; nothing of direct solvers.
pub fn iterations(row: &Row) -> String {
    let [limit, used] = ["iterations", "iterations_used"].map(|key| number_of(row, key));
    match (limit, used) {
        (None | Some(0.0), _) => String::new(),
        (Some(limit), Some(used)) if used < limit => format!("{used:.0} of {limit}"),
        (Some(limit), _) => limit.to_string(),
    }
}

/// True for a direct solver and for an iteration that stopped before its limit.
pub fn has_ended(row: &Row) -> bool {
    let [limit, used] = ["iterations", "iterations_used"].map(|key| number_of(row, key));
    limit == Some(0.0) || used < limit
}

/// True if the key holds `true`.
pub fn is(row: &Row, key: &str) -> bool {
    row.get(key) == Some(&Value::Bool(true))
}

/// True if `error` is null or absent.
pub fn has_no_error(row: &Row) -> bool {
    row.get("error").is_none_or(Value::is_null)
}

/// The rows of the list with that name, wherever it is; an empty name means the data itself.
pub fn rows_of(data: &Value, list: &str) -> Vec<Row> {
    match data {
        Value::Array(items) if list.is_empty() => items.iter().filter_map(flat).collect(),
        Value::Array(items) => items.iter().flat_map(|item| rows_of(item, list)).collect(),
        _ if list.is_empty() => Vec::new(),
        data => data
            .get(list)
            .map(|own| rows_of(own, ""))
            .unwrap_or_default(),
    }
}

/// An object as a row.
fn flat(item: &Value) -> Option<Row> {
    let mut row = Row::new();
    flatten("", item.as_object()?, &mut row);
    Some(row)
}

/// Columns of an object, those of objects in it with the outer key before theirs; no lists of rows.
pub fn flatten(before: &str, object: &Row, row: &mut Row) {
    for (key, value) in object {
        let name = format!("{before}{key}");
        match value {
            Value::Object(inner) => flatten(&format!("{name}_"), inner, row),
            value if is_list(value) => {}
            value => {
                row.insert(name, value.clone());
            }
        }
    }
}

/// True for an array with an object in it and for the empty array.
pub fn is_list(value: &Value) -> bool {
    let items = value.as_array();
    items.is_some_and(|items| items.is_empty() || items.iter().any(Value::is_object))
}

pub fn words(key: &str) -> String {
    key.replace('_', " ")
}

/// True if the key's values are in nanoseconds.
fn is_time(key: &str) -> bool {
    key.split('_').any(|word| word == "ns")
}

/// Writes rows as CSV: a column for each key, nothing where a row has no value.
pub fn csv(rows: &[Row], out: &mut dyn std::io::Write) -> std::io::Result<()> {
    let keys = distinct(rows.iter().flat_map(Map::keys));
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(&keys)?;
    let shown = |value: &Value| match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        value => value.to_string(),
    };
    for row in rows {
        let cells = keys
            .iter()
            .map(|key| row.get(*key).map_or_else(String::new, shown));
        writer.write_record(cells)?;
    }
    writer.flush()
}

/// Column heading with its unit. Nanoseconds carry theirs in each cell.
pub fn heading(key: &str) -> String {
    let unit =
        |suffix: &str, unit: &str| Some(format!("{} ({unit})", words(key.strip_suffix(suffix)?)));
    match key {
        "dt" => "Δt (s)".to_owned(),
        "ns" => "time".to_owned(),
        "length" => "length (m)".to_owned(),
        "first_failure_time" => "first failure (s)".to_owned(),
        key if is_time(key) => words(&key.replace("_ns", "")),
        key => unit("_m", "m")
            .or_else(|| unit("_s", "s"))
            .or_else(|| unit("_j", "J"))
            .unwrap_or_else(|| words(key)),
    }
}

/// A value in prose, where powers of ten are written as such.
pub fn shown(key: &str, value: &Value) -> String {
    match value.as_f64() {
        Some(n) if !is_time(key) => number(n),
        _ => text(key, value),
    }
}

/// Most values of a list that are shown in a cell.
const MOST_VALUES: usize = 4;

/// A value below its heading.
pub fn text(key: &str, value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(n) => match (n.as_u64(), n.as_f64().unwrap_or(f64::NAN)) {
            (_, ns) if is_time(key) => nanoseconds(ns),
            (Some(whole), _) if whole < 100_000 => whole.to_string(),
            (_, number) => plain(number),
        },
        Value::Array(values) if values.len() > MOST_VALUES => format!("{} values", values.len()),
        Value::Array(values) => {
            let texts: Vec<String> = values.iter().map(|value| text(key, value)).collect();
            texts.join(", ")
        }
        Value::Object(_) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn csv_holds_every_key() {
        let mut out = Vec::new();
        csv(
            &rows_of(
                &json!([{ "a": 1.5, "b": { "c": "x,y" } }, { "a": null }]),
                "",
            ),
            &mut out,
        )
        .expect("written");
        let found = String::from_utf8(out).expect("text");
        assert_eq!(found, "a,b_c\n1.5,\"x,y\"\n,\n");
    }
}
