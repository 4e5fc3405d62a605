//! Iterations and times to given errors as tables, then where iterations win.

use super::{Record, Start, verdicts};
use serde_json::{Value, json};
use taut_output::row::{Row, number_of, text_of};
use taut_output::settings::distinct;
use taut_output::sheet::{self, Across, Column, Sheet, Show, column, digits};
use taut_output::table::ratio;

const TARGET: Column = column("target", "{}").shown(Show::Error(0));

pub(super) const SHEETS: &[Sheet] = &[Sheet {
    shared: &[
        column("scene", "{}").shown(Show::Row(scene)),
        column("size", ""),
        column("mass_ratio", "ratio {}").shown(Show::Ratio),
        column("rows", "{} rows"),
        column("start", "{}"),
    ],
    columns: &[column("backend", "solver")],
    across: Some(Across {
        by: &[TARGET],
        cells: &[column("ns", "").shown(Show::Row(cell)).least_of(reached)],
        several: false,
        most: usize::MAX,
    }),
    ..sheet::PLAIN
}];

fn scene(row: &Row) -> String {
    let size = number_of(row, "size").unwrap_or(f64::NAN);
    format!("{} {size}", text_of(row, "scene"))
}

/// The time of a row that got there.
fn reached(row: &Row) -> Option<f64> {
    let iterations = number_of(row, "iterations").filter(|_| row["failure"].is_null());
    iterations.and(number_of(row, "ns"))
}

/// Iterations, time and the gain over the direct solver.
fn cell(row: &Row) -> String {
    let iterations = number_of(row, "iterations");
    let us = number_of(row, "ns").map_or("-".to_owned(), |ns| digits(ns * 1e-3));
    let is_direct = row["start"].is_null();
    match (iterations, reached(row), number_of(row, "direct_ns")) {
        _ if !row["failure"].is_null() => "failed".to_owned(),
        (Some(refinements), Some(_), _) if is_direct => format!("r{refinements} {us}"),
        (Some(0.0), ..) => "guess".to_owned(),
        (Some(k), Some(ns), Some(direct)) => format!("{k}: {us} ×{}", digits(direct / ns)),
        (Some(k), Some(_), None) => format!("{k}: {us}"),
        _ if is_direct => "–".to_owned(),
        _ => format!("no ({:.0e})", number_of(row, "error").unwrap_or(f64::NAN)),
    }
}

const WINS: Sheet = Sheet {
    title: "Where an iterative solver is faster than the direct one",
    columns: &[
        column("start", "start"),
        column("target", "error").shown(Show::Error(0)),
        column("wins", "cases"),
        column("gain", "largest gain").shown(Show::Digits(1.0)),
        column("by", "by"),
        column("at", "at"),
    ],
    ..sheet::PLAIN
};

const UNREACHED: Sheet = Sheet {
    columns: &[column("backend", "solver")],
    across: Some(Across {
        by: &[column("start", "{}"), TARGET],
        cells: &[column("short", "")],
        several: false,
        most: usize::MAX,
    }),
    ..sheet::PLAIN
};

/// Where an iterative solver wins, if anywhere, and what does not get there.
pub(super) fn conclusions(records: &[Record], limit: usize) -> String {
    let wins = verdicts(records).into_iter().map(|v| {
        let named = v.wins.first().or(v.nearest.as_ref());
        let at = |r: &Record| format!("{} {}, ratio {}", r.scene, r.size, ratio(r.mass_ratio));
        json!({
            "start": v.start,
            "target": v.target,
            "wins": format!("{} of {}", v.wins.len(), v.cases),
            "gain": named.and_then(Record::gain),
            "by": named.map(|r| &r.backend),
            "at": named.map(at),
        })
    });
    let wins: Vec<Value> = wins.collect();
    format!(
        "{}\nNot reached within {limit} iterations, of all cases\n{}",
        WINS.of(&wins),
        UNREACHED.of(&unreached(records))
    )
}

/// How many cases a solver does not get to each error in.
fn unreached(records: &[Record]) -> Vec<Value> {
    let iterative = || records.iter().filter(|r| r.start.is_some());
    let key = |r: &Record| (r.backend.clone(), r.start, r.target.to_bits());
    let mut keys = distinct(iterative().map(key));
    // From zero first, and the largest error.
    keys.sort_by_key(|(_, start, target)| {
        (*start != Some(Start::Cold), std::cmp::Reverse(*target))
    });
    let row = |k: &(String, Option<Start>, u64)| {
        let own = || iterative().filter(|r| key(r) == *k);
        let short = own().filter(|r| r.iterations.is_none()).count();
        let (backend, start, target) = k;
        let short = format!("{short} of {}", own().count());
        json!({ "backend": backend, "start": start, "target": f64::from_bits(*target), "short": short })
    };
    keys.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::Cases;
    use crate::iterative::{Config, run};
    use crate::study::{data, tables};
    use std::time::Duration;
    use taut_model::Network;
    use taut_output::table::plain;

    #[test]
    fn the_tables_fit_into_120_columns_and_say_what_wins() {
        let config = Config {
            segments: vec![5],
            ratios: vec![1e5],
            networks: vec![(Network::Net, 3)],
            limit: 20,
            timing_budget: Duration::ZERO,
            ..Config::default()
        };
        let results = run(&config, &Cases::default()).unwrap();
        let rows = data(&results.records).unwrap();
        let text = tables(SHEETS, &rows) + &conclusions(&results.records, config.limit);
        let text = plain(&text);
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
        for words in [
            "hoist 5, ratio 1e5,",
            "net 3, ratio 100,",
            "of 2",
            "Not reached within 20 iterations",
        ] {
            assert!(text.contains(words), "{words}\n{text}");
        }
    }
}
