//! Hard cases as files: a scene, what is seen in its run, and what that has to be.
//!
//! A string that begins with `=` stands for a number, as in a spreadsheet: `"=mu * g"` ([`expression`]); `{mu}`, `{x:.3}`
//! and `{x:+e}` in any other string of a scene or a check for the text of one.
//!
//! | top | meaning |
//! |---|---|
//! | `name`, `title` | as `taut hard` lists it |
//! | `source` | where the reference comes from, and its derivation |
//! | `let` | values that all runs share, `"NAME = FORMULA"` each, in order; `pi` and `quick` (1 or 0) are there |
//! | `scene` | that of the runs that have none of their own |
//!
//! | `[[run]]` | meaning |
//! |---|---|
//! | `each` | rows of values, or lists by name with all their combinations: each is run and checked by itself, one with
//! | | `long = true` only in a whole run |
//! | `over` | lists of values, or of tables of them, or counts from 0 on by name, all combinations of which are run together: their results are series |
//! | `quick` | shorter lists for the quick run |
//! | `let` | as above, from the values of the row, too |
//! | `scene` | a scene as `taut run` reads it; an entry with `repeat = N` stands N times, with `k` = 0, 1, …, or its `value` |
//! | `bodies` | segments of a `cable`, each or `every` so many: so much `heavier`, with a `velocity`, with a `spin` about the origin,
//! | | with a `turning` of their own |
//! | `mode` | natural oscillation that the run starts in: `coordinates` of a body that move, 0 to 5, its `number` from 0,
//! | | its `amplitude`; its frequency is `eigenvalue`, its largest coordinate is seen as `mode` |
//! | `rest` | `true`: the run starts where the scene comes to rest; `{ steps, pass }`: its loads raised in so many steps, by
//! | | passes of so many seconds; `{ creep }`: brought there by the solver alone, by such passes; `{ solved = true }`: by its
//! | | own static equilibrium; `{ follow, pass }`: its loads are raised in so many steps, and the run is what comes to rest in
//! | | each, by such passes if there are any |
//! | `stretch` | compliance of all ball joints, m/N |
//! | `shuffle` | seed of another order of bodies and constraints, in which the scene is run; 0 leaves them their own |
//! | `places` | where bodies have to be, `{ body, place }` each: the farthest from it is seen as `misplaced` |
//! | `step` | `dt` (default 1/60 s), `substeps`, `scheme`; `paper = true`: the paper's; `alpha`: weight of the geometric
//! | | stiffness; `guard = false`; `balance = true` keeps one of energy; `backend`: without refinement |
//! | `steps` or `time` | how long |
//! | `drive` | values of controls, and velocities of driven bodies, by name: formulas of the `time` at which a step begins |
//! | `load` | `force`, `torque` and the point `at` which the force acts, in the body's frame, by bodies' names: formulas of the
//! | | `time` |
//! | `change` | before the step of that number, or of each where it is 0: `remove` a constraint, `cut` a cable at the joint
//! | | of that number, `tie` two bodies rigidly at their distance until the next change |
//! | `solvers` | `every`: by every solver; `every-direct`: by all that do not iterate; `every-unguarded`: each step is one
//! | | solve; `first-unguarded`: by the first alone |
//! | `quick-solvers` | of those in the quick run: the `direct` ones alone, or the `first` |
//! | `may-fail` | `true`: a step that fails ends the run, `"limits"`: so does a joint beyond the scene's limits of gaps; `failed` is 1,
//! | | and `singular` where the matrix was and its constraint is named; `ended` says why, `ended_at` is when |
//! | `see` | `"NAME = FORMULA"` each, in order, with texts in braces as elsewhere, of columns of `taut run`, of [`probes`] and of what is above: one number each |
//! | | An entry `{ repeat = N, see = "…" }` stands N times, with `{k}` = 0, 1, …: the largest of them is seen |
//! | `path` | bodies whose ways are compared, 60 places a second, or where they begin in a run without steps: `apart`, the largest
//! | | distance from those of the last run of the row, `to_next`, of the run after it, `from_first`, of the first solver |
//! | `halve` | a bracket: runs with its `name` at `from` and at `to`, between which `times` halvings find the value from which on
//! | | `up` holds, `found` ± `width`; `low.NAME` is what the first run has seen |
//! | `finds` | as above, of all the runs of a row together |
//! | `keep` | names of what is found that later runs have in place of values of the file's `let` |
//! | `audit` | values of the row with which every solver's claims are audited on the scene |
//!
//! | `[[run.check]]` | meaning |
//! |---|---|
//! | `case` | what it is |
//! | `ours` and `reference` | two formulas that are compared, or |
//! | `error` | a formula for how far it is from `reference`, which is in words; `ours` may put it in words, or |
//! | `holds` | a condition, for `reference` and `ours` in words |
//! | `vector` | numbers of the reference and of ours, beside an `error` |
//! | `unit`, `bar`, `measure` | of the error: `relative` (default where two are compared), `absolute` |
//! | `by`, `note` | what is measured; what else is worth knowing |
//! | `limit` | `{ when = …, cause = "…" }`: a failure that is a known limit |
//! | `algebraic`, `time`, `space` | parts of the error |
//! | `by-solver` | `true`: each solver by itself, those that pass alike in one row |
//! | `by-run` | two texts, what a run is called and several of them: so each run |
//! | `claim` | `true`: it `holds` or does not, as a statement of others |
//! | `if` | the check is made where this holds |

mod changes;
mod drive;
mod expression;
pub(super) mod frequency;
mod judge;
mod oracles;
mod probes;
mod rest;
mod rod;
mod run;
mod sights;
mod text;

use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use taut_ground::trajectory::ENERGY_TOLERANCE;
use toml::{Table, Value};

pub(super) use run::{outcome, scenes, verify};

/// The files of this folder, in the order in which they are told.
macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(include_str!(concat!("../../cases/", $name, ".toml"))),*]
    };
}

pub(super) const FILES: &[&str] = files![
    "H01",
    "H02",
    "H03",
    "H04",
    "H05",
    "H06",
    "H07",
    "H07d",
    "H08",
    "H09",
    "H10",
    "H11",
    "H12",
    "H13",
    "H14",
    "H15",
    "H16",
    "H20",
    "H21",
    "H22",
    "H23",
    "H24",
    "H25",
    "H26",
    "H27",
    "H28",
    "H29",
    "H30",
    "H31",
    "H32",
    "H33",
    "H34",
    "H35",
    "H36",
    "H37",
    "H38",
    "H39",
    "H40",
    "H41",
    "H42",
    "H43",
    "H44",
    "H45",
    "H51",
    "H55",
    "H56",
    "H58",
    "H59",
    "H61",
    "H62",
    "H63",
    "H64",
    "H65",
    "H66",
    "landing",
    "scale",
    "touchdown",
    "wound",
];

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
#[serde(untagged)]
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
#[serde(deny_unknown_fields)]
struct Mode {
    coordinates: Vec<usize>,
    number: Value,
    amplitude: Value,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Load {
    force: [Value; 3],
    torque: [Value; 3],
    #[serde(default)]
    at: [f64; 3],
}

/// What may end a run early.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(from = "Value")]
enum MayFail {
    #[default]
    Nothing,
    Step,
    /// A step, or a joint beyond the scene's limits of gaps.
    Limits,
}

impl From<Value> for MayFail {
    fn from(value: Value) -> Self {
        match value {
            Value::Boolean(false) => Self::Nothing,
            Value::String(_) => Self::Limits,
            _ => Self::Step,
        }
    }
}

/// How a scene comes to rest.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
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
    #[serde(rename_all = "kebab-case")]
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
#[serde(from = "Value")]
struct Balance(Option<f64>);

impl From<Value> for Balance {
    fn from(value: Value) -> Self {
        let usual = (value.as_bool() == Some(true)).then_some(ENERGY_TOLERANCE);
        Self(usual.or(value.as_float()))
    }
}

/// A bracket that is halved.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
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
struct Place {
    body: String,
    place: [f64; 3],
}

/// `NAME = FORMULA`, or the largest of several of them.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum See {
    One(String),
    Largest { repeat: Value, see: String },
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
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
#[serde(deny_unknown_fields)]
struct Limit {
    when: String,
    cause: String,
}

impl CaseFile {
    /// Reads a case.
    ///
    /// # Errors
    /// [`CaseError`], in one line.
    pub fn parse(text: &str) -> Result<Self, CaseError> {
        let mut file: Self = toml::from_str(text).map_err(|e| CaseError::toml(&e, text))?;
        let without = file.run.iter_mut().filter(|run| run.scene.is_empty());
        without.for_each(|run| run.scene.clone_from(&file.scene));
        Ok(file)
    }

    /// A line for each check: what is guaranteed, and with which number.
    pub(super) fn guarantees(&self) -> impl Iterator<Item = String> {
        let checks = self.run.iter().flat_map(|run| &run.check);
        checks.map(|check| {
            let bar = match &check.bar {
                Some(Value::String(bar)) => format!(" within {}", bar.trim_start_matches('=')),
                Some(Value::Float(bar)) => format!(" within {bar:e}"),
                Some(bar) => format!(" within {bar}"),
                None => String::new(),
            };
            let unit = [" ", &check.unit].concat();
            let unit = if check.unit.is_empty() { "" } else { &unit };
            format!("{}: {}{bar}{unit}", check.case, check.reference)
        })
    }
}

/// A file of a case that cannot be read or run.
#[derive(Debug, Clone, PartialEq)]
pub enum CaseError {
    /// As TOML, or for its keys.
    Toml { line: usize, message: String },
    /// A name that there is not, and the nearest that there is.
    Unknown {
        kind: &'static str,
        name: String,
        nearest: Option<String>,
    },
    Arguments {
        function: String,
        count: usize,
        found: usize,
    },
    /// Formulas end too early, or go on.
    Formula {
        expected: &'static str,
        found: String,
    },
    /// A number is needed that is another in each step or run.
    Varies,
    /// `NAME = FORMULA` without a name.
    NoName { text: String },
    /// Neither how many steps, nor how long; or what is compared.
    Missing {
        key: &'static str,
        place: &'static str,
    },
    /// A count that is negative, no number, or too large.
    Count {
        key: &'static str,
        found: f64,
        most: f64,
    },
    /// An error, and the formula or the text that it is in.
    Within { text: String, error: Box<CaseError> },
}

impl CaseError {
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
        Self::Unknown {
            kind,
            name: name.to_owned(),
            nearest: nearest(name, known),
        }
    }

    /// In one line: the keys that are expected are many, the nearest one is told.
    fn toml(error: &toml::de::Error, text: &str) -> Self {
        let Range { start, .. } = error.span().unwrap_or_default();
        let line = 1 + text[..start].matches('\n').count();
        let message = error.message().lines().next().unwrap_or_default();
        let mut names = message.split('`').skip(1).step_by(2);
        if !message.starts_with("unknown") {
            let message = message.to_owned();
            return Self::Toml { line, message };
        }
        let name = names.next().unwrap_or_default();
        let error = Self::unknown("key", name, names);
        error.within(&format!("line {line}"))
    }
}

impl fmt::Display for CaseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Toml { line, message } => write!(f, "line {line}: {message}"),
            Self::Unknown {
                kind,
                name,
                nearest,
            } => {
                write!(f, "no {kind} is called `{name}`")?;
                let near = nearest.iter();
                near.into_iter()
                    .try_for_each(|near| write!(f, ": perhaps `{near}`"))
            }
            Self::Arguments {
                function,
                count,
                found,
            } => write!(f, "`{function}` takes {count} arguments, not {found}"),
            Self::Formula { expected, found } => {
                write!(f, "{expected} is missing before `{found}`")
            }
            Self::Varies => write!(
                f,
                "it is another number in each step or run: reduce it, as by `last` or `largest`"
            ),
            Self::NoName { text } => write!(f, "`{text}`: write `NAME = FORMULA`"),
            Self::Missing { key, place } => write!(f, "{place} needs `{key}`"),
            Self::Count { key, found, most } => {
                write!(f, "`{key}` is {found}: it has to be from 0 to {most:.0e}")
            }
            Self::Within { text, error } => write!(f, "`{text}`: {error}"),
        }
    }
}

impl std::error::Error for CaseError {}

/// The name that takes the fewest changes of a letter.
fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let changes = |other: &str| {
        let other: Vec<char> = other.chars().collect();
        let mut row: Vec<usize> = (0..=other.len()).collect();
        for (i, a) in name.chars().enumerate() {
            let (mut above, mut left) = (row[0], i + 1);
            row[0] = left;
            for (j, b) in other.iter().enumerate() {
                let here = (above + usize::from(a != *b)).min(left.min(row[j + 1]) + 1);
                (above, left) = (row[j + 1], here);
                row[j + 1] = here;
            }
        }
        row[other.len()]
    };
    known.min_by_key(|k| changes(k)).map(str::to_owned)
}

#[cfg(test)]
mod tests;
