//! Rows of any experiment as tables: which columns there are, how each is written, and what stands beside or above what.
//!
//! A [`Column`] names a key of a [row](crate::row). One [`Sheet`] of columns makes the table as text, and the headings, numbers and marks of the page.

use crate::row::{Row, heading, number_of, rows_of, text, text_of, words};
use crate::settings::distinct;
use crate::table::{self, least, marked, nanoseconds, verdict};
use comfy_table::{Attribute, CellAlignment};
use serde::Serialize;
use serde_json::Value;
use std::fmt::Write;

#[derive(Debug, Clone, Copy)]
pub struct Column {
    /// The key of its values in the rows.
    pub key: &'static str,
    /// Heading; above a table the words around the value, which replaces `{}`.
    pub heading: &'static str,
    /// The unit of what is shown; none of times, which have theirs in each cell.
    pub unit: &'static str,
    /// How a value is written.
    pub show: Show,
    /// Which row is the best.
    pub best: Best,
}

/// Which row of a column is the best.
#[derive(Debug, Clone, Copy)]
pub enum Best {
    /// None is.
    No,
    /// The least value of the column.
    Least,
    /// The least value of the function.
    LeastOf(fn(&Row) -> Option<f64>),
}

/// How a value is written.
#[derive(Debug, Clone, Copy)]
pub enum Show {
    /// Names, yes or no, numbers in four digits.
    Plain,
    /// Nanoseconds with a unit.
    Time,
    /// With an exponent and so many digits after the point.
    Error(usize),
    /// A mass ratio: with an exponent from 10⁴ on.
    Ratio,
    /// So many digits after the point.
    Fixed(usize),
    /// Three digits of the value times a factor.
    Digits(f64),
    /// Text from the function.
    Row(fn(&Row) -> String),
}

/// A column of plain values.
pub const fn column(key: &'static str, heading: &'static str) -> Column {
    Column {
        key,
        heading,
        unit: "",
        show: Show::Plain,
        best: Best::No,
    }
}

/// A column of errors, the least of which is the best.
pub const fn error(key: &'static str, heading: &'static str) -> Column {
    column(key, heading).shown(Show::Error(1)).least()
}

/// A column of times in nanoseconds, the least of which is the best.
pub const fn time(key: &'static str, heading: &'static str) -> Column {
    column(key, heading).shown(Show::Time).least()
}

impl Column {
    pub const fn shown(self, show: Show) -> Self {
        Self { show, ..self }
    }

    pub const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Marks the least value as the best.
    pub const fn least(self) -> Self {
        Self {
            best: Best::Least,
            ..self
        }
    }

    /// The best row has the least of something else than the value.
    pub const fn least_of(self, worth: fn(&Row) -> Option<f64>) -> Self {
        Self {
            best: Best::LeastOf(worth),
            ..self
        }
    }

    /// Value by which [`Best`] ranks the row.
    pub(crate) fn worth(&self, row: &Row) -> Option<f64> {
        match self.best {
            Best::No => None,
            Best::Least => number_of(row, self.key),
            Best::LeastOf(worth) => worth(row),
        }
    }

    /// Heading with the whole key, for a page.
    pub fn named(&self) -> String {
        if self.unit.is_empty() {
            return heading(self.key);
        }
        let key = self.key.strip_suffix("_m").unwrap_or(self.key);
        format!("{} ({})", words(key), self.unit)
    }

    /// The heading with the unit after it.
    pub fn titled(&self) -> String {
        format!("{} {}", self.heading, self.unit)
            .trim_end()
            .to_owned()
    }

    /// The value of a row; nothing where it has none.
    pub fn text(&self, row: &Row) -> String {
        let value = row.get(self.key).unwrap_or(&Value::Null);
        match (self.show, value.as_f64()) {
            (Show::Row(shown), _) => shown(row),
            (_, None) if value.is_null() => "-".to_owned(),
            (Show::Plain, _) | (_, None) => text(self.key, value),
            (Show::Time, Some(ns)) => nanoseconds(ns),
            (Show::Error(digits), Some(x)) => format!("{x:.digits$e}"),
            (Show::Ratio, Some(x)) => table::ratio(x),
            (Show::Fixed(digits), Some(x)) => format!("{x:.digits$}"),
            (Show::Digits(factor), Some(x)) => digits(factor * x),
        }
    }
}

/// Three digits.
pub fn digits(x: f64) -> String {
    match x.abs() {
        size if size >= 1e5 || (size < 1e-3 && size > 0.0) => format!("{x:.0e}"),
        size if size < 0.1 => format!("{x:.3}"),
        size if size < 10.0 => format!("{x:.2}"),
        size if size < 100.0 => format!("{x:.1}"),
        _ => format!("{x:.0}"),
    }
}

/// The tables of a list of rows.
#[derive(Debug, Clone, Copy)]
pub struct Sheet {
    /// The list in the data; the list without a name is the data itself.
    pub list: &'static str,
    pub title: &'static str,
    /// Columns that group rows into tables; a row without a value takes part in all tables.
    pub shared: &'static [Column],
    /// Columns side by side.
    pub columns: &'static [Column],
    /// More of them, for each value of a column.
    pub across: Option<Across>,
    /// Which rows are shown.
    pub takes: fn(&Row) -> bool,
    /// Which of these are compared.
    pub counts: fn(&Row) -> bool,
    /// Columns in which rows have the same where they are compared.
    pub group: &'static [&'static str],
}

/// Columns for each value of other columns.
#[derive(Debug, Clone, Copy)]
pub struct Across {
    /// Columns whose values head each group of cells.
    pub by: &'static [Column],
    /// Columns within a group.
    pub cells: &'static [Column],
    /// Shows every row of a cell instead of the first; the last row competes.
    pub several: bool,
    /// Most columns; of more values some at even distances are shown, the first and the last among them.
    pub most: usize,
}

/// Columns for each value of others, of each the first row and none left out.
pub const fn across(by: &'static [Column], cells: &'static [Column]) -> Option<Across> {
    Some(Across {
        by,
        cells,
        several: false,
        most: usize::MAX,
    })
}

/// A sheet of all rows of the data, all of them compared.
pub const PLAIN: Sheet = Sheet {
    list: "",
    title: "",
    shared: &[],
    columns: &[],
    across: None,
    takes: |_| true,
    counts: |_| true,
    group: &[],
};

/// Most characters of a line, with the blank at its end.
const WIDTH: u16 = 120;

/// Words that are bad news, wherever they stand alone.
const BAD: &[&str] = &["failed", "MISSED"];

/// A table before it is text: headings, cells, what the rows of each column are compared by.
#[derive(Default)]
struct Cells {
    headings: Vec<String>,
    rows: Vec<Vec<String>>,
    worths: Vec<Vec<Worth>>,
    is_text: Vec<bool>,
}

/// Among which rows a cell is compared, and by what.
type Worth = (Vec<Value>, Option<f64>);

impl Sheet {
    /// The column whose values are those of that key.
    pub fn column(&self, key: &str) -> Option<&Column> {
        let cells = self.across.iter().flat_map(|across| across.cells);
        let is_its = |c: &&Column| c.key == key && !matches!(c.show, Show::Row(_));
        self.columns.iter().chain(cells).find(is_its)
    }

    /// Which of the rows are the best of their tables in a column.
    pub fn best(&self, column: &Column, rows: &[Row]) -> Vec<bool> {
        let table = |row: &Row| -> Vec<Option<Value>> {
            self.shared
                .iter()
                .map(|c| row.get(c.key).cloned())
                .collect()
        };
        let worths = rows.iter().map(|row| {
            let (group, worth) = self.worth(column, row);
            ((table(row), group), worth.filter(|_| (self.takes)(row)))
        });
        least(&worths.collect::<Vec<_>>())
    }

    /// The tables of the data; nothing where no row is shown.
    pub fn text(&self, data: &Value) -> String {
        self.of_rows(rows_of(data, self.list))
    }

    /// The rows of the data as one Markdown table, numbers to the right.
    pub fn markdown(&self, data: &Value) -> String {
        let rows = rows_of(data, self.list);
        let rows: Vec<&Row> = rows.iter().collect();
        let cells = self.cells(&rows);
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule = |is_text: &bool| if *is_text { "---" } else { "---:" }.to_owned();
        let rules: Vec<String> = cells.is_text.iter().map(rule).collect();
        let heads = [line(&cells.headings), line(&rules)];
        let escaped = |row: &Vec<String>| -> Vec<String> {
            row.iter().map(|cell| cell.replace('|', "\\|")).collect()
        };
        let rows = cells.rows.iter().map(|row| line(&escaped(row)));
        heads.into_iter().chain(rows).collect()
    }

    pub fn of(&self, records: &impl Serialize) -> String {
        // Records that do not serialise give no rows.
        self.text(&serde_json::to_value(records).unwrap_or_default())
    }

    pub(crate) fn of_rows(&self, mut rows: Vec<Row>) -> String {
        rows.retain(self.takes);
        let mut out = String::new();
        if rows.is_empty() {
            return out;
        }
        if !self.title.is_empty() {
            let _ = writeln!(out, "\n{}", self.title);
        }
        for own in self.groups(&rows) {
            if !self.shared.is_empty() {
                let _ = writeln!(out, "\n{}", self.above(&own));
            }
            out.push_str(&self.cells(&own).text());
            for reason in self.reasons(&own) {
                let _ = writeln!(out, "  {reason}");
            }
        }
        out
    }

    fn groups<'a>(&self, rows: &'a [Row]) -> Vec<Vec<&'a Row>> {
        let value = |row: &'a Row, c: &Column| row.get(c.key).filter(|v| !v.is_null());
        let key = |row: &'a Row| -> Vec<Option<&Value>> {
            self.shared.iter().map(|c| value(row, c)).collect()
        };
        let keys = distinct(rows.iter().map(key));
        let whole = keys.iter().filter(|key| key.iter().all(Option::is_some));
        let fits = |own: Vec<Option<&Value>>, key: &[Option<&Value>]| {
            own.iter().zip(key).all(|(a, b)| a.is_none() || a == b)
        };
        let groups = whole.map(|k| rows.iter().filter(|row| fits(key(row), k)).collect());
        groups.collect()
    }

    /// Text above a table: the values that its rows share.
    fn above(&self, rows: &[&Row]) -> String {
        let part = |c: &Column| {
            let row = rows
                .iter()
                .find(|r| r.get(c.key).is_some_and(|v| !v.is_null()));
            row.map(|row| c.heading.replace("{}", &c.text(row)))
        };
        let parts: Vec<String> = self.shared.iter().filter_map(part).collect();
        let said: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        said.join(", ")
    }

    /// Values of [`Sheet::group`], and the rank of the row if it competes.
    fn worth(&self, column: &Column, row: &Row) -> Worth {
        let group = self
            .group
            .iter()
            .map(|key| row.get(*key).cloned().unwrap_or_default());
        let worth = column.worth(row).filter(|_| (self.counts)(row));
        (group.collect(), worth)
    }

    fn cells(&self, rows: &[&Row]) -> Cells {
        match &self.across {
            None => self.flat(rows),
            Some(across) => self.pivot(across, rows),
        }
    }

    fn flat(&self, rows: &[&Row]) -> Cells {
        let mut cells = Cells::default();
        for column in self.columns {
            cells.headings.push(column.titled());
            cells.is_text.push(is_text(column, rows));
            let worths = rows.iter().map(|row| self.worth(column, row));
            cells.worths.push(worths.collect());
        }
        let row = |row: &&Row| self.columns.iter().map(|c| c.text(row)).collect();
        cells.rows = rows.iter().map(row).collect();
        cells
    }

    fn pivot(&self, across: &Across, rows: &[&Row]) -> Cells {
        let beside = |row: &Row| -> Vec<Option<Value>> {
            self.columns
                .iter()
                .map(|c| row.get(c.key).cloned())
                .collect()
        };
        let place = |row: &Row| -> String {
            let parts = across
                .by
                .iter()
                .map(|c| c.heading.replace("{}", &c.text(row)));
            parts.collect::<Vec<_>>().join(" ")
        };
        let lines = distinct(rows.iter().map(|row| beside(row)));
        let lines = lines.iter().map(|line| {
            let own = rows.iter().filter(|row| beside(row) == *line);
            own.copied().collect::<Vec<&Row>>()
        });
        let lines: Vec<Vec<&Row>> = lines.collect();
        let first: Vec<&Row> = lines.iter().map(|line| line[0]).collect();
        let mut cells = self.flat(&first);
        for heading in some(distinct(rows.iter().map(|row| place(row))), across.most) {
            for cell in across.cells {
                let mut worths = Vec::new();
                for (line, texts) in lines.iter().zip(&mut cells.rows) {
                    let own: Vec<&&Row> = line.iter().filter(|row| place(row) == heading).collect();
                    let shown: Vec<String> = own.iter().map(|row| cell.text(row)).collect();
                    texts.push(shown.join(" "));
                    let own = if across.several {
                        &own[..]
                    } else {
                        &own[..own.len().min(1)]
                    };
                    let worth = own.last().and_then(|row| self.worth(cell, row).1);
                    worths.push((self.worth(cell, line[0]).0, worth));
                }
                let heading = format!("{heading} {}", cell.titled());
                cells.headings.push(heading.trim_end().to_owned());
                cells.worths.push(worths);
                cells.is_text.push(false);
            }
        }
        cells
    }

    /// Why rows have no numbers, after what stands first in them.
    fn reasons(&self, rows: &[&Row]) -> Vec<String> {
        let name = |row: &Row| {
            self.columns
                .first()
                .map_or_else(String::new, |c| c.text(row))
        };
        let failed = rows.iter().filter(|row| !text_of(row, "error").is_empty());
        distinct(failed.map(|row| format!("{} failed: {}", name(row), text_of(row, "error"))))
    }
}

impl Cells {
    fn text(&self) -> String {
        let columns = self.worths.iter().enumerate();
        let marks = columns.map(|(i, worths)| {
            let texts: Vec<&String> = self.rows.iter().map(|row| &row[i]).collect();
            marked(&texts, worths)
        });
        let marks: Vec<Vec<bool>> = marks.collect();
        // The mark stands in place of the blank before the next column.
        let has_marks = |i: usize| marks[i].contains(&true);
        let end = |i: usize| if has_marks(i) { " " } else { "" };
        let headings = self.headings.iter().enumerate();
        let headings: Vec<String> = headings.map(|(i, text)| text.clone() + end(i)).collect();
        let mut t = table::wrapped(&headings);
        t.set_width(WIDTH);
        for (i, (column, is_text)) in t.column_iter_mut().zip(&self.is_text).enumerate() {
            column.set_cell_alignment(match is_text {
                true => CellAlignment::Left,
                false => CellAlignment::Right,
            });
            column.set_padding((1, u16::from(!has_marks(i))));
        }
        for (row, texts) in self.rows.iter().enumerate() {
            t.add_row(texts.iter().enumerate().map(|(i, text)| {
                let good = BAD.contains(&text.as_str()).then_some(false);
                match marks[i][row] {
                    true => verdict(format!("{text}*"), good).add_attribute(Attribute::Bold),
                    false => verdict(text.clone() + end(i), good),
                }
            }));
        }
        table::text(&t)
    }
}

/// True if the column holds names or nothing but nulls; an empty text does not count as a name.
fn is_text(column: &Column, rows: &[&Row]) -> bool {
    let values = rows.iter().filter_map(|row| row.get(column.key));
    let is_name = |value: &Value| value.as_str().is_some_and(|text| !text.is_empty());
    values.clone().any(is_name) || values.clone().all(Value::is_null)
}

/// All of them, or so many at even distances, the first and the last among them.
fn some(all: Vec<String>, most: usize) -> Vec<String> {
    let last = all.len().saturating_sub(1);
    if all.len() <= most || most < 2 {
        return all;
    }
    let place = |i: usize| (i * last + most / 2 - 1) / (most - 1);
    (0..most).map(|i| all[place(i)].clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::has_no_error;
    use crate::table::plain;
    use serde_json::json;

    const SHEET: Sheet = Sheet {
        list: "records",
        shared: &[column("size", "{} segments"), column("start", "from {}")],
        columns: &[
            column("backend", "solver"),
            column("length_m", "length")
                .unit("mm")
                .shown(Show::Digits(1e3)),
            time("step_ns", "step"),
        ],
        counts: has_no_error,
        ..PLAIN
    };

    fn data() -> Value {
        let row = |backend: &str, start: Option<&str>, ns: f64, error: Option<&str>| json!({ "backend": backend, "start": start, "size": 3, "length_m": 0.0125, "step_ns": ns, "error": error });
        json!({ "records": [
            row("banded", None, 1500.0, None),
            row("cg", Some("zero"), 2500.0, None),
            row("cg", Some("before"), 900.0, Some("too hot")),
        ] })
    }

    /// A table of groups and values, with the marks.
    fn shown(rows: &[(&str, Option<f64>)]) -> String {
        let row = |(group, value): &(&str, Option<f64>)| {
            let value = value.map_or("-".to_owned(), |v| v.to_string());
            vec![(*group).to_owned(), value, "x".to_owned()]
        };
        let worths = |value: fn(Option<f64>) -> Option<f64>| {
            let worth = |(group, worth): &(&str, Option<f64>)| (vec![json!(group)], value(*worth));
            rows.iter().map(worth).collect::<Vec<Worth>>()
        };
        let cells = Cells {
            headings: ["group", "value", "next"].map(str::to_owned).to_vec(),
            rows: rows.iter().map(row).collect(),
            worths: vec![worths(|_| None), worths(|worth| worth), worths(|_| None)],
            is_text: vec![true, false, false],
        };
        cells.text()
    }

    #[test]
    fn the_least_of_each_group_is_marked_in_bold() {
        let rows = [
            ("a", Some(2.5)),
            ("a", Some(0.25)),
            ("b", Some(7.5)),
            ("a", Some(0.25)),
            ("b", Some(f64::NAN)),
            ("a", None),
            ("c", Some(1.5)),
            ("b", Some(f64::NEG_INFINITY)),
        ];
        let styled = shown(&rows);
        let plain = plain(&styled);
        let expected = [
            " group  value  next",
            " a        2.5     x",
            " a       0.25*    x",
            " b        7.5*    x",
            " a       0.25*    x",
            " b        NaN     x",
            " a          -     x",
            " c        1.5     x",
            " b       -inf     x",
        ];
        assert_eq!(plain.lines().collect::<Vec<_>>(), expected);
        assert_eq!(styled.matches("\u{1b}[1m").count(), 3, "{styled:?}");
        assert!(styled.contains("\u{1b}[1m0.25*\u{1b}[0m"), "{styled:?}");
    }

    #[test]
    fn nothing_is_marked_where_nothing_counts() {
        let rows = [("a", None), ("a", Some(f64::NAN)), ("b", Some(1.0))];
        let styled = shown(&rows);
        assert!(!styled.contains(['*', '\u{1b}']), "{styled:?}");
    }

    #[test]
    fn marks_take_no_room() {
        let rows = [("a", Some(1.0)), ("a", Some(2.0))];
        let width = |t: &str| plain(t).lines().map(str::len).max();
        let unmarked = shown(&rows.map(|(group, _)| (group, None)));
        assert_eq!(width(&shown(&rows)), width(&unmarked));
    }

    #[test]
    fn rows_make_a_table_for_each_value_that_they_share() {
        let expected = "
3 segments, from zero
 solver  length mm     step
 banded       12.5  1.50 µs*
 cg           12.5  2.50 µs

3 segments, from before
 solver  length mm     step
 banded       12.5  1.50 µs*
 cg           12.5   900 ns
  cg failed: too hot
";
        assert_eq!(plain(&SHEET.text(&data())), expected);
        assert_eq!(SHEET.text(&json!({ "records": [] })), "");
    }

    #[test]
    fn values_of_a_column_stand_side_by_side() {
        const SIDE_BY_SIDE: Sheet = Sheet {
            shared: &[],
            columns: &[column("backend", "solver")],
            across: Some(Across {
                by: &[column("start", "from {}")],
                cells: &[time("step_ns", "")],
                several: false,
                most: 2,
            }),
            takes: |row| text_of(row, "backend") == "cg",
            ..SHEET
        };
        let expected = " solver  from zero  from before
 cg        2.50 µs       900 ns
  cg failed: too hot
";
        assert_eq!(plain(&SIDE_BY_SIDE.text(&data())), expected);
    }

    #[test]
    fn the_best_of_a_table_is_the_best_on_a_page() {
        let rows = rows_of(&data(), "records");
        let sheet = Sheet {
            shared: &[],
            ..SHEET
        };
        let step = sheet.column("step_ns").expect("a column");
        assert_eq!(sheet.best(step, &rows), [true, false, false]);
        let found = sheet.column("length_m").map(Column::named);
        assert_eq!(found.as_deref(), Some("length (mm)"));
    }
}
