//! Rows of values of a run, and what its runs have together.

use super::text::{Names, counted};
use super::{CaseError, Rows, Run};
use std::collections::BTreeMap;
use taut_solver::Backend;
use toml::{Table, Value};

/// Most combinations of a run's lists.
const MOST_VALUES: f64 = 1e4;

pub(super) fn rows(run: &Run, shared: &Names) -> Result<Vec<Table>, CaseError> {
    let quick = shared.is_quick();
    let backend = run.step.backend.as_deref().map(str::parse::<Backend>);
    if matches!(backend, Some(Ok(backend)) if !backend.is_compiled()) {
        return Ok(Vec::new());
    }
    Ok(match &run.each {
        Rows::Combined(lists) => combined(run, lists, shared)?,
        Rows::Listed(rows) => {
            let is_long = |row: &Table| row.get("long").and_then(Value::as_bool) == Some(true);
            let kept = rows.iter().filter(|row| !(quick && is_long(row)));
            kept.cloned().collect()
        }
    })
}

/// All combinations of lists of values, or of the shorter ones; a table stands for its own values.
pub(super) fn combined(
    run: &Run,
    lists: &BTreeMap<String, Value>,
    names: &Names,
) -> Result<Vec<Table>, CaseError> {
    let mut all = vec![Table::new()];
    for (name, list) in lists {
        let shorter = run.quick.get(name).filter(|_| names.is_quick());
        let key = match shorter {
            Some(_) => "quick",
            None if std::ptr::eq(lists, &run.over) => "over",
            None => "each",
        };
        let inside = |e: CaseError| e.inside(name).inside(&key);
        let list = match shorter.unwrap_or(list) {
            Value::Array(list) => list.clone(),
            count => {
                let count = names.count("values", count, 1.0..=MOST_VALUES);
                let numbers = 0..count.map_err(inside)? as i64;
                numbers.map(Value::Integer).collect()
            }
        };
        let count = counted("values", (all.len() * list.len()) as f64, 1.0..=MOST_VALUES);
        count.map_err(inside)?;
        let longer = |known: &Table, value: &Value| {
            let mut row = known.clone();
            match value {
                Value::Table(several) => row.extend(several.clone()),
                one => drop(row.insert(name.clone(), one.clone())),
            }
            row
        };
        let longer = |known: &Table| list.iter().map(|v| longer(known, v)).collect::<Vec<_>>();
        all = all.iter().flat_map(longer).collect();
    }
    Ok(all)
}

/// The names with a row's values; formulas among these know the numbers.
pub(super) fn with_row(shared: &Names, row: &Table) -> Result<Names, CaseError> {
    let mut names = shared.clone();
    let is_formula = |value: &Value| value.as_str().is_some_and(|text| text.starts_with('='));
    let values = row.iter().filter(|(name, _)| *name != "long");
    let (formulas, numbers): (Vec<_>, Vec<_>) = values.partition(|(_, value)| is_formula(value));
    for (name, value) in numbers.into_iter().chain(formulas) {
        names.add(name, value)?;
    }
    Ok(names)
}

/// Names of the runs together: each value is a series over them, but for those that are one number.
pub(super) fn gathered(runs: &[&Names]) -> Names {
    let mut together = runs.first().map(|n| (*n).clone()).unwrap_or_default();
    for (name, series) in &mut together.values.known {
        let all = runs.iter().filter_map(|n| n.values.known.get(name));
        let all: Vec<f64> = all.flatten().copied().collect();
        let same = |x: &f64| x.to_bits() == all[0].to_bits();
        *series = if all.iter().all(same) {
            all[..1].to_vec()
        } else {
            all
        };
    }
    together
}
