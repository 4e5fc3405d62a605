//! Iterations and times to given errors, a table for each case, then where iterations win.

use super::{mark_least, ratio, table, text};
use crate::iterative::{Record, Results, Start, verdicts};
use std::fmt::Write;

/// A table for each case, then what all of them say, then what was left out.
#[must_use]
pub fn iterative(results: &Results, limit: usize) -> String {
    let mut out = String::new();
    let case = |r: &Record| (r.scene.clone(), r.size, r.mass_ratio.to_bits());
    for rows in results.records.chunk_by(|a, b| case(a) == case(b)) {
        let r = &rows[0];
        let _ = writeln!(out, "\n{}, {} rows", place(r), r.rows);
        out.push_str(&errors(rows));
    }
    out.push_str(&conclusions(&results.records, limit));
    out.push_str(&super::omissions(&results.omissions));
    out
}

fn place(r: &Record) -> String {
    format!("{} {}, ratio {}", r.scene, r.size, ratio(r.mass_ratio))
}

/// Rows: solvers; columns: errors, from both starts.
fn errors(rows: &[Record]) -> String {
    let (direct, iterative): (Vec<&Record>, Vec<&Record>) =
        rows.iter().partition(|r| r.start.is_none());
    let mut header = vec!["solver".to_owned()];
    for start in ["cold", "warm"] {
        header.extend(direct.iter().map(|r| format!("{start} {:.0e}", r.target)));
    }
    let mut t = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    if let Some(first) = direct.first() {
        let mut row = vec![first.backend.clone()];
        row.extend(
            direct
                .iter()
                .chain(&direct)
                .map(|r| match (r.iterations, r.ns) {
                    (Some(refinements), Some(ns)) => format!("r{refinements} {}", micro(ns)),
                    _ => "–".to_owned(),
                }),
        );
        t.add_row(row);
    }
    // Of each row the times of all columns.
    let reached = |r: &&Record| r.iterations.and(r.ns).filter(|_| r.failure.is_none());
    let mut times: Vec<Vec<Option<f64>>> = Vec::new();
    if !direct.is_empty() {
        times.push(direct.iter().chain(&direct).map(reached).collect());
    }
    for solver in iterative.chunk_by(|a, b| a.backend == b.backend) {
        let mut row = vec![solver[0].backend.clone()];
        row.extend(solver.iter().map(|r| cell(r)));
        t.add_row(row);
        times.push(solver.iter().map(reached).collect());
    }
    for column in 1..header.len() {
        let of = |row: &Vec<Option<f64>>| ((), row.get(column - 1).copied().flatten());
        mark_least(&mut t, column, &times.iter().map(of).collect::<Vec<_>>());
    }
    text(&t)
}

/// Iterations, time and the gain over the direct solver.
fn cell(r: &Record) -> String {
    let gain = |gain| match gain {
        None => String::new(),
        Some(g) if g < 0.095 => format!(" ×{g:.2}"),
        Some(g) => format!(" ×{g:.1}"),
    };
    match (&r.failure, r.iterations, r.ns) {
        (Some(_), ..) => "failed".to_owned(),
        (None, Some(0), _) => "guess".to_owned(),
        (None, Some(k), Some(ns)) => format!("{k}: {}{}", micro(ns), gain(r.gain())),
        _ => format!("no ({:.0e})", r.error),
    }
}

/// Microseconds in three digits.
fn micro(ns: f64) -> String {
    let us = ns / 1e3;
    let digits = if us < 10.0 {
        2
    } else {
        usize::from(us < 100.0)
    };
    format!("{us:.digits$}")
}

/// Where an iterative solver wins, if anywhere, and what does not get there.
fn conclusions(records: &[Record], limit: usize) -> String {
    let mut out = "\nWhere an iterative solver is faster than the direct one\n".to_owned();
    let mut t = table(&["start", "error", "cases", "largest gain", "by", "at"]);
    for v in verdicts(records) {
        let start = match v.start {
            Start::Cold => "cold",
            Start::Warm => "warm",
        };
        let named = v.wins.first().or(v.nearest.as_ref());
        let gain = named.and_then(Record::gain);
        t.add_row([
            start.to_owned(),
            format!("{:.0e}", v.target),
            format!("{} of {}", v.wins.len(), v.cases),
            gain.map_or("–".to_owned(), |g| format!("×{g:.2}")),
            named.map_or("–".to_owned(), |r| r.backend.clone()),
            named.map_or("–".to_owned(), place),
        ]);
    }
    out.push_str(&text(&t));
    let _ = writeln!(out, "\nNot reached within {limit} iterations, of all cases");
    out.push_str(&unreached(records));
    out
}

/// How many cases a solver does not get to each error in.
fn unreached(records: &[Record]) -> String {
    let iterative = || records.iter().filter(|r| r.start.is_some());
    let mut targets: Vec<f64> = iterative().map(|r| r.target).collect();
    targets.sort_by(|a, b| b.total_cmp(a));
    targets.dedup();
    let mut header = vec!["solver".to_owned()];
    for start in ["cold", "warm"] {
        header.extend(targets.iter().map(|target| format!("{start} {target:.0e}")));
    }
    let mut t = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let mut backends: Vec<&str> = Vec::new();
    for r in iterative() {
        if !backends.contains(&r.backend.as_str()) {
            backends.push(&r.backend);
        }
    }
    for backend in backends {
        let mut row = vec![backend.to_owned()];
        for start in Start::ALL {
            for &target in &targets {
                let own = |r: &&Record| {
                    (r.backend.as_str(), r.start, r.target) == (backend, Some(start), target)
                };
                let all = iterative().filter(own).count();
                let short = iterative()
                    .filter(own)
                    .filter(|r| r.iterations.is_none())
                    .count();
                row.push(format!("{short} of {all}"));
            }
        }
        t.add_row(row);
    }
    text(&t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iterative::{Config, run};
    use crate::table::plain;
    use indicatif::ProgressBar;
    use std::time::Duration;
    use taut_model::Network;

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
        let results = run(&config, &ProgressBar::hidden()).unwrap();
        let text = plain(&iterative(&results, config.limit));
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
