//! Tables of any rows: a list of objects is a table, a key is a column, an object in an object is columns of its own, a
//! list in an object a table of its own. What all rows share stands above them.

use super::Other;
use super::cells::{Cell, sortable};
use super::markdown::capital;
use super::page::{Section, settings};
use maud::{Markup, html};
use serde_json::{Map, Value};
use taut_output::row::{self, Row, flatten, heading, is_list, rows_of, shown, words};
use taut_output::settings::{Setting, distinct};
use taut_output::sheet::{self, Column};

type List = (String, Vec<Row>);

pub(super) struct Sheet {
    name: String,
    /// Values common to all rows, with their headings.
    shared: Vec<Setting>,
    headings: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// Name of the main list of rows.
const RECORDS: &str = "records";

/// The tables of a benchmark.
pub(super) fn sheets(other: &Other) -> Vec<Sheet> {
    let mut lists = Vec::new();
    let items = other.rows.as_array().map_or(&[][..], Vec::as_slice);
    let has_lists = |item: &Value| item.as_object().is_some_and(|o| o.values().any(is_list));
    let is_plain = !items.is_empty() && !items.iter().any(has_lists);
    let name = if is_plain { RECORDS } else { &other.name };
    collect(name, &other.rows, &mut lists);
    let own = super::study(&other.name).map_or(&[][..], |study| &study.question().sheets);
    let sheets = lists.into_iter().filter_map(|(name, rows)| {
        let is_its = |s: &&sheet::Sheet| s.list == name || (s.list.is_empty() && name == RECORDS);
        let own: Vec<&sheet::Sheet> = own.iter().filter(is_its).collect();
        Sheet::of(name, &rows, &own)
    });
    sheets.collect()
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
                // The only field beside the lists describes them; it needs no name.
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

impl Sheet {
    /// Table of a list; `known` gives headings and best values. `None` if no column has a value.
    fn of(name: String, rows: &[Row], known: &[&sheet::Sheet]) -> Option<Self> {
        let mut keys = distinct(rows.iter().flat_map(Map::keys));
        let nothing = |v: &Value| v.is_null() || v.as_array().is_some_and(Vec::is_empty);
        let filled = |key: &&String| {
            rows.iter()
                .any(|r| r.get(*key).is_some_and(|v| !nothing(v)))
        };
        keys.retain(filled);
        if keys.is_empty() {
            return None;
        }
        // The options are long and follow from other columns: they come last.
        keys.sort_by_key(|key| *key == "options");
        let same =
            |key: &&String| rows.len() > 1 && rows.iter().all(|r| r.get(*key) == rows[0].get(*key));
        let (shared, columns): (Vec<&String>, Vec<&String>) = keys.into_iter().partition(same);
        let shared = shared
            .iter()
            .map(|key| (heading(key), shown(key, &rows[0][*key])));
        let mut cells = vec![Vec::new(); rows.len()];
        let mut headings = Vec::new();
        for key in columns {
            let found = known.iter().find_map(|s| Some((*s, s.column(key)?)));
            headings.push(found.map_or_else(|| heading(key), |(_, column)| column.named()));
            add(found, key, rows, &mut cells);
        }
        Some(Self {
            shared: shared.collect(),
            headings,
            rows: cells,
            name,
        })
    }

    /// The table as a part of the page.
    pub(super) fn section(&self) -> Section {
        let title = match self.name.as_str() {
            RECORDS => "All rows".to_owned(),
            "omissions" => "Left out".to_owned(),
            name => capital(&words(name)),
        };
        let body = html! {
            (settings(&self.shared))
            @if !self.headings.is_empty() { (sortable(&self.headings, &self.rows)) }
        };
        Section::new(format!("table-{}", self.name), title, body)
    }
}

/// Adds the cell of a column to each row, as a sheet writes it that has the column.
fn add(found: Option<(&sheet::Sheet, &Column)>, key: &str, rows: &[Row], cells: &mut [Vec<Cell>]) {
    let best = found.map(|(sheet, column)| sheet.best(column, rows));
    let is_number = |row: &Row| row.get(key).is_some_and(Value::is_number);
    let has_numbers = rows.iter().any(is_number);
    for (i, (row, cells)) in rows.iter().zip(cells).enumerate() {
        let value = row.get(key).unwrap_or(&Value::Null);
        let text = match found {
            Some((_, column)) => column.text(row),
            None => row::text(key, value),
        };
        let is_missing = text == "-" || text == "–";
        cells.push(match value.as_f64() {
            Some(number) => Cell {
                best: best.as_ref().is_some_and(|best| best[i]),
                ..Cell::number(text, number)
            },
            None if is_missing && has_numbers => Cell::none(),
            None if is_missing => Cell::text("–"),
            None => Cell::text(text),
        });
    }
}

/// A table of the columns of a sheet, what its rows share first.
pub(super) fn table(sheet: &sheet::Sheet, data: &Value) -> Markup {
    let rows = rows_of(data, sheet.list);
    let shared = sheet
        .shared
        .iter()
        .filter(|c| rows.iter().any(|r| r.contains_key(c.key)));
    let columns: Vec<&Column> = shared.chain(sheet.columns).collect();
    let mut headings = Vec::new();
    let mut cells = vec![Vec::new(); rows.len()];
    for column in columns {
        headings.push(match column.heading.contains("{}") {
            true => heading(column.key),
            false => column.titled(),
        });
        add(Some((sheet, column)), column.key, &rows, &mut cells);
    }
    sortable(&headings, &cells)
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
