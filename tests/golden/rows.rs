//! Rows of outputs as text, and their comparison.

use crate::prints::{ABSOLUTE, RELATIVE};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;

/// A table of texts, whose first columns name a row.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    columns: Vec<String>,
    /// Cells by the row's name; a number in it tells rows of one name apart.
    rows: BTreeMap<String, Vec<String>>,
}

const BETWEEN: &str = " | ";

impl Rows {
    /// Table of an array of objects, or of the first array of an object, with these columns and
    /// rows named by `key`. Rows whose name contains one of `named` keep only the name.
    pub(crate) fn of(value: &Value, columns: &str, key: &str, named: &[&str]) -> Self {
        let [columns, key] = [columns, key].map(|names| names.split(' ').collect::<Vec<_>>());
        let mut table = Self {
            columns: columns.iter().map(|c| (*c).to_owned()).collect(),
            rows: BTreeMap::new(),
        };
        let first = |value: &Value| {
            value
                .as_object()?
                .values()
                .find_map(Value::as_array)
                .cloned()
        };
        let rows = value.as_array().cloned().or_else(|| first(value));
        for row in rows.expect("an array of rows") {
            let of = |column: &str| text(&row[column]);
            let name: Vec<_> = key.iter().map(|column| of(column)).collect();
            let name = name.join(" ");
            let kept = !named.iter().any(|word| name.contains(word));
            let cells = columns.iter().filter(|_| kept).map(|column| of(column));
            table.put(&name, cells.collect());
        }
        table
    }

    /// The first line of each CSV text and its last one, a row for each column.
    pub(crate) fn of_tables(tables: &[(String, String)]) -> Self {
        let mut table = Self {
            columns: vec!["value".to_owned()],
            rows: BTreeMap::new(),
        };
        for (name, csv) in tables {
            let mut lines = csv.lines();
            let (head, last) = (lines.next().unwrap_or(""), lines.next_back().unwrap_or(""));
            let cells = head.split(',').zip(last.split(','));
            for (column, cell) in cells.filter(|(column, _)| !column.ends_with("_ns")) {
                table.put(&format!("{name} {column}"), vec![cell.to_owned()]);
            }
        }
        table
    }

    fn put(&mut self, name: &str, cells: Vec<String>) {
        let mut own = name.to_owned();
        for n in 2.. {
            if !self.rows.contains_key(&own) {
                break;
            }
            own = format!("{name} #{n}");
        }
        self.rows.insert(own, cells);
    }

    /// Reads the text that [`Display`](fmt::Display) writes.
    pub(crate) fn parse(text: &str) -> Self {
        let mut lines = text.lines().map(|line| {
            let mut cells = line.split(BETWEEN).map(str::to_owned);
            (cells.next().unwrap_or_default(), cells.collect::<Vec<_>>())
        });
        let (_, columns) = lines.next().unwrap_or_default();
        Self {
            columns,
            rows: lines.collect(),
        }
    }

    /// A line for each row that is missing, new or other; rows of solvers that are not compiled in may be missing.
    pub(crate) fn differences(&self, now: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.columns != now.columns {
            found.push(format!(
                "columns: {:?}, now {:?}",
                self.columns, now.columns
            ));
        }
        let umfpack = cfg!(feature = "umfpack");
        for (name, old) in &self.rows {
            match now.rows.get(name) {
                None if !umfpack && name.contains("umfpack") => {}
                None => found.push(format!("missing: {name}")),
                Some(new) if !agree_all(old, new) => {
                    let [old, new] = [old, new].map(|cells| cells.join(BETWEEN));
                    found.push(format!("{name}\n  then {old}\n  now  {new}"));
                }
                Some(_) => {}
            }
        }
        let new = now.rows.keys();
        let new = new.filter(|name| !self.rows.contains_key(*name));
        found.extend(new.map(|name| format!("new: {name}")));
        found
    }
}

impl fmt::Display for Rows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "row{BETWEEN}{}", self.columns.join(BETWEEN))?;
        for (name, cells) in &self.rows {
            let line: Vec<_> = [name].into_iter().chain(cells).cloned().collect();
            writeln!(f, "{}", line.join(BETWEEN))?;
        }
        Ok(())
    }
}

/// A cell on one line.
fn text(value: &Value) -> String {
    let text = match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(n) => n
            .as_f64()
            .map_or_else(|| n.to_string(), |x| format!("{x:.5e}")),
        other => other.to_string(),
    };
    text.replace('\n', " ").replace(BETWEEN, " ¦ ")
}

fn agree_all(old: &[String], new: &[String]) -> bool {
    old.len() == new.len() && old.iter().zip(new).all(|(a, b)| agree(a, b))
}

/// Texts that differ in nothing but numbers, and in those little.
fn agree(old: &str, new: &str) -> bool {
    if old == new {
        return true;
    }
    if let (Ok(a), Ok(b)) = (old.parse::<f64>(), new.parse::<f64>()) {
        return close(a, b);
    }
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let (old, new) = (words(old), words(new));
    let word = |a: &String, b: &String| {
        let number = |word: &String| {
            word.trim_matches(|c: char| "()[],;:%×".contains(c))
                .parse::<f64>()
        };
        a == b || matches!((number(a), number(b)), (Ok(a), Ok(b)) if near(a, b))
    };
    old.len() == new.len() && old.iter().zip(&new).all(|(a, b)| word(a, b))
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= RELATIVE * a.abs().max(b.abs()) + ABSOLUTE
}

/// True if numbers within a text agree. Texts print two or three digits only.
fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 2e-2 * a.abs().max(b.abs()) + ABSOLUTE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_differ_where_they_are_missing_new_or_other() {
        let of = |text: &str| Rows::parse(text);
        let old = of("row | error | verdict\na | 1.0 | pass\nb | 1e-13 | pass\n");
        assert!(old.differences(&of(&old.to_string())).is_empty());
        let now = of("row | error | verdict\na | 1.01 | pass\nc | 1 | pass\n");
        let found = old.differences(&now);
        assert_eq!(found.len(), 3, "{found:?}");
        let rounded = of("row | error | verdict\na | 1.0001 | pass\nb | 7e-13 | pass\n");
        assert!(old.differences(&rounded).is_empty());
        let failed = of("row | error | verdict\na | 1.0 | fail\nb | 1e-13 | pass\n");
        assert_eq!(old.differences(&failed).len(), 1);
    }

    #[test]
    fn numbers_within_texts_may_differ_by_a_digit() {
        assert!(agree("to a strain of 0.50", "to a strain of 0.495"));
        assert!(!agree("to a strain of 0.50", "to a strain of 0.40"));
        assert!(!agree("to a strain of 0.50", "to strain of 0.50"));
    }
}
