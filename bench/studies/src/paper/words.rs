//! Texts of the checks, columns of the tables, titles and axes of the charts: those of `words.toml`, with the values of a
//! row in them. In braces stands a key of the row, `{key}` or `{key:form}`, with a form of [`shown`].

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::LazyLock;
use taut_output::check::{Check, ExperimentError, Measure, Outcome, Verdict};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::row::{self, Row};
use taut_output::settings::distinct;
use taut_output::table::{self, nanoseconds, ratio};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Words {
    title: BTreeMap<String, String>,
    check: BTreeMap<String, Said>,
    /// Heading and cell of each column.
    table: BTreeMap<String, Vec<[String; 2]>>,
    chart: BTreeMap<String, Drawn>,
    text: BTreeMap<String, String>,
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
}

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
}

static WORDS: LazyLock<Words> = LazyLock::new(|| {
    let read = toml::from_str(include_str!("words.toml"));
    read.unwrap_or_else(|e| panic!("words.toml: {e}"))
});

pub(super) fn title(name: &str) -> &'static str {
    &WORDS.title[name]
}

/// A check whose words are known, before it is judged.
pub(super) struct Told {
    said: &'static Said,
    row: Value,
}

pub(super) fn tell(name: &str, row: Value) -> Told {
    let said = &WORDS.check[name];
    Told { said, row }
}

impl Told {
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
    pub(super) fn beside(self, values: [f64; 2]) -> Check {
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

/// A text with the values of a row.
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

/// A value: as Rust writes it in that form, or as time, mass ratio, decade, share, angle or number a second.
fn shown(value: &Value, form: &str) -> String {
    let Some(x) = value.as_f64() else {
        return match value {
            Value::String(text) => text.clone(),
            Value::Bool(is_so) => ["no", "yes"][usize::from(*is_so)].to_owned(),
            _ => String::new(),
        };
    };
    let digits = form.trim_matches(['+', '.', 'e']).parse::<usize>().ok();
    match (form, digits) {
        ("ns", _) => nanoseconds(x),
        ("ratio", _) => ratio(x),
        ("decade", _) => format!("{:.2}", x.log10()),
        ("share", _) => format!("{:.2} %", 100.0 * x),
        ("angle", _) => format!("{:.0}°", x.to_degrees()),
        ("per", _) => format!("{:.0}", x.recip()),
        (_, Some(digits)) if form.ends_with('e') => format!("{x:.digits$e}"),
        (_, Some(digits)) if form.starts_with('+') => format!("{x:+.digits$}"),
        (_, Some(digits)) => format!("{x:.digits$}"),
        (_, None) => x.to_string(),
    }
}

/// A number of a row, NaN where it has none.
pub(crate) fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or(f64::NAN)
}

/// A record as a row, with more values.
pub(super) fn with(record: &impl Serialize, more: &Value) -> Value {
    let mut row = serde_json::to_value(record).unwrap_or_default();
    for (key, value) in more.as_object().into_iter().flatten() {
        row[key.as_str()] = value.clone();
    }
    row
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

/// A chart of series, with the values of a row in its title and labels.
pub(super) fn chart(name: &str, row: &Value, series: Vec<Series>) -> Chart {
    let drawn = &WORDS.chart[name];
    let axis = |letter, label| Axis {
        log: drawn.log.contains(letter),
        ..Axis::linear(&filled(label, row))
    };
    Chart {
        title: filled(&drawn.title, row),
        x: axis('x', &drawn.x),
        y: Axis {
            range: drawn.range,
            ..axis('y', &drawn.y)
        },
        series,
    }
}

/// Points of rows, a series for each name that they make.
pub(super) fn series<'a>(
    rows: impl IntoIterator<Item = &'a Value>,
    name: &str,
    [x, y]: [&str; 2],
    mark: Mark,
) -> Vec<Series> {
    let rows = rows.into_iter();
    let named: Vec<_> = rows.map(|row| (filled(name, row), row)).collect();
    let names = distinct(named.iter().map(|(name, _)| name));
    let one = |name: &String| {
        let own = named.iter().filter(|(known, _)| known == name);
        let point = |row: &Value| Some([row[x].as_f64()?, row[y].as_f64()?]);
        let points = own.filter_map(|(_, row)| point(row)).collect();
        Series::new(name, points, mark)
    };
    names.into_iter().map(one).collect()
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
    let rows: Vec<Row> = rows
        .iter()
        .filter_map(|row| row.as_object().cloned())
        .collect();
    let mut out = Vec::new();
    row::csv(&rows, &mut out)?;
    Ok(String::from_utf8_lossy(&out).into_owned())
}

/// The line on which ours is the theory, up to an end.
pub(super) fn diagonal(name: &str, end: f64) -> Series {
    Series::new(name, vec![[0.0, 0.0], [end, end]], Mark::Line)
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
        assert_eq!(
            filled(text, &row),
            "1.25 1.2 +1.25 1e0 6 x yes 1e5 5.00 125.00 %"
        );
    }
}
