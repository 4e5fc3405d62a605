//! Tables of any rows: a list of objects is a table, a key is a column, an object in an object is columns of its own, a
//! list in an object a table of its own. What all rows share stands above them.

use super::Other;
use super::cells::{Cell, sortable};
use super::page::{Section, settings};
use super::settings::Setting;
use crate::notation::{number, plain};
use crate::table::nanoseconds;
use maud::html;
use serde_json::{Map, Value};

/// A row: columns in order.
pub(super) type Row = Map<String, Value>;

/// Rows with the name of their list.
type List = (String, Vec<Row>);

/// A table.
pub(super) struct Sheet {
    name: String,
    /// What all rows share, with its heading.
    shared: Vec<Setting>,
    headings: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// What the main list of rows is called.
const RECORDS: &str = "records";

/// The tables of a benchmark.
pub(super) fn sheets(other: &Other) -> Vec<Sheet> {
    let mut lists = Vec::new();
    let items = other.rows.as_array().map_or(&[][..], Vec::as_slice);
    let has_lists = |item: &Value| item.as_object().is_some_and(|o| o.values().any(is_list));
    let is_plain = !items.is_empty() && !items.iter().any(has_lists);
    let name = if is_plain { RECORDS } else { &other.name };
    collect(name, &other.rows, &mut lists);
    lists.into_iter().filter_map(Sheet::of).collect()
}

/// Adds the rows that a value holds to the lists.
fn collect(name: &str, value: &Value, lists: &mut Vec<List>) {
    match value {
        Value::Array(items) => {
            for item in items {
                collect(name, item, lists);
            }
        }
        Value::Object(object) => {
            let mut row = Row::new();
            let mut own = object.values().filter(|value| !is_list(value));
            match (own.next(), own.next()) {
                // What is said of the lists alone needs no name.
                (Some(Value::Object(about)), None) => flatten("", about, &mut row),
                _ => flatten("", object, &mut row),
            }
            if !row.is_empty() {
                match lists.iter_mut().find(|(known, _)| known == name) {
                    Some((_, rows)) => rows.push(row),
                    None => lists.push((name.to_owned(), vec![row])),
                }
            }
            let inner = object.iter().filter(|(_, value)| is_list(value));
            for (key, value) in inner {
                collect(key, value, lists);
            }
        }
        _ => {}
    }
}

/// Whether it is a list of rows, which may have none.
fn is_list(value: &Value) -> bool {
    let items = value.as_array();
    items.is_some_and(|items| items.is_empty() || items.iter().any(Value::is_object))
}

/// Columns of an object, those of objects in it with the outer key before theirs.
fn flatten(before: &str, object: &Row, row: &mut Row) {
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

impl Sheet {
    /// Of a list; nothing where no column has a value.
    fn of((name, rows): List) -> Option<Self> {
        let mut keys: Vec<&String> = Vec::new();
        for key in rows.iter().flat_map(Map::keys) {
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        let nothing = |v: &Value| v.is_null() || v.as_array().is_some_and(Vec::is_empty);
        let filled = |key: &&String| {
            rows.iter()
                .any(|r| r.get(*key).is_some_and(|v| !nothing(v)))
        };
        keys.retain(filled);
        if keys.is_empty() {
            return None;
        }
        // What is long and known from other columns stands at the end.
        keys.sort_by_key(|key| *key == "options");
        let same =
            |key: &&String| rows.len() > 1 && rows.iter().all(|r| r.get(*key) == rows[0].get(*key));
        let (shared, columns): (Vec<&String>, Vec<&String>) = keys.into_iter().partition(same);
        let shared = shared
            .iter()
            .map(|key| (heading(key), shown(key, &rows[0][*key])));
        let has_numbers = |key: &String| {
            rows.iter()
                .any(|r| r.get(key).is_some_and(Value::is_number))
        };
        let numbers: Vec<bool> = columns.iter().map(|key| has_numbers(key)).collect();
        let row = |row: &Row| {
            let cells = columns
                .iter()
                .zip(&numbers)
                .map(|(key, number)| match row.get(*key) {
                    None | Some(Value::Null) if *number => Cell::none(),
                    None => cell(key, &Value::Null),
                    Some(value) => cell(key, value),
                });
            cells.collect()
        };
        Some(Self {
            shared: shared.collect(),
            headings: columns.iter().map(|key| heading(key)).collect(),
            rows: rows.iter().map(row).collect(),
            name,
        })
    }

    /// The table as a part of the page.
    pub(super) fn section(&self) -> Section {
        let title = match self.name.as_str() {
            RECORDS => "All rows".to_owned(),
            "omissions" => "Left out".to_owned(),
            name => {
                let name = words(name);
                let mut letters = name.chars();
                let first = letters.next().map(|c| c.to_ascii_uppercase());
                first.into_iter().chain(letters).collect()
            }
        };
        let body = html! {
            (settings(&self.shared))
            @if !self.headings.is_empty() { (sortable(&self.headings, &self.rows)) }
        };
        Section {
            id: format!("table-{}", self.name),
            title,
            body,
        }
    }
}

/// A key as words.
fn words(key: &str) -> String {
    key.replace('_', " ")
}

/// Whether the key's numbers are nanoseconds.
fn is_time(key: &str) -> bool {
    key.split('_').any(|word| word == "ns")
}

/// What stands above a column. Nanoseconds have their unit in each cell.
pub(super) fn heading(key: &str) -> String {
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
pub(super) fn shown(key: &str, value: &Value) -> String {
    match value.as_f64() {
        Some(n) if !is_time(key) => number(n),
        _ => cell(key, value).text,
    }
}

/// Most values of a list that are shown in a cell.
const MOST_VALUES: usize = 4;

/// A value below its heading.
pub(super) fn cell(key: &str, value: &Value) -> Cell {
    match value {
        Value::Null => Cell::text("–"),
        Value::Bool(true) => Cell::text("yes"),
        Value::Bool(false) => Cell::text("no"),
        Value::String(text) => Cell::text(text.as_str()),
        Value::Number(n) => {
            let number = n.as_f64().unwrap_or(f64::NAN);
            let text = match n.as_u64() {
                _ if is_time(key) => nanoseconds(number),
                Some(whole) if whole < 100_000 => whole.to_string(),
                _ => plain(number),
            };
            Cell::number(text, number)
        }
        Value::Array(values) if values.len() > MOST_VALUES => {
            Cell::text(format!("{} values", values.len()))
        }
        Value::Array(values) => {
            let texts = values.iter().map(|value| cell(key, value).text);
            Cell::text(texts.collect::<Vec<_>>().join(", "))
        }
        Value::Object(_) => Cell::text(""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn texts(sheet: &Sheet) -> Vec<Vec<&str>> {
        let rows = sheet.rows.iter();
        rows.map(|row| row.iter().map(|c| c.text.as_str()).collect())
            .collect()
    }

    #[test]
    fn lists_of_objects_are_tables() {
        let other = Other {
            name: "matrix".to_owned(),
            rows: json!([
                { "about": { "matrix": "a", "dim": 3 }, "records": [
                    { "matrix": "a", "dt": 0.5, "solve_ns": 1500.0, "error": null, "load_m": 0.25 },
                    { "matrix": "a", "dt": 0.5, "solve_ns": null, "error": null, "load_m": 1e-9 },
                ], "omissions": [] },
                { "about": { "matrix": "b", "dim": 4 }, "records": [] },
            ]),
            printed: String::new(),
        };
        let [matrix, records] = &sheets(&other)[..] else {
            panic!("two tables")
        };
        assert_eq!(matrix.headings, ["matrix", "dim"]);
        assert_eq!(texts(matrix), [["a", "3"], ["b", "4"]]);
        assert_eq!(records.headings, ["solve", "load (m)"]);
        assert_eq!(texts(records), [["1.50 µs", "0.25"], ["–", "1e-9"]]);
        let shared =
            [("matrix", "a"), ("Δt (s)", "0.5")].map(|(a, b)| (a.to_owned(), b.to_owned()));
        assert_eq!(records.shared, shared);
    }

    #[test]
    fn what_holds_no_rows_has_no_tables() {
        for rows in [
            json!([]),
            json!({ "records": [] }),
            json!(3),
            json!([[1, 2]]),
            json!([{}]),
        ] {
            let other = Other {
                name: "x".to_owned(),
                rows,
                printed: String::new(),
            };
            assert!(sheets(&other).is_empty());
        }
    }
}
