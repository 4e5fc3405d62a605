//! Texts of the checks, columns of the tables, titles and axes of the charts: those of `words.toml`, with the values of a
//! row in them. In braces stands a key of the row, `{key}` or `{key:form}`, with a form of [`formed`].

use crate::motions::joined;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::LazyLock;
use taut_measure::errors::worse;
use taut_output::check::{Check, ExperimentError, Measure, Outcome, Verdict};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::settings::distinct;
use taut_output::table::formed;
use taut_output::{row, table};
use taut_solver::{Backend, ParseBackendError};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Words {
    title: BTreeMap<String, String>,
    check: BTreeMap<String, Said>,
    /// Heading and cell of each column.
    table: BTreeMap<String, Vec<[String; 2]>>,
    chart: BTreeMap<String, Drawn>,
    text: BTreeMap<String, String>,
    /// Backends of solvers.
    solver: BTreeMap<String, String>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Said {
    case: String,
    reference: String,
    ours: String,
    by: String,
    note: String,
    /// Largest error that passes, where the row has none.
    bar: Option<f64>,
    /// Unit of a number beside its reference.
    unit: String,
    /// The error of such a number is a difference, not a ratio.
    absolute: bool,
    /// The bar judges the paper's value instead of ours.
    published: bool,
    /// Verdict of a statement that is so, and of one that is not.
    verdicts: Option<[Verdict; 2]>,
    /// Columns of rows whose largest error is judged, and the rows that take part.
    worst: Vec<String>,
    only: Only,
}

/// What rows that take part have in some columns.
type Only = BTreeMap<String, Value>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Drawn {
    title: String,
    x: String,
    y: String,
    /// Axes that are logarithmic.
    #[serde(default)]
    log: String,
    range: Option<[f64; 2]>,
    /// From the rows' numbers to those of the vertical axis.
    factor: Option<f64>,
    #[serde(default)]
    lines: Vec<Line>,
}

/// Series of a chart: points of its own, or those of rows, a series for each name that they make.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Line {
    name: String,
    mark: Mark,
    points: Vec<[f64; 2]>,
    columns: [String; 2],
    only: Only,
}

static WORDS: LazyLock<Words> = LazyLock::new(|| {
    let read = toml::from_str(include_str!("words.toml"));
    read.unwrap_or_else(|e| panic!("words.toml: {e}"))
});

pub(super) fn title(name: &str) -> &'static str {
    &WORDS.title[name]
}

pub(super) fn backend(solver: &str) -> Result<Backend, ParseBackendError> {
    WORDS.solver[solver].parse()
}

/// A check whose words are known, before it is judged.
pub(super) struct NamedCheck {
    said: &'static Said,
    row: Value,
}

pub(super) fn named_check(name: &str, row: Value) -> NamedCheck {
    let said = &WORDS.check[name];
    NamedCheck { said, row }
}

impl NamedCheck {
    /// A statement that is so, or is not.
    pub(super) fn so(self, is_so: bool) -> Check {
        let either = [Verdict::Holds, Verdict::DoesNotHold];
        let verdicts = self.said.verdicts.unwrap_or(either);
        self.judged(Verdict::either(is_so, verdicts))
    }

    pub(super) fn judged(self, verdict: Verdict) -> Check {
        let [case, reference, ours] = self.texts();
        self.finished(Check::claim(case, reference, ours, verdict, ""))
    }

    /// An error that must be within the bar.
    pub(super) fn off(mut self, error: f64) -> Check {
        self.row["error"] = error.into();
        let [case, reference, ours] = self.texts();
        let check = Check::within(case, reference, ours, error, self.bar());
        self.finished(check)
    }

    /// A number beside its reference.
    pub(super) fn compared_with(self, values: [f64; 2]) -> Check {
        let measure = match self.said.absolute {
            true => Measure::Absolute,
            false => Measure::Relative,
        };
        let ([case, ..], unit) = (self.texts(), self.said.unit.as_str());
        let check = Check::number(case, values, unit, measure, self.bar());
        self.finished(check)
    }

    fn texts(&self) -> [String; 3] {
        [&self.said.case, &self.said.reference, &self.said.ours].map(|t| filled(t, &self.row))
    }

    fn bar(&self) -> f64 {
        let own = self.row.get("bar").and_then(Value::as_f64);
        own.or(self.said.bar).unwrap_or(f64::NAN)
    }

    fn finished(self, mut check: Check) -> Check {
        check.note = filled(&self.said.note, &self.row);
        if !self.said.by.is_empty() {
            check.criterion = filled(&self.said.by, &self.row);
        }
        match self.said.published {
            true => check.published(),
            false => check,
        }
    }
}

pub(super) fn filled(text: &str, row: &Value) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        let (inner, after) = after.split_once('}').unwrap_or((after, ""));
        let (key, form) = inner.split_once(':').unwrap_or((inner, ""));
        out.push_str(before);
        out.push_str(&shown(&row[key], form));
        rest = after;
    }
    out + rest
}

fn shown(value: &Value, form: &str) -> String {
    match value {
        Value::Number(_) => formed(value.as_f64().unwrap_or(f64::NAN), form),
        Value::String(text) => text.clone(),
        Value::Bool(is_so) => ["no", "yes"][usize::from(*is_so)].to_owned(),
        _ => String::new(),
    }
}

/// A number of a row, NaN where it has none.
pub(crate) fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or(f64::NAN)
}

/// The smallest and the largest of some numbers.
pub(super) fn extremes(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values.fold(none, |[low, high], x| [x.min(low), x.max(high)])
}

/// The largest of some errors; NaN where one is.
pub(super) fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, worse)
}

/// The largest error of a column; NaN where a row has none.
pub(super) fn worst<'a>(rows: impl IntoIterator<Item = &'a Value>, key: &str) -> f64 {
    largest(rows.into_iter().map(|row| number(row, key)))
}

/// A record as a row, with more values.
pub(super) fn with(record: &impl Serialize, more: &Value) -> Value {
    let record = serde_json::to_value(record).unwrap_or_default();
    joined([record, more.clone()])
}

pub(super) fn table<'a>(name: &str, rows: impl IntoIterator<Item = &'a Value>) -> String {
    let columns = &WORDS.table[name];
    let headings: Vec<&str> = columns.iter().map(|[heading, _]| &**heading).collect();
    let mut t = table::table(&headings);
    for row in rows {
        t.add_row(columns.iter().map(|[_, cell]| filled(cell, row)));
    }
    table::text(&t)
}

/// A text above, between or below tables.
pub(super) fn text(name: &str, row: &Value) -> String {
    filled(&WORDS.text[name], row)
}

/// A chart of rows, with the values of another row in its title and labels.
pub(super) fn chart<'a>(
    name: &str,
    row: &Value,
    rows: impl IntoIterator<Item = &'a Value>,
) -> Chart {
    let drawn = &WORDS.chart[name];
    let axis = |letter, label| Axis {
        log: drawn.log.contains(letter),
        ..Axis::linear(&filled(label, row))
    };
    let rows: Vec<&Value> = rows.into_iter().collect();
    let factor = drawn.factor.unwrap_or(1.0);
    let series = drawn
        .lines
        .iter()
        .flat_map(|line| line.series(&rows, factor));
    Chart {
        title: filled(&drawn.title, row),
        x: axis('x', &drawn.x),
        y: Axis {
            range: drawn.range,
            ..axis('y', &drawn.y)
        },
        series: series.collect(),
    }
}

impl Line {
    fn series(&self, rows: &[&Value], factor: f64) -> Vec<Series> {
        if !self.points.is_empty() {
            return vec![Series::new(&*self.name, self.points.clone(), self.mark)];
        }
        let rows = rows.iter().filter(|row| takes(&self.only, row));
        let named: Vec<_> = rows.map(|row| (filled(&self.name, row), row)).collect();
        let one = |name: &String| {
            let own = named.iter().filter(|(known, _)| known == name);
            let [x, y] = self.columns.each_ref();
            let point = |row: &Value| Some([row[x].as_f64()?, factor * row[y].as_f64()?]);
            let points = own.filter_map(|(_, row)| point(row)).collect();
            Series::new(name, points, self.mark)
        };
        let names = distinct(named.iter().map(|(name, _)| name));
        names.into_iter().map(one).collect()
    }
}

fn takes(only: &Only, row: &Value) -> bool {
    only.iter().all(|(key, value)| row[key] == *value)
}

/// The checks of those names, for each set of rows that share a column, of the largest errors in it.
pub(super) fn judged(rows: &[Value], shared: &str, names: &[&str]) -> Vec<Check> {
    let groups = rows.chunk_by(|a, b| a[shared] == b[shared]);
    let check = |group: &[Value], name: &&str| {
        let said = &WORDS.check[*name];
        let own = || group.iter().filter(|row| takes(&said.only, row));
        let error = largest(said.worst.iter().map(|key| worst(own(), key)));
        Some(named_check(name, group.last()?.clone()).off(error))
    };
    groups
        .flat_map(|group| names.iter().filter_map(move |name| check(group, name)))
        .collect()
}

/// What an experiment ends in, with its rows as CSV.
pub(super) fn outcome(
    checks: Vec<Check>,
    text: String,
    rows: &[Value],
    charts: Vec<Chart>,
) -> Result<Outcome, ExperimentError> {
    Ok(Outcome {
        checks,
        text,
        csv: lines(rows)?,
        charts,
        ..Outcome::default()
    })
}

/// Rows as CSV with a header.
pub(super) fn lines(rows: &[Value]) -> Result<String, ExperimentError> {
    let rows = row::rows_of(&Value::from(rows), "");
    let mut out = Vec::new();
    row::csv(&rows, &mut out)?;
    Ok(String::from_utf8_lossy(&out).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_stand_in_their_forms() {
        let row = json!({ "a": 1.25, "n": 6, "text": "x", "is": true, "none": null, "r": 1e5 });
        let text =
            "{a} {a:.1} {a:+.2} {a:.0e} {n} {text} {is} {none}{r:ratio} {r:decade} {a:share}";
        let found = filled(text, &row);
        assert_eq!(found, "1.25 1.2 +1.25 1e0 6 x yes 1e5 5.00 125.00 %");
    }
}
