//! What a case guarantees, listed without a run.

use super::rows::{combined, gathered, rows, with_row};
use super::run::holds;
use super::text::{Names, closing};
use super::{CaseError, CaseFile, CheckEntry, Distance, Run};
use std::collections::BTreeSet;
use taut_output::table::formed;
use toml::{Table, Value};

/// Most values that are listed one by one.
const MOST: usize = 4;

/// A line for each check: what is guaranteed, and with which number, over all rows of its run.
pub(in crate::hard) fn guarantees(file: &CaseFile) -> Vec<String> {
    let mut shared = Names::new(false);
    let mut lines: Vec<String> = Vec::new();
    // What is not known before the run is left open.
    let _ = shared.define(&file.values);
    for run in &file.run {
        let rows = rows(run, &shared).unwrap_or_default();
        let rows: Vec<Names> = rows
            .iter()
            .filter_map(|row| known(run, row, &shared).ok())
            .collect();
        let each = run.check.iter().filter_map(|check| guarantee(check, &rows));
        for line in each {
            if !lines.contains(&line) {
                lines.push(line);
            }
        }
    }
    lines
}

/// Names of a row's runs together, of those values that are known before the run.
fn known(run: &Run, row: &Table, shared: &Names) -> Result<Names, CaseError> {
    let mut names = with_row(shared, row)?;
    if let Some(halve) = &run.halve {
        names.add(&halve.name, &halve.from)?;
    }
    let runs = combined(run, &run.over, &names)?.into_iter().map(|row| {
        let mut names = with_row(&names, &row)?;
        let _ = names.define(&run.values);
        Ok(names)
    });
    let runs = runs.collect::<Result<Vec<_>, CaseError>>()?;
    Ok(gathered(&runs.iter().collect::<Vec<_>>()))
}

fn guarantee(check: &CheckEntry, rows: &[Names]) -> Option<String> {
    let made = |names: &&Names| holds(check.only.as_deref(), names).unwrap_or(true);
    let rows: Vec<&Names> = rows.iter().filter(made).collect();
    let formula = |text: &str| {
        let each = rows
            .iter()
            .map(|names| names.number(&Value::String(text.to_owned())));
        let each = each.map(|x| x.ok().filter(|x| !x.is_nan()).map(short));
        each.collect::<Option<_>>().map(together)
    };
    let is_words = check.holds.is_some() || check.error.is_some() && check.vector.is_none();
    let reference = match is_words {
        true => filled(&check.reference, &rows),
        false => formula(&check.reference).unwrap_or_else(|| match check.reference.as_str() {
            "" => "the reference".to_owned(),
            name => format!("what the run has as `{name}`"),
        }),
    };
    let bar = check.bar.as_ref().map(|bar| match bar {
        Value::String(text) => formula(text).unwrap_or_else(|| "a bar of the run".to_owned()),
        Value::Float(bar) => format!("{bar:e}"),
        bar => bar.to_string(),
    });
    // Two formulas are compared by their ratio, unless they say otherwise.
    let is_relative =
        check.ours.is_some() && !is_words && check.measure != Some(Distance::Absolute);
    let bar = bar.map_or_else(String::new, |bar| match is_relative {
        true => format!(" {} within {bar} of it", check.unit),
        false => format!(" within {bar} {}", check.unit),
    });
    let case = filled(&check.case, &rows);
    let bar = bar.trim_end().replace("  ", " ");
    let line = format!("{case}: {reference}{bar}");
    (!rows.is_empty()).then_some(line)
}

/// A number as people write it.
fn short(x: f64) -> String {
    match x.abs() {
        0.0 | 1e-3..1e6 => {
            let digits = formed(x, ".5");
            digits
                .trim_end_matches('0')
                .trim_end_matches('.')
                .to_owned()
        }
        _ => formed(x, ".4e"),
    }
}

/// A text with what its braces stand for in all rows.
fn filled(text: &str, rows: &[&Names]) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        let Some(end) = closing(after) else {
            break;
        };
        let each = rows
            .iter()
            .map(|names| names.text(&format!("{{{}}}", &after[..end])));
        let each = each.map(|text| text.ok().filter(|text| !text.contains("NaN")));
        let all = each.collect::<Option<_>>().map(together);
        out.extend([before, all.as_deref().unwrap_or("…")]);
        rest = &after[end + 1..];
    }
    out += rest;
    while out.contains("…, …") {
        out = out.replace("…, …", "…");
    }
    out
}

/// Texts of all rows in one: each of a few, the ends of many numbers, the first of many words.
fn together(mut all: Vec<String>) -> String {
    let number = |text: &String| text.parse::<f64>().unwrap_or(f64::NAN);
    let are_numbers = all.iter().all(|text| !number(text).is_nan());
    if are_numbers {
        all.sort_by(|a, b| number(a).total_cmp(&number(b)));
    }
    let mut seen = BTreeSet::new();
    all.retain(|text| seen.insert(text.clone()));
    match &all[..] {
        [first, .., last] if all.len() > MOST && are_numbers => format!("{first} … {last}"),
        [a, b, ..] if all.len() > MOST => format!("{a}, {b}, …"),
        all => all.join(", "),
    }
}
