//! Questions as files, `questions/NAME.toml`: what a study is called, what it takes, its tables and its plots.
//!
//! | top | meaning |
//! |---|---|
//! | `title`, `about`, `details`, `examples`, `writes` | title of the page; a line, more text, calls and content of `--json` for the help |
//! | `mark` | a list of its rows, and a column that no other study has, by which rows without a name are known; the list without a name is the data itself |
//! | `takes` | its options by name, in the order of the help |
//! | `legend` | what stands above its tables |
//! | any other | pairs of texts that the study's own code asks for |
//!
//! | `[[sheet]]` | meaning |
//! |---|---|
//! | `name`, `aside` | by which the study calls it; `true`: no table of the page |
//! | `list`, `title`, `rivals` | as in [`Sheet`] |
//! | `shared`, `columns`, `across` | [`Column`]s: `key`, `heading`, `unit`; `show`, one of `time`, `ratio`, `rate`, `error:DIGITS`, `fixed:DIGITS`, `digits:FACTOR`, or `=FUNCTION`; `best`, `least` or `=FUNCTION` |
//! | `takes`, `counts` | functions of rows |
//!
//! `[[plot]]` has the fields of a [`Plan`]; the `scale` of an axis is `positive`, `linear` or `texts`, or else that of errors.

use taut_output::plan::{self, Plan, Quantity};
use taut_output::plot::Mark;
use taut_output::row::{Row, has_no_error, iterations, number_of};
use taut_output::sheet::{Across, Best, Column, Sheet, Show};
use toml::{Table, Value};

/// What a study is asked, as its file says.
#[derive(Debug)]
pub struct Question {
    pub title: &'static str,
    pub about: &'static str,
    pub details: &'static str,
    pub examples: &'static [&'static str],
    pub writes: &'static str,
    pub mark: [&'static str; 2],
    pub takes: &'static [&'static str],
    pub legend: &'static str,
    /// The tables of its rows.
    pub sheets: Vec<Sheet>,
    named: Vec<(&'static str, Sheet)>,
    top: &'static Table,
    pub plots: Vec<Plan>,
}

/// A function that a question names.
#[derive(Debug, Clone, Copy)]
pub enum Function {
    /// Text of a cell.
    Text(fn(&Row) -> String),
    /// Number that rows are ranked by.
    Worth(fn(&Row) -> Option<f64>),
    /// Which rows are shown, or compared.
    Holds(fn(&Row) -> bool),
}

pub type Functions = &'static [(&'static str, Function)];

/// Those that any question may name.
const COMMON: Functions = &[
    ("iterations", Function::Text(iterations)),
    ("has_no_error", Function::Holds(has_no_error)),
];

impl Question {
    /// Reads a file.
    ///
    /// # Panics
    /// If it is no question: it is part of the program.
    #[must_use]
    pub fn read(text: &str, functions: Functions) -> Self {
        let read: Table = toml::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"));
        // It lives as long as the program.
        let top: &'static Table = Box::leak(Box::new(read));
        let reader = Reader { functions };
        let sheets = tables(top, "sheet").map(|t| (t, reader.sheet(t)));
        let sheets: Vec<(&Table, Sheet)> = sheets.collect();
        let of_page = sheets.iter().filter(|(t, _)| !is(t, "aside"));
        let [list, column] = texts(top, "mark") else {
            panic!("a mark is a list and a column: {text}")
        };
        Self {
            title: text_of(top, "title"),
            about: text_of(top, "about"),
            details: text_of(top, "details"),
            examples: texts(top, "examples"),
            writes: text_of(top, "writes"),
            mark: [list, column],
            takes: texts(top, "takes"),
            legend: text_of(top, "legend"),
            sheets: of_page.map(|(_, sheet)| *sheet).collect(),
            named: sheets
                .iter()
                .map(|(t, s)| (text_of(t, "name"), *s))
                .collect(),
            top,
            plots: tables(top, "plot").map(plan).collect(),
        }
    }

    /// Pairs of texts by the name of their list.
    pub fn pairs(&self, name: &str) -> impl Iterator<Item = (&'static str, &'static str)> {
        let all = self.top.get(name).and_then(Value::as_array);
        all.into_iter().flatten().filter_map(|pair| {
            let text = |k| pair.get(k).and_then(Value::as_str);
            text(0).zip(text(1))
        })
    }

    #[must_use]
    pub fn sheet(&self, name: &str) -> &Sheet {
        let found = self.named.iter().find(|(own, _)| *own == name);
        &found
            .unwrap_or_else(|| panic!("no table is called `{name}`"))
            .1
    }
}

/// The question of a file, with the functions that it names.
#[macro_export]
macro_rules! question {
    ($name:literal, $functions:expr) => {
        || {
            static READ: std::sync::LazyLock<$crate::question::Question> =
                std::sync::LazyLock::new(|| {
                    let text = include_str!(concat!(
                        env!("CARGO_MANIFEST_DIR"),
                        "/questions/",
                        $name,
                        ".toml"
                    ));
                    $crate::question::Question::read(text, $functions)
                });
            &READ
        }
    };
}

fn text_of(table: &'static Table, key: &str) -> &'static str {
    table.get(key).and_then(Value::as_str).unwrap_or_default()
}

fn texts(table: &'static Table, key: &str) -> &'static [&'static str] {
    let all = table.get(key).and_then(Value::as_array);
    let all: Vec<&str> = all
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    all.leak()
}

fn is(table: &Table, key: &str) -> bool {
    table.get(key).and_then(Value::as_bool) == Some(true)
}

fn count(table: &Table, key: &str, usual: usize) -> usize {
    let count = table.get(key).and_then(Value::as_integer);
    count.map_or(usual, |count| count as usize)
}

fn tables(table: &'static Table, key: &str) -> impl Iterator<Item = &'static Table> {
    let all = table.get(key).and_then(Value::as_array);
    all.into_iter().flatten().filter_map(Value::as_table)
}

struct Reader {
    functions: Functions,
}

impl Reader {
    fn function(&self, name: &str) -> Function {
        let all = self.functions.iter().chain(COMMON);
        let found = all.into_iter().find(|(own, _)| *own == name);
        found
            .unwrap_or_else(|| panic!("no function is called `{name}`"))
            .1
    }

    fn holds(&self, table: &'static Table, key: &str) -> fn(&Row) -> bool {
        match text_of(table, key) {
            "" => |_| true,
            name => match self.function(name) {
                Function::Holds(holds) => holds,
                _ => panic!("`{name}` holds of no rows"),
            },
        }
    }

    fn columns(&self, table: &'static Table, key: &str) -> &'static [Column] {
        let all: Vec<Column> = tables(table, key).map(|t| self.column(t)).collect();
        all.leak()
    }

    fn column(&self, table: &'static Table) -> Column {
        let (show, best) = (text_of(table, "show"), text_of(table, "best"));
        let (form, digits) = show.split_once(':').unwrap_or((show, "0"));
        let digits: f64 = digits.parse().unwrap_or(f64::NAN);
        let function = |name: &str| name.strip_prefix('=').map(|name| self.function(name));
        Column {
            key: text_of(table, "key"),
            heading: text_of(table, "heading"),
            unit: text_of(table, "unit"),
            show: match (function(show), form) {
                (Some(Function::Text(shown)), _) => Show::Row(shown),
                (_, "") => Show::Plain,
                (_, "time") => Show::Time,
                (_, "ratio") => Show::Ratio,
                (_, "rate") => Show::Row(rate),
                (_, "error") => Show::Error(digits as usize),
                (_, "fixed") => Show::Fixed(digits as usize),
                (_, "digits") => Show::Digits(digits),
                _ => panic!("nothing is shown as `{show}`"),
            },
            best: match (function(best), best) {
                (Some(Function::Worth(worth)), _) => Best::LeastOf(worth),
                (_, "") => Best::No,
                (_, "least") => Best::Least,
                _ => panic!("none is the best as `{best}`"),
            },
        }
    }

    fn sheet(&self, table: &'static Table) -> Sheet {
        let across = table.get("across").and_then(Value::as_table);
        Sheet {
            list: text_of(table, "list"),
            title: text_of(table, "title"),
            shared: self.columns(table, "shared"),
            columns: self.columns(table, "columns"),
            across: across.map(|across| Across {
                by: self.columns(across, "by"),
                cells: self.columns(across, "cells"),
                several: is(across, "several"),
                most: count(across, "most", usize::MAX),
            }),
            takes: self.holds(table, "takes"),
            counts: self.holds(table, "counts"),
            rivals: texts(table, "rivals"),
        }
    }
}

/// Steps a second.
fn rate(row: &Row) -> String {
    number_of(row, "dt").map_or(String::new(), |dt| format!("{:.0}", 1.0 / dt))
}

fn plan(table: &'static Table) -> Plan {
    let only = table.get("only").and_then(Value::as_table);
    let only = only.into_iter().flat_map(|only| {
        let keys = only.keys();
        keys.map(move |key| (key.as_str(), texts(only, key)))
    });
    let only: Vec<(&str, &[&str])> = only.collect();
    let series = texts(table, "series");
    Plan {
        id: text_of(table, "id"),
        title: text_of(table, "title"),
        text: text_of(table, "text"),
        list: text_of(table, "list"),
        only: only.leak(),
        as_first: texts(table, "as_first"),
        panels: texts(table, "panels"),
        series: if series.is_empty() {
            plan::PLAIN.series
        } else {
            series
        },
        x: quantity(table, "x"),
        y: quantity(table, "y"),
        lowest: is(table, "lowest"),
        least: count(table, "least", 1),
        least_places: count(table, "least_places", 1),
        mark: match text_of(table, "mark") {
            "" => Mark::LineAndPoints,
            "line" => Mark::Line,
            "points" => Mark::Points,
            other => panic!("nothing is drawn as `{other}`"),
        },
        orders: is(table, "orders"),
    }
}

fn quantity(table: &'static Table, key: &str) -> Quantity {
    let axis = table.get(key).and_then(Value::as_table);
    let axis = axis.unwrap_or_else(|| panic!("a plot has no `{key}`"));
    let (columns, label) = (texts(axis, "columns"), text_of(axis, "label"));
    let factor = axis.get("factor").and_then(Value::as_float).unwrap_or(1.0);
    match text_of(axis, "scale") {
        "" => plan::error(columns, label),
        "positive" => plan::positive(columns, label, factor),
        "linear" => plan::linear(columns, label, factor),
        "texts" => plan::texts(columns, label),
        other => panic!("no axis is `{other}`"),
    }
}

#[cfg(test)]
mod tests {
    use crate::studies::{COMMANDS, STUDIES};

    #[test]
    fn every_question_reads() {
        for study in COMMANDS.into_iter().chain(STUDIES) {
            let question = study.question();
            assert!(!question.title.is_empty() && !question.about.is_empty());
            assert!(question.plots.iter().all(|plot| !plot.id.is_empty()));
        }
    }
}
