//! Questions as files, `questions/NAME.toml`: what a study is called, what it takes, its tables and its plots.
//!
//! | top | meaning |
//! |---|---|
//! | `title`, `about`, `details`, `examples`, `writes` | title of the page; a line, more text, calls and content of `--json` for the help |
//! | `mark` | a list of its rows, and a column that no other study has, by which rows without a name are known; the list without a name is the data itself |
//! | `takes` | its options by name, in the order of the help |
//! | `legend` | what stands above its tables |
//! | `asks` | what it asks the engine of systems, as a file of `taut study systems` |
//! | `pairs` | lists of pairs of texts that the study's own code asks for, by name |
//!
//! | `[[sheet]]` | meaning |
//! |---|---|
//! | `name`, `aside` | by which the study calls it; `true`: no table of the page |
//! | `list`, `title`, `group` | as in [`Sheet`] |
//! | `shared`, `columns`, `across` | [`Column`]s: `key`, `heading`, `unit`; `show`, one of `time`, `ratio`, `rate`, `error:DIGITS`, `fixed:DIGITS`, `digits:FACTOR`, or `=FUNCTION`; `best`, `least` or `=FUNCTION` |
//! | `takes`, `counts` | functions of rows |
//!
//! `[[plot]]` has the fields of a [`Plan`].

use serde::Deserialize;
use std::collections::BTreeMap;
use taut_output::plan::Plan;
use taut_output::row::{Row, has_no_error, iterations, number_of};
use taut_output::sheet::{Across, Best, Column, Sheet, Show};

type Text = &'static str;

/// What a study is asked, as its file says.
#[derive(Debug)]
pub struct Question {
    pub title: Text,
    pub about: Text,
    pub details: Text,
    pub examples: Vec<Text>,
    pub writes: Text,
    pub mark: [Text; 2],
    pub takes: Vec<Text>,
    pub legend: Text,
    /// The tables of its rows.
    pub sheets: Vec<Sheet>,
    named: Vec<(Text, Sheet)>,
    pairs: BTreeMap<Text, Vec<[Text; 2]>>,
    pub plots: Vec<Plan>,
    /// What it asks the engine of systems; nothing where code asks.
    pub asks: serde_json::Value,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields, bound(deserialize = "'de: 'static"))]
struct File {
    title: Text,
    about: Text,
    details: Text,
    examples: Vec<Text>,
    writes: Text,
    mark: [Text; 2],
    takes: Vec<Text>,
    legend: Text,
    pairs: BTreeMap<Text, Vec<[Text; 2]>>,
    sheet: Vec<SheetEntry>,
    plot: Vec<Plan>,
    asks: serde_json::Value,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields, bound(deserialize = "'de: 'static"))]
struct SheetEntry {
    name: Text,
    aside: bool,
    list: Text,
    title: Text,
    shared: Vec<ColumnEntry>,
    columns: Vec<ColumnEntry>,
    across: Option<AcrossEntry>,
    takes: Text,
    counts: Text,
    group: Vec<Text>,
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields, bound(deserialize = "'de: 'static"))]
struct AcrossEntry {
    by: Vec<ColumnEntry>,
    cells: Vec<ColumnEntry>,
    several: bool,
    most: Option<usize>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(default, deny_unknown_fields, bound(deserialize = "'de: 'static"))]
struct ColumnEntry {
    key: Text,
    heading: Text,
    unit: Text,
    show: Text,
    best: Text,
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
        let read: Result<serde_json::Value, _> = toml::from_str(text);
        let read = read.unwrap_or_else(|e| panic!("{e}: {text}"));
        // It lives as long as the program.
        let file = File::deserialize(&*Box::leak(Box::new(read)));
        let file = file.unwrap_or_else(|e| panic!("{e}: {text}"));
        let reader = Reader { functions };
        let sheets = file.sheet.into_iter();
        let sheets = sheets.map(|entry| (entry.name, entry.aside, reader.sheet(entry)));
        let sheets: Vec<(Text, bool, Sheet)> = sheets.collect();
        let of_page = sheets.iter().filter(|(_, aside, _)| !aside);
        Self {
            title: file.title,
            about: file.about,
            details: file.details,
            examples: file.examples,
            writes: file.writes,
            mark: file.mark,
            takes: file.takes,
            legend: file.legend,
            sheets: of_page.map(|(.., sheet)| *sheet).collect(),
            named: sheets
                .iter()
                .map(|(name, _, sheet)| (*name, *sheet))
                .collect(),
            pairs: file.pairs,
            plots: file.plot,
            asks: file.asks,
        }
    }

    /// Pairs of texts by the name of their list.
    pub fn pairs(&self, name: &str) -> impl Iterator<Item = (Text, Text)> {
        self.pairs
            .get(name)
            .into_iter()
            .flatten()
            .map(|[a, b]| (*a, *b))
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

    fn holds(&self, name: &str) -> fn(&Row) -> bool {
        match name {
            "" => |_| true,
            name => match self.function(name) {
                Function::Holds(holds) => holds,
                _ => panic!("`{name}` holds of no rows"),
            },
        }
    }

    fn columns(&self, entries: Vec<ColumnEntry>) -> &'static [Column] {
        let all: Vec<Column> = entries
            .into_iter()
            .map(|entry| self.column(entry))
            .collect();
        all.leak()
    }

    fn column(&self, entry: ColumnEntry) -> Column {
        let ColumnEntry {
            key,
            heading,
            unit,
            show,
            best,
        } = entry;
        let (form, digits) = show.split_once(':').unwrap_or((show, "0"));
        let digits: f64 = digits.parse().unwrap_or(f64::NAN);
        let function = |name: &str| name.strip_prefix('=').map(|name| self.function(name));
        Column {
            key,
            heading,
            unit,
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

    fn sheet(&self, entry: SheetEntry) -> Sheet {
        Sheet {
            list: entry.list,
            title: entry.title,
            shared: self.columns(entry.shared),
            columns: self.columns(entry.columns),
            across: entry.across.map(|across| Across {
                by: self.columns(across.by),
                cells: self.columns(across.cells),
                several: across.several,
                most: across.most.unwrap_or(usize::MAX),
            }),
            takes: self.holds(entry.takes),
            counts: self.holds(entry.counts),
            group: entry.group.leak(),
        }
    }
}

/// Steps a second.
fn rate(row: &Row) -> String {
    number_of(row, "dt").map_or(String::new(), |dt| format!("{:.0}", 1.0 / dt))
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

    #[test]
    #[should_panic(expected = "unknown field `collumns`")]
    fn a_misspelt_key_is_no_empty_column() {
        let _ = super::Question::read("[[sheet]]\ncollumns = []", &[]);
    }
}
