//! Hard cases as files: a scene, what is seen in its run, and what that has to be.
//!
//! ```text
#![doc = include_str!("file/keys.txt")]
//! ```
//!
//! Formulas: [`expression`]. Probes: [`probes`].

mod changes;
mod drive;
mod expression;
pub(super) mod frequency;
mod guarantees;
mod judge;
mod keys;
mod oracles;
mod places;
mod probes;
mod rest;
mod rod;
mod rows;
mod run;
mod sights;
mod text;

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use taut_measure::errors::Cause;
use taut_measure::files::read_text;
use taut_measure::time_table::TimeTable;
use taut_measure::trajectory::ENERGY_TOLERANCE;
use taut_model::nearest;
use taut_output::check::ExperimentError;
use toml::{Table, Value};

pub(super) use guarantees::guarantees;
pub(super) use keys::help;
use places::{line_of, located};
pub(super) use run::{outcome, scenes, verify};

/// The files of this folder, in the order of the report.
macro_rules! files {
    ($($name:literal)*) => {
        &[$(include_str!(concat!("../../cases/", $name, ".toml"))),*]
    };
}

pub(super) const FILES: &[&str] = files! {
    "H01" "H02" "H03" "H04" "H05" "H06" "H07" "H07d" "H08" "H09" "H10" "H11" "H12" "H13" "H14" "H15" "H16"
    "H20" "H21" "H22" "H23" "H24" "H25" "H26" "H27" "H28" "H29" "H30" "H31" "H32" "H33" "H34" "H35" "H36"
    "H37" "H38" "H39" "H40" "H41" "H42" "H43" "H44" "H45" "H51" "H55" "H56" "H58" "H59" "H61" "H62" "H63"
    "H64" "H65" "H66" "landing" "outside" "scale" "touchdown" "wound"
};

/// The tables beside them.
const TABLES: &[(&str, &str)] = &[("outside.csv", include_str!("../../cases/outside.csv"))];

/// A case as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseFile {
    pub(super) name: String,
    pub(super) title: String,
    /// For people.
    #[serde(rename = "source")]
    _source: String,
    #[serde(default, rename = "let")]
    values: Vec<String>,
    #[serde(default)]
    scene: Table,
    run: Vec<Run>,
    /// As it was read.
    #[serde(skip)]
    text: String,
    /// Its own, and those of its tables; none for a case that comes with the program.
    #[serde(skip)]
    pub(super) files: Vec<PathBuf>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Run {
    #[serde(default)]
    each: Rows,
    #[serde(default)]
    over: BTreeMap<String, Value>,
    #[serde(default)]
    quick: BTreeMap<String, Value>,
    #[serde(default, rename = "let")]
    values: Vec<String>,
    #[serde(default)]
    scene: Table,
    #[serde(default)]
    step: Step,
    mode: Option<Mode>,
    steps: Option<Value>,
    time: Option<Value>,
    #[serde(default)]
    drive: BTreeMap<String, Value>,
    file: Option<String>,
    /// Contents of that file.
    #[serde(skip)]
    table: Option<TimeTable>,
    solvers: Option<Solvers>,
    quick_solvers: Option<Fewer>,
    #[serde(default)]
    load: BTreeMap<String, Load>,
    rest: Option<Rest>,
    stretch: Option<Value>,
    shuffle: Option<Value>,
    #[serde(default)]
    places: Vec<Value>,
    halve: Option<Halve>,
    #[serde(default)]
    change: Vec<Change>,
    #[serde(default)]
    path: Vec<Value>,
    #[serde(default)]
    may_fail: MayFail,
    #[serde(default)]
    bodies: Vec<Bodies>,
    #[serde(default)]
    see: Vec<See>,
    #[serde(default)]
    finds: Vec<String>,
    #[serde(default)]
    keep: Vec<String>,
    #[serde(default)]
    audit: Vec<Table>,
    check: Vec<CheckEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "`each` is rows of values, or lists of them by name"
)]
enum Rows {
    Listed(Vec<Table>),
    Combined(BTreeMap<String, Value>),
}

impl Default for Rows {
    /// One without values.
    fn default() -> Self {
        Self::Listed(vec![Table::new()])
    }
}

/// Bodies of a cable that differ from the others.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bodies {
    cable: String,
    every: Option<usize>,
    heavier: Option<Value>,
    velocity: Option<[Value; 3]>,
    spin: Option<[f64; 3]>,
    turning: Option<[f64; 3]>,
}

/// A natural oscillation that a run starts in.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
struct Mode {
    coordinates: Vec<usize>,
    number: Value,
    amplitude: Value,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
struct Load {
    force: [Value; 3],
    torque: [Value; 3],
    #[serde(default)]
    at: [f64; 3],
}

/// What may end a run early.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "Value")]
enum MayFail {
    #[default]
    Nothing,
    Step,
    /// A step, or a joint beyond the scene's limits of gaps.
    Limits,
}

impl TryFrom<Value> for MayFail {
    type Error = &'static str;

    fn try_from(value: Value) -> Result<Self, Self::Error> {
        match (value.as_bool(), value.as_str()) {
            (Some(false), _) => Ok(Self::Nothing),
            (Some(true), _) => Ok(Self::Step),
            (_, Some("limits")) => Ok(Self::Limits),
            _ => Err("`may-fail` is true, false or \"limits\""),
        }
    }
}

/// How a scene comes to rest.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "`rest` is true, { steps, pass }, { creep }, { solved } or { follow, pass }"
)]
enum Rest {
    Settled(bool),
    Raised {
        steps: usize,
        pass: f64,
    },
    Followed {
        follow: Value,
        pass: Option<Value>,
    },
    Crept {
        creep: f64,
    },
    Solved {
        #[serde(rename = "solved")]
        _solved: bool,
    },
}

/// A change of the scene before a step.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    step: usize,
    remove: Option<String>,
    cut: Option<(String, usize)>,
    tie: Option<[String; 2]>,
}

/// Whether a balance of energy is kept, and how much may come from nowhere.
#[derive(Debug, Default, Clone, Copy, Deserialize)]
#[serde(try_from = "Value")]
struct Balance(Option<f64>);

impl TryFrom<Value> for Balance {
    type Error = &'static str;

    fn try_from(value: Value) -> Result<Self, Self::Error> {
        match value {
            Value::Boolean(kept) => Ok(Self(kept.then_some(ENERGY_TOLERANCE))),
            Value::Float(most) => Ok(Self(Some(most))),
            Value::Integer(most) => Ok(Self(Some(most as f64))),
            _ => Err("`balance` is true, or how much may come from nowhere, such as 1e-9"),
        }
    }
}

/// A bracket that is halved.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
struct Halve {
    name: String,
    from: Value,
    to: Value,
    times: Value,
    up: String,
}

/// Where a body has to be \[m].
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyAt {
    body: String,
    place: [f64; 3],
}

/// `NAME = FORMULA`, or the largest of several of them.
#[derive(Debug, Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "an entry of `see` is \"NAME = FORMULA\" or { repeat, see }"
)]
enum See {
    One(String),
    Largest { repeat: Value, see: String },
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
struct Step {
    dt: Option<Value>,
    substeps: Option<Value>,
    scheme: Option<String>,
    alpha: Option<Value>,
    guard: Option<Value>,
    paper: Option<Value>,
    #[serde(default)]
    balance: Balance,
    backend: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Solvers {
    Every,
    EveryUnguarded,
    EveryDirect,
    FirstUnguarded,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Fewer {
    Direct,
    First,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Distance {
    Relative,
    Absolute,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct CheckEntry {
    case: String,
    #[serde(default)]
    reference: String,
    ours: Option<String>,
    error: Option<String>,
    holds: Option<String>,
    #[serde(default)]
    unit: String,
    bar: Option<Value>,
    measure: Option<Distance>,
    by: Option<String>,
    note: Option<String>,
    limit: Option<Limit>,
    algebraic: Option<String>,
    /// Numbers of the reference and of ours, whose error is given.
    vector: Option<[Vec<String>; 2]>,
    time: Option<String>,
    space: Option<String>,
    #[serde(default)]
    by_solver: bool,
    by_run: Option<[String; 2]>,
    #[serde(rename = "if")]
    only: Option<String>,
    #[serde(default)]
    claim: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
struct Limit {
    when: String,
    cause: String,
}

impl CaseFile {
    /// Reads the case of a file, and the tables beside it.
    pub fn open(path: &Path) -> Result<Self, ExperimentError> {
        let beside = |name: &str| Ok(read_text(&path.with_file_name(name))?);
        let mut file = Self::read(&read_text(path)?, &beside)?;
        let tables = file.run.iter().filter_map(|run| run.file.as_ref());
        let tables = tables.map(|name| path.with_file_name(name));
        file.files = std::iter::once(path.to_owned()).chain(tables).collect();
        Ok(file)
    }

    /// Reads a case whose tables come with the program.
    ///
    /// # Errors
    /// [`CaseError`], in one line.
    pub fn parse(text: &str) -> Result<Self, CaseError> {
        Self::read(text, &|name| {
            let table = TABLES.iter().find(|(known, _)| *known == name);
            table.map_or(Err("unknown".into()), |(_, text)| Ok((*text).to_owned()))
        })
    }

    fn read(text: &str, table: &Tables<'_>) -> Result<Self, CaseError> {
        let syntax = |e: toml::de::Error| {
            let start = e.span().unwrap_or_default().start;
            CaseError::read(e.message(), []).at(line_of(text, start))
        };
        keys::refuse_unknown(text)?;
        let mut file: Self = toml::from_str(text).map_err(syntax)?;
        if file.name.trim().is_empty() {
            return Err(CaseError::message(&"it is empty").inside(&"name"));
        }
        for (k, run) in file.run.iter_mut().enumerate() {
            let sound = run.know_their_names(&file.values);
            let sound = sound.and_then(|()| run.read_table(table));
            sound.map_err(|e| located(e.into(), text, Some(k)))?;
        }
        text.clone_into(&mut file.text);
        let without = file.run.iter_mut().filter(|run| run.scene.is_empty());
        without.for_each(|run| run.scene.clone_from(&file.scene));
        Ok(file)
    }
}

/// Reads the table of a name.
type Tables<'a> = dyn Fn(&str) -> Result<String, Cause> + 'a;

impl Run {
    fn read_table(&mut self, read: &Tables<'_>) -> Result<(), CaseError> {
        if let Some(name) = &self.file {
            let table = read(name).and_then(|text| TimeTable::parse(&text));
            let inside = |e: Cause| CaseError::message(&e).within(name).inside(&"file");
            self.table = Some(table.map_err(inside)?);
        }
        Ok(())
    }

    /// Refuses names that only some rows have, and those of lists and audited rows that the run does not have.
    fn know_their_names(&self, shared: &[String]) -> Result<(), CaseError> {
        let none = BTreeMap::new();
        let (rows, lists) = match &self.each {
            Rows::Listed(rows) => (&rows[..], &none),
            Rows::Combined(lists) => (&[][..], lists),
        };
        let lists = || lists.iter().chain(&self.over);
        let mut names = vec!["long"];
        names.extend(
            rows.iter()
                .take(1)
                .flat_map(Table::keys)
                .map(String::as_str),
        );
        refuse_rows("each", rows, &names)?;
        names.extend(lists().map(|(name, _)| name.as_str()));
        let mut quick = self.quick.keys();
        if let Some(name) = quick.find(|name| !names.contains(&name.as_str())) {
            let error = CaseError::unknown("list", name, names.into_iter());
            return Err(error.inside(name).inside(&"quick"));
        }
        let tables = lists().filter_map(|(_, list)| list.as_array()).flatten();
        let tables = tables.filter_map(Value::as_table).flat_map(Table::keys);
        let halved = self.halve.iter().map(|halve| &halve.name);
        names.extend(tables.chain(halved).map(String::as_str));
        names.extend(
            shared
                .iter()
                .filter_map(|text| Some(text.split_once('=')?.0.trim())),
        );
        refuse_rows("audit", &self.audit, &names)
    }
}

/// Refuses values of rows that are not `known`.
fn refuse_rows(key: &str, rows: &[Table], known: &[&str]) -> Result<(), CaseError> {
    for (k, row) in rows.iter().enumerate() {
        if let Some(name) = row.keys().find(|name| !known.contains(&name.as_str())) {
            let error = CaseError::unknown("value", name, known.iter().copied());
            return Err(error.inside(name).inside(&k).inside(&key));
        }
    }
    Ok(())
}

/// A file of a case that cannot be read or run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CaseError {
    /// In the words of a reader, a scene or a step.
    #[error("{message}")]
    Message { message: String },
    /// A name that there is not, and a hint at those that there are.
    #[error("no {kind} is called `{name}`{hint}")]
    Unknown {
        kind: &'static str,
        name: String,
        hint: String,
    },
    #[error("`{function}` takes {count} arguments, not {found}")]
    Arguments {
        function: String,
        count: usize,
        found: usize,
    },
    /// Formulas end too early, or go on.
    #[error("{expected} is missing before `{found}`")]
    Formula {
        expected: &'static str,
        found: String,
    },
    /// A number is needed that is another in each step or run.
    #[error("it is another number in each step or run: reduce it, as by `last` or `largest`")]
    Varies,
    /// `NAME = FORMULA` without a name.
    #[error("`{text}`: write `NAME = FORMULA`")]
    NoName { text: String },
    /// Neither how many steps, nor how long; or what is compared.
    #[error("{place} needs `{key}`")]
    Missing {
        key: &'static str,
        place: &'static str,
    },
    /// A count that is too small, no whole number, or too large; or a time: what it has to be.
    #[error("`{key}` is {found}: it has to be {range}")]
    Count {
        key: &'static str,
        found: f64,
        range: String,
    },
    /// An error, and the formula or the text that it is in.
    #[error("`{text}`: {error}")]
    Within { text: String, error: Box<Self> },
    /// An error, and the keys that lead to it in its run.
    #[error("`{}`: {error}", path.join("."))]
    InKey { path: Vec<String>, error: Box<Self> },
    /// An error, and the line that it is in.
    #[error("line {line}: {error}")]
    At { line: usize, error: Box<Self> },
}

impl CaseError {
    fn message(message: &dyn fmt::Display) -> Self {
        let message = message.to_string();
        Self::Message { message }
    }

    fn at(self, line: usize) -> Self {
        Self::At {
            line,
            error: Box::new(self),
        }
    }

    /// The error under a key, or a number in a list, that is put before the keys that it has.
    fn inside(self, key: &dyn fmt::Display) -> Self {
        let (mut path, error) = match self {
            Self::InKey { path, error } => (path, error),
            error => (Vec::new(), Box::new(error)),
        };
        path.insert(0, key.to_string());
        Self::InKey { path, error }
    }

    fn within(self, text: &str) -> Self {
        match self {
            Self::Within { .. } => self,
            error => Self::Within {
                text: text.to_owned(),
                error: Box::new(error),
            },
        }
    }

    fn unknown<'a>(kind: &'static str, name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        let mut known = known.filter(|known| *known != name).peekable();
        let none = [": there is none", ""][usize::from(known.peek().is_some())];
        let near = nearest(name, known).map(|known| format!(": perhaps `{known}`"));
        let (name, hint) = (name.to_owned(), near.unwrap_or_else(|| none.to_owned()));
        Self::Unknown { kind, name, hint }
    }

    /// A reader's message in one line: the names that it expects are many, it has the nearest of them and of `more`.
    fn read<'a>(message: &'a str, more: impl IntoIterator<Item = &'a str>) -> Self {
        let message = message.lines().next().unwrap_or_default();
        let kind = ["key", "choice"][usize::from(message.contains("variant"))];
        let expected = message.split(" (").next().unwrap_or_default();
        let of_variant = expected.strip_prefix("unexpected keys in table: ");
        let mut names = match of_variant {
            Some(names) => names
                .split(", available keys: ")
                .flat_map(|names| names.split(", "))
                .collect::<Vec<_>>(),
            None if expected.starts_with("unknown") => {
                expected.split('`').skip(1).step_by(2).collect()
            }
            None => Vec::new(),
        }
        .into_iter();
        match names.next() {
            Some(name) => Self::unknown(kind, name, names.chain(more)),
            None => Self::message(&message),
        }
    }
}

#[cfg(test)]
mod tests;
